#include "daemon/calibrate/rest_noise.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::calibrate {
namespace {

// Lower bounds of RestNoise::motion: some seconds do not show how large it becomes in the hours until the next zero.
constexpr sensor::PictureMotion kLeast = {.shift_px = 2e-3, .scale = 5e-6, .roll = 5e-6};

}  // namespace

RestNoiseMeter::RestNoiseMeter(const sensor::Sensor& sensor)
    : sensor_(sensor)
    , fit_(sensor)
    , markers_(static_cast<std::size_t>(sensor.markerCount())) {}

void RestNoiseMeter::add(const MarkerField& field) {
  const auto motion = fit_({field.displacement_px, field.valid});
  if (!motion) return;
  double variance = 0.0;
  for (std::size_t i = 0; i < markers_.size(); ++i) {
    if (!field.valid[i]) continue;
    const Eigen::Vector2d remains = Eigen::Vector2d(field.displacement_px[2 * i], field.displacement_px[2 * i + 1]) -
                                    fit_.at(static_cast<int>(i), motion->value);
    markers_[i].sum += remains;
    markers_[i].square += remains.squaredNorm();
    ++markers_[i].count;
    variance += field.variance_px2[i];
  }
  motionSquare_ += motion->value.cwiseAbs2();
  motionNoise_ += motion->covariance.diagonal();
  promised_ += variance / field.validCount;
  ++frames_;
}

RestNoise RestNoiseMeter::summary() const {
  assert(frames_ >= 2);
  RestNoise noise;
  noise.frames = frames_;
  double square = 0.0, degrees = 0.0;
  std::vector<float> mean_px(2 * markers_.size());
  std::vector<std::uint8_t> valid(markers_.size());
  for (std::size_t i = 0; i < markers_.size(); ++i) {
    const Sums& sums = markers_[i];
    if (sums.count < 2) continue;
    const Eigen::Vector2d mean = sums.sum / sums.count;
    square += sums.square - sums.count * mean.squaredNorm();
    degrees += 2.0 * (sums.count - 1);
    valid[i] = 1;
    mean_px[2 * i] = static_cast<float>(mean.x());
    mean_px[2 * i + 1] = static_cast<float>(mean.y());
  }
  noise.centre_px = std::sqrt(square / degrees);
  noise.overPromised = noise.centre_px / std::sqrt(promised_ / frames_);
  const Eigen::Vector4d own = ((motionSquare_ - motionNoise_) / frames_).cwiseMax(0.0);
  noise.motion.shift_px = std::max(std::sqrt(0.5 * (own[0] + own[1])), kLeast.shift_px);
  noise.motion.scale = std::max(std::sqrt(own[2]), kLeast.scale);
  noise.motion.roll = std::max(std::sqrt(own[3]), kLeast.roll);
  noise.bulge = largestBulge(sensor_, {mean_px, valid}, kUntouched_px);
  return noise;
}

}  // namespace tractiond::calibrate
