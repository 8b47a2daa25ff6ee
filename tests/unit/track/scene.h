// Pictures of a gel whose markers are where the test says.
#pragma once

#include "daemon/track/planes.h"
#include "daemon/track/tracker.h"
#include "twin/renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace tractiond::track {

/// A smooth bump: the displacement [px] of what rests at a place in the picture.
struct Bump {
  Eigen::Vector2d centre = {319.5, 239.5};
  double width_px = 45.0;
  Eigen::Vector2d peak_px = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator()(const Eigen::Vector2d& place) const {
    return peak_px * std::exp(-0.5 * (place - centre).squaredNorm() / (width_px * width_px));
  }
};

/// The plane of a colour that the picture has as such.
inline Plane planeOf(const Frame& frame, sensor::Colour colour) {
  const sensor::MarkerLayer layer{.colour = colour};
  Planes planes({&layer, 1});
  planes.read(frame);
  return planes.own(0);
}

class Scene {
 public:
  using Field = std::function<Eigen::Vector2d(const Eigen::Vector2d&)>;

  explicit Scene(const twin::Optics& optics = {}, twin::Format format = twin::Format::kRgb8,
                 const sensor::Sensor& s = {})
      : sensor(s)
      , format_(format)
      , renderer_(s, optics, format)
      , picture_(renderer_.pictureSize()) {
    const sensor::Projection project(s.camera, s.gel.size.z());
    const sensor::Points points = sensor::markerPositions(s);
    rest.resize(2, points.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) rest.col(i) = project(points.col(i));
    now = rest;
  }

  int markers() const { return static_cast<int>(rest.cols()); }

  /// Takes a share of the markers away for good.
  void remove(double share, unsigned seed) {
    std::mt19937 generator(seed);
    std::bernoulli_distribution gone(share);
    for (Eigen::Index i = 0; i < rest.cols(); ++i) {
      if (gone(generator)) rest.col(i).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    now = rest;
  }

  /// Markers go from rest to rest + field(rest); blue ones, which are deeper below the touch, by `blueShare` of it.
  void displace(const Field& field, double blueShare = 1.0) {
    for (Eigen::Index i = 0; i < rest.cols(); ++i) {
      const double share = i < sensor.layers[0].count() ? blueShare : 1.0;
      now.col(i) = rest.col(i) + share * field(rest.col(i));
    }
  }

  /// Other light, another lens, from now on.
  void change(const twin::Optics& optics) { renderer_ = twin::Renderer(sensor, optics, format_); }

  /// The picture of `now`, with its own noise. `brightness`: of the LED, relative.
  const Frame& shoot(bool discontinuity = false, double brightness = 1.0) {
    renderer_.render(now, ++shots_, picture_, brightness);
    frame_.info.cameraFrameId = frame_.info.frameNumber = shots_;
    frame_.info.discontinuity = discontinuity;
    frame_.data = picture_.data();
    frame_.size = picture_.size();
    frame_.width = sensor.camera.width;
    frame_.height = sensor.camera.height;
    frame_.format = format_;
    frame_.stride = traitsOf(frame_.format).stride(frame_.width);
    return frame_;
  }

  /// The last picture before its noise, as twin::Renderer::light() says.
  std::span<const std::int16_t> light() const { return renderer_.light(); }

  /// Over what was shot last: the rows from `row` on are of the moment when the markers were there.
  void tear(int row, const Eigen::Matrix2Xd& markers_px) {
    std::vector<std::uint8_t> other(picture_.size());
    renderer_.render(markers_px, shots_, other);
    const std::ptrdiff_t from = std::ptrdiff_t{row} * frame_.stride;
    std::copy(other.begin() + from, other.end(), picture_.begin() + from);
  }

  /// Over what was shot last: the rows from `row` on are moved to the right.
  void shift(int row, int px) {
    const std::ptrdiff_t bytes = std::ptrdiff_t{px} * frame_.stride / frame_.width, stride = frame_.stride;
    for (auto line = picture_.begin() + row * stride; line != picture_.end(); line += stride) {
      std::rotate(line, line + (stride - bytes) % stride, line + stride);
    }
  }

  /// A disc of brightness over what was shot last, in all colours.
  void smear(double u, double v, double radius_px, std::uint8_t level) {
    const auto step = static_cast<int>(twin::samplesPerPixel(format_));
    const auto from = [&](double centre) { return std::max(0, static_cast<int>(centre - radius_px)); };
    const auto to = [&](double centre, int size) { return std::min(size, static_cast<int>(centre + radius_px) + 2); };
    for (int y = from(v); y < to(v, frame_.height); ++y) {
      for (int x = from(u); x < to(u, frame_.width); ++x) {
        if (std::hypot(x - u, y - v) > radius_px) continue;
        for (int k = 0; k < step; ++k) picture_[static_cast<std::size_t>(y * frame_.stride + x * step + k)] = level;
      }
    }
  }

  sensor::Sensor sensor;
  Eigen::Matrix2Xd rest, now;  ///< px; not finite: not there

 private:
  twin::Format format_;
  twin::Renderer renderer_;
  std::vector<std::uint8_t> picture_;
  Frame frame_;
  std::uint32_t shots_ = 0;
};

/// How a field compares with the truth.
struct Comparison {
  int valid = 0;
  int wrong = 0;         ///< valid, but off by more than six deviations and half a pixel
  double rms_px = 0.0;   ///< of the others, per coordinate
  double bias_px = 0.0;  ///< length of their mean error
  double ratio = 0.0;    ///< mean squared error over mean variance
};

inline Comparison compare(const Scene& scene, const MarkerField& field) {
  Comparison result;
  double square = 0.0, variance = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int i = 0; i < scene.markers(); ++i) {
    if (!field.valid[i]) continue;
    ++result.valid;
    const Eigen::Vector2d measured(field.displacement_px[2 * i], field.displacement_px[2 * i + 1]);
    const Eigen::Vector2d error = measured - (scene.now.col(i) - scene.rest.col(i));
    if (!(error.norm() < std::max(0.5, 6.0 * std::sqrt(2.0 * field.variance_px2[i])))) {
      ++result.wrong;
      continue;
    }
    square += error.squaredNorm();
    variance += 2.0 * field.variance_px2[i];
    sum += error;
  }
  const int right = std::max(result.valid - result.wrong, 1);
  result.rms_px = std::sqrt(square / (2.0 * right));
  result.bias_px = sum.norm() / right;
  result.ratio = square / variance;
  return result;
}

/// A tracker, and the field it writes.
struct Tracking {
  explicit Tracking(const Scene& scene, const TrackOptions& options = {})
      : tracker(scene.sensor, options) {
    field.resize(scene.markers());
  }

  Outcome operator()(const Frame& frame) { return tracker.track(frame, field); }

  /// Shoots until there is a rest pose; at most `frames`.
  bool start(Scene& scene, int frames = 40) {
    for (int i = 0; i < frames; ++i) {
      if ((*this)(scene.shoot()) == Outcome::kTracked) return true;
    }
    return false;
  }

  /// Takes the newest zero, which must be there.
  RestPose takeZero() {
    RestPose pose;
    EXPECT_TRUE(tracker.takeRestPose(pose));
    return pose;
  }

  Tracker tracker;
  MarkerField field;
};

/// One that has a zero of the scene, which is at rest.
struct Started : Tracking {
  explicit Started(Scene& scene, const TrackOptions& options = {})
      : Tracking(scene, options) {
    EXPECT_TRUE(start(scene));
  }
};

}  // namespace tractiond::track
