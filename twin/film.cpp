#include "twin/film.h"

#include <sysexits.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

namespace twin {

namespace {

void project(const sensor::Projection& projection, const sensor::Points& points, Eigen::Matrix2Xd& pixels) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) pixels.col(i) = projection(points.col(i));
}

}  // namespace

GelFilm::GelFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache,
                 const sensor::elastic::Progress& progress)
    : scenario_(scenario)
    , seed_(seed)
    , model_(scenario.sensor, scenario.contacts, cache, progress)
    , project_(scenario.sensor.camera, scenario.sensor.gel.size.z())
    , rest_(sensor::markerPositions(scenario.sensor.layers))
    , rest_px_(2, rest_.cols()) {
  project(project_, rest_, rest_px_);
  markers_px_ = rest_px_;
}

void GelFilm::draw(Picture& picture, Truth& truth) {
  const double phase_s = std::fmod(picture.time_s, scenario_.period_s);
  truth = Truth{picture.time_s, std::nullopt, {}, {}, {}, {}};
  std::vector<ContactState> states;
  for (const Contact& contact : scenario_.contacts) {
    states.push_back(contact.at(phase_s));
    if (!states.back().isLoaded()) continue;
    truth.contacts.push_back({&contact, states.back()});
    truth.resultant.add(states.back());
  }
  if (states != states_) {
    states_ = states;
    project(project_, rest_ + model_.displacement(states), markers_px_);
  }
  truth.displacement_px = markers_px_ - rest_px_;

  drawn_px_ = markers_px_;
  for (const Absence& absence : scenario_.absences) {
    if (phase_s < absence.from_s || phase_s >= absence.to_s) continue;
    for (const int marker : absence.markers) {
      drawn_px_.col(marker).setConstant(std::numeric_limits<double>::quiet_NaN());
      truth.missing.push_back(marker);
    }
  }
  const auto renderer =
      renderers_.try_emplace(picture.format, scenario_.sensor, scenario_.optics, picture.format).first;
  picture.pixels.resize(renderer->second.pictureSize());
  renderer->second.render(drawn_px_, seed_ + static_cast<std::uint32_t>(picture.number), picture.pixels);
}

tl::expected<std::unique_ptr<RawFilm>, Failure> RawFilm::open(const std::filesystem::path& file,
                                                              std::size_t pictureSize) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream) return tl::unexpected(Failure{EX_NOINPUT, file.string() + " cannot be read"});
  if (size == 0 || size % pictureSize != 0) {
    return tl::unexpected(Failure{EX_DATAERR, file.string() + " has " + std::to_string(size) +
                                                  " bytes, which is no multiple of a picture's " +
                                                  std::to_string(pictureSize)});
  }
  auto film = std::unique_ptr<RawFilm>(new RawFilm);
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
  const auto from = pixels_.begin() + static_cast<std::ptrdiff_t>(image * pictureSize_);
  std::copy_n(from, std::min(pictureSize_, picture.pixels.size()), picture.pixels.begin());
}

}  // namespace twin
