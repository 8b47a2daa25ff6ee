// Shared by the evaluation's programs: a camera that shows markers at given places, and a tracker with its zero.
#pragma once

#include "base/error.h"
#include "daemon/track/tracker.h"
#include "sensor/gel_file.h"
#include "twin/renderer.h"

#include <Eigen/Geometry>
#include <tl/expected.hpp>

#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace evaluation {

using tractiond::Error;
using tractiond::Frame;
using tractiond::MarkerField;
using tractiond::RestPose;

/// Prints an error and ends the program with EX_DATAERR.
[[noreturn]] inline void fail(const std::string& what) {
  std::cerr << "evaluation: " << what << "\n";
  std::exit(EX_DATAERR);
}

/// Returns the value; ends the program as fail() if there is none.
template <typename T>
T expect(tl::expected<T, Error> result) {
  if (!result) fail(result.error().message());
  return *std::move(result);
}

/// Returns the file as numbers in this machine's byte order; empty if it does not exist. Ends the program as fail() if
/// it cannot be read. An incomplete last number is left out.
template <typename T>
std::vector<T> readAll(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) return {};
  std::vector<T> values(bytes / sizeof(T));
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
  if (!stream) fail(path.string() + " cannot be read");
  return values;
}

/// Motion of the whole picture since the rest pose was taken: shift, relative scale and roll (u towards v [rad]) about
/// the principal point, and relative brightness.
struct Stray {
  double u_px = 0.0, v_px = 0.0, scale = 0.0, roll = 0.0, brightness = 1.0;
};

/// Returns the sensor of a gel file; that of the paper if `file` is empty. Ends the program as fail() on an error.
inline sensor::Sensor loadSensor(const std::string& file) {
  if (file.empty()) return {};
  auto loaded = sensor::loadGel(file);
  if (!loaded) fail(loaded.error().where + ": " + loaded.error().what);
  return *std::move(loaded);
}

/// A camera that takes pictures of markers at given places. Thread-bound.
class Eye {
 public:
  /// The sensor must outlive it.
  Eye(const sensor::Sensor& sensor, const twin::Optics& optics, unsigned seed,
      twin::Format format = twin::Format::kRgb8)
      : sensor_(sensor)
      , optics_(optics)
      , seed_(seed)
      , format_(format)
      , project_(sensor.camera, sensor.gel.size.z())
      , markers_(sensor::markerPositions(sensor))
      , places_(2, markers_.cols()) {}

  /// Sets the offset of the markers from their places, 3 x M [m].
  void scatter(Eigen::Ref<const sensor::Points> by) { markers_ = sensor::markerPositions(sensor_) + by; }

  /// Sets the only highlight: centre u, v [px], radius [px], strength [levels]; none if that is 0.
  void light(const std::array<double, 4>& highlight) {
    if (highlight == highlight_) return;
    highlight_ = highlight;
    const auto& [u, v, radius, strength] = highlight;
    optics_.highlights.assign(strength > 0.0 ? 1 : 0, {{u, v}, radius, strength});
    renderers_.clear();
  }

  /// Returns the pixels (u, v), 2 x M, of markers displaced by `displacement` (3 x M [m]), in a picture with this
  /// motion. Valid until the next call.
  const Eigen::Matrix2Xd& project(Eigen::Ref<const sensor::Points> displacement, const Stray& stray) {
    const Eigen::Vector2d centre = sensor_.camera.principal_px;
    const Eigen::Vector2d scale(1.0, sensor_.camera.aspect);
    const Eigen::Matrix2d turn = (1.0 + stray.scale) * Eigen::Rotation2D<double>(stray.roll).toRotationMatrix();
    for (Eigen::Index m = 0; m < markers_.cols(); ++m) {
      const Eigen::Vector2d place = project_(markers_.col(m) + displacement.col(m));
      places_.col(m) = centre + scale.cwiseProduct(turn * (place - centre).cwiseQuotient(scale)) +
                       Eigen::Vector2d(stray.u_px, stray.v_px);
    }
    return places_;
  }

  /// Returns the next frame, with the markers at `places` (2 x M [px]). Its data are valid until the next call.
  Frame shoot(const Eigen::Matrix2Xd& places, double brightness) {
    auto renderer = renderers_.find(brightness);
    if (renderer == renderers_.end()) {
      twin::Optics optics = optics_;
      optics.contrast *= brightness;
      optics.background *= brightness;
      renderer = renderers_.try_emplace(brightness, sensor_, optics, format_).first;
    }
    picture_.resize(renderer->second.pictureSize());
    ++shots_;
    renderer->second.render(places, seed_ * 1'000'003U + shots_, picture_);
    Frame frame;
    frame.info.cameraFrameId = frame.info.frameNumber = shots_;
    frame.data = picture_.data();
    frame.size = picture_.size();
    frame.width = sensor_.camera.width;
    frame.height = sensor_.camera.height;
    frame.format = format_;
    frame.stride = tractiond::traitsOf(frame.format).stride(frame.width);
    return frame;
  }

  /// Returns displacements of 0, 3 x M.
  sensor::Points rest() const { return sensor::Points::Zero(3, markers_.cols()); }

 private:
  const sensor::Sensor& sensor_;
  twin::Optics optics_;
  unsigned seed_;
  twin::Format format_;
  sensor::Projection project_;
  sensor::Points markers_;
  Eigen::Matrix2Xd places_;
  std::map<double, twin::Renderer> renderers_;
  std::vector<std::uint8_t> picture_;
  std::array<double, 4> highlight_{};
  std::uint32_t shots_ = 0;
};

/// Returns a tracker that has taken a zero from unloaded frames. Ends the program as fail() if it takes none.
/// \param field overwritten
/// \param zero if not null, set to the zero
inline std::unique_ptr<tractiond::track::Tracker> trackerAtRest(const sensor::Sensor& sensor,
                                                                const tractiond::track::TrackOptions& options, Eye& eye,
                                                                MarkerField& field, RestPose* zero = nullptr) {
  auto tracker = std::make_unique<tractiond::track::Tracker>(sensor, options);
  const Eigen::Matrix2Xd rest = eye.project(eye.rest(), {});
  tracker->requestZero();
  for (int i = 0; i < 3 * options.zeroFrames + 30; ++i) {
    tracker->track(eye.shoot(rest, 1.0), field);
    RestPose pose;
    if (!tracker->takeRestPose(pose)) continue;
    if (zero != nullptr) *zero = std::move(pose);
    return tracker;
  }
  fail("the tracker takes no zero");
}

}  // namespace evaluation
