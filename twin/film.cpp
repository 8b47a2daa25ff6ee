#include "twin/film.h"

#include <sysexits.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

namespace twin {

namespace {

constexpr double kTurn = 6.283185307179586;

template <typename Event>
bool isNow(const Event& event, double phase_s) {
  return phase_s >= event.from_s && phase_s < event.to_s;
}

void project(const sensor::Projection& projection, const sensor::Points& points, Eigen::Matrix2Xd& pixels) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) pixels.col(i) = projection(points.col(i));
}

}  // namespace

GelFilm::GelFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache,
                 const sensor::elastic::Progress& progress)
    : scenario_(scenario)
    , seed_(seed)
    , model_(scenario.sensor, scenario.sensor.body ? std::vector<Contact>{} : scenario.contacts, cache, progress)
    , project_(scenario.sensor.camera, scenario.sensor.gel.size.z())
    , rest_(sensor::markerPositions(scenario.sensor))
    , rest_px_(2, rest_.cols())
    , creep_(scenario.creep, rest_.cols()) {
  if (scenario.sensor.body) body_.emplace(scenario.sensor);
  project(project_, rest_, rest_px_);
  markers_px_ = rest_px_;
}

std::vector<ContactState> GelFilm::statesAt(double phase_s) const {
  if (held_) return *held_;
  std::vector<ContactState> states;
  for (const Contact& contact : scenario_.contacts) states.push_back(contact.at(phase_s));
  return states;
}

sensor::Points GelFilm::displacement(std::span<const ContactState> states) {
  if (!body_) return model_.displacement(states);
  sensor::Points forces = sensor::Points::Zero(3, scenario_.sensor.nodes.count());
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i].isLoaded()) forces += body_->load(scenario_.contacts[i], states[i]).nodeForces;
  }
  return body_->displacement(forces);
}

void GelFilm::tell(std::span<const ContactState> states, Truth& truth) const {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!states[i].isLoaded()) continue;
    const Contact& contact = scenario_.contacts[i];
    truth.contacts.push_back({contact.shape, contact.radius, states[i], {}, {}});
    if (!body_) {
      truth.resultant.add(states[i]);
      continue;
    }
    const BodyLoad load = body_->load(contact, states[i]);
    truth.contacts.back().state.force = load.force;
    truth.contacts.back().onBody = {load.place, load.normal};
    truth.resultant.force += load.force;
    truth.resultant.moment += body_->moment(load.nodeForces);
  }
}

const Eigen::Matrix2Xd& GelFilm::markersAt(double phase_s) {
  const std::vector<ContactState> states = statesAt(phase_s);
  const double rise_K = scenario_.warmth.at(phase_s);
  if (states == states_ && rise_K == rise_K_ && creep_.isNone()) return markers_px_;
  states_ = states;
  rise_K_ = rise_K;
  sensor::Points points = rest_ + displacement(states);
  if (!creep_.isNone()) points += creep_.now();
  if (rise_K == 0.0) {
    project(project_, points, markers_px_);
    return markers_px_;
  }
  const Warmth& warmth = scenario_.warmth;
  const Eigen::Vector3d base(0.0, 0.0, scenario_.sensor.gel.size.z());
  points += warmth.expansion * rise_K * (rest_.colwise() - base);
  project(project_, points, markers_px_);
  const Eigen::Vector4d motion(warmth.shift_px.x(), warmth.shift_px.y(), warmth.scale, warmth.roll);
  for (Eigen::Index i = 0; i < markers_px_.cols(); ++i) {
    markers_px_.col(i) += project_.motionOf(markers_px_.col(i)) * (rise_K * motion);
  }
  return markers_px_;
}

