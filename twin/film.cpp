#include "twin/film.h"

#include "base/whole_file.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace twin {

using tractiond::Error;

namespace {

constexpr double kTurn = 6.283185307179586;
constexpr double kSmallest = 1e-6;                 // [N] smaller pressures of a hand are left out
constexpr std::uint32_t kOtherNoise = 0x5bd1e995;  // between the seeds of the fingers

void project(const sensor::Projection& projection, const sensor::Points& points, Eigen::Matrix2Xd& pixels) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) pixels.col(i) = projection(points.col(i));
}

}  // namespace

GelFilm::GelFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache)
    : scenario_(scenario)
    , seed_(seed)
    , model_(scenario.sensor, scenario.sensor.body ? std::vector<Contact>{} : scenario.contacts, cache)
    , project_(scenario.sensor.camera, scenario.sensor.gel.size.z())
    , rest_(sensor::markerPositions(scenario.sensor))
    , rest_px_(2, rest_.cols())
    , creep_(scenario.creep, rest_.cols()) {
  if (scenario.sensor.body) body_.emplace(scenario.sensor);
  project(project_, rest_, rest_px_);
  markers_px_ = rest_px_;
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

void GelFilm::moveMarkers(const std::vector<ContactState>& states, double rise_K) {
  if (states == states_ && rise_K == rise_K_ && creep_.isNone()) return;
  states_ = states;
  rise_K_ = rise_K;
  sensor::Points points = rest_ + displacement(states);
  if (!creep_.isNone()) points += creep_.now();
  const Warmth& warmth = scenario_.warmth;
  const Eigen::Vector3d base(0.0, 0.0, scenario_.sensor.gel.size.z());
  if (rise_K != 0.0) points += warmth.expansion * rise_K * (rest_.colwise() - base);
  project(project_, points, markers_px_);
  if (rise_K == 0.0) return;
  const Eigen::Vector4d motion(warmth.shift_px.x(), warmth.shift_px.y(), warmth.scale, warmth.roll);
  for (auto marker : markers_px_.colwise()) marker += project_.motionOf(marker) * (rise_K * motion);
}

void GelFilm::draw(Picture& picture, Truth& truth) {
  const double phase_s = std::fmod(picture.time_s, scenario_.period_s);
  truth = Truth{};
  truth.time_s = picture.time_s;
  truth.rise_K = scenario_.warmth.at(phase_s);
  std::vector<ContactState> states = held_;
  if (states.empty()) {
    for (const Contact& contact : scenario_.contacts) states.push_back(contact.at(phase_s));
  }
  tell(states, truth);
  if (!creep_.isNone()) creep_.advance(picture.time_s, displacement(states));
  for (const Absence& absence : scenario_.absences) {
    if (phase_s < absence.from_s || phase_s >= absence.to_s) continue;
    truth.missing.insert(truth.missing.end(), absence.markers.begin(), absence.markers.end());
  }
  moveMarkers(states, truth.rise_K);
  truth.displacement_px = markers_px_ - rest_px_;
  drawn_px_ = markers_px_;
  for (const int marker : truth.missing) drawn_px_.col(marker).setConstant(std::numeric_limits<double>::quiet_NaN());

  const Optics& optics = scenario_.optics;
  Renderer& renderer = renderers_.try_emplace(picture.format, scenario_.sensor, optics, picture.format).first->second;
  picture.pixels.resize(renderer.pictureSize());
  renderer.render(drawn_px_, seed_ + static_cast<std::uint32_t>(picture.number), picture.pixels,
                  1.0 + optics.drift * std::sin(kTurn * picture.time_s / optics.driftPeriod));
}

HandFilm::HandFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache)
    : hand_(*scenario.hand, scenario.sensor.gel)
    , films_(2, GelFilm(scenario, seed, cache)) {
  films_.back().reseed(seed ^ kOtherNoise);
}

void HandFilm::draw(int finger, Picture& picture, Truth& truth) {
  const RoundContact& contact = hand_.contact(finger);
  const Eigen::Matrix3Xd parts = contact.parts();
  std::vector<ContactState> states(static_cast<std::size_t>(parts.cols()));
  ContactState whole{.position = hand_.position(finger)};
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Eigen::Vector3d force = parts.col(static_cast<Eigen::Index>(i));
    if (force.cwiseAbs().maxCoeff() < kSmallest) continue;
    states[i] = {.position = whole.position, .force = force};
    whole.force += force;
  }
  GelFilm& film = films_[static_cast<std::size_t>(finger)];
  film.hold(std::move(states));
  film.draw(picture, truth);
  truth.contacts.clear();
  if (whole.isLoaded()) {
    truth.contacts.push_back({Contact::Shape::kHertz, contact.radius(), whole, contact.stickRatio(), {}});
  }
  truth.finger = finger;
  truth.hand = hand_.state();
}

tl::expected<std::unique_ptr<RawFilm>, Error> RawFilm::open(const std::filesystem::path& file, Format format,
                                                            std::size_t pictureSize) {
  auto pixels = tractiond::readWholeFile(file);
  if (!pixels) return tl::unexpected(Error{EX_NOINPUT, "cannot be read: " + pixels.error().message(), file});
  if (pixels->empty() || pictureSize == 0 || pixels->size() % pictureSize != 0) {
    return tl::unexpected(Error{EX_DATAERR,
                                "has " + std::to_string(pixels->size()) +
                                    " bytes, which is no multiple of a picture's " + std::to_string(pictureSize),
                                file});
  }
  auto film = std::make_unique<RawFilm>();
  film->format_ = format;
  film->pictureSize_ = pictureSize;
  film->pixels_ = *std::move(pixels);
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