void GelFilm::draw(Picture& picture, Truth& truth) {
  const double phase_s = std::fmod(picture.time_s, scenario_.period_s);
  truth = Truth{};
  truth.time_s = picture.time_s;
  truth.rise_K = scenario_.warmth.at(phase_s);
  const std::vector<ContactState> states = statesAt(phase_s);
  tell(states, truth);
  if (!creep_.isNone()) creep_.advance(picture.time_s, displacement(states));
  for (const Absence& absence : scenario_.absences) {
    if (isNow(absence, phase_s)) {
      truth.missing.insert(truth.missing.end(), absence.markers.begin(), absence.markers.end());
    }
  }

  Optics optics = scenario_.optics;
  for (const Defocus& defocus : scenario_.defocuses) {
    if (isNow(defocus, phase_s)) optics.blur_px = defocus.blur_px;
  }
  Renderer& renderer =
      renderers_.try_emplace(std::pair(picture.format, optics.blur_px), scenario_.sensor, optics, picture.format)
          .first->second;
  const double brightness = 1.0 + optics.drift * std::sin(kTurn * picture.time_s / optics.driftPeriod);
  const auto drawAt = [&](double moment_s, std::vector<std::uint8_t>& pixels) {
    drawn_px_ = markersAt(moment_s);
    for (const int marker : truth.missing) drawn_px_.col(marker).setConstant(std::numeric_limits<double>::quiet_NaN());
    pixels.resize(renderer.pictureSize());
    renderer.render(drawn_px_, seed_ + static_cast<std::uint32_t>(picture.number), pixels, brightness);
  };
  drawAt(phase_s, picture.pixels);
  truth.displacement_px = markers_px_ - rest_px_;

  const auto height = static_cast<std::ptrdiff_t>(scenario_.sensor.camera.height);
  const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(picture.pixels.size()) / height;
  for (const Tear& tear : scenario_.tears) {
    if (!isNow(tear, phase_s)) continue;
    truth.torn = true;
    if (tear.lag_s > 0.0) {
      drawAt(std::max(phase_s - tear.lag_s, 0.0), older_);
      std::copy(older_.begin() + tear.row * stride, older_.end(), picture.pixels.begin() + tear.row * stride);
    }
    const std::ptrdiff_t shift = tear.shift_px * (stride / scenario_.sensor.camera.width);
    for (std::ptrdiff_t row = tear.row; row < height; ++row) {
      const auto first = picture.pixels.begin() + row * stride;
      std::rotate(first, first + (stride - shift) % stride, first + stride);
    }
  }
}

tl::expected<std::unique_ptr<RawFilm>, Failure> RawFilm::open(const std::filesystem::path& file, Format format,
                                                              std::size_t pictureSize) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream) return tl::unexpected(Failure{EX_NOINPUT, file.string() + " cannot be read"});
  if (size == 0 || pictureSize == 0 || size % pictureSize != 0) {
    return tl::unexpected(Failure{EX_DATAERR, file.string() + " has " + std::to_string(size) +
                                                  " bytes, which is no multiple of a picture's " +
                                                  std::to_string(pictureSize)});
  }
  auto film = std::make_unique<RawFilm>();
  film->format_ = format;
  film->pictureSize_ = pictureSize;
  film->pixels_.resize(size);
  stream.read(reinterpret_cast<char*>(film->pixels_.data()), static_cast<std::streamsize>(size));
  if (!stream) return tl::unexpected(Failure{EX_IOERR, file.string() + " cannot be read to its end"});
  return film;
}

void RawFilm::draw(Picture& picture, Truth& truth) {
  const std::size_t image = picture.number % (pixels_.size() / pictureSize_);
  truth = Truth{};
  truth.time_s = picture.time_s;
  truth.image = image;
  if (picture.format != format_) {
    std::ranges::fill(picture.pixels, std::uint8_t{0});
    return;
  }
  const auto from = pixels_.begin() + static_cast<std::ptrdiff_t>(image * pictureSize_);
  picture.pixels.assign(from, from + static_cast<std::ptrdiff_t>(pictureSize_));
}

}  // namespace twin
