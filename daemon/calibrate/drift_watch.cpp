#include "daemon/calibrate/drift_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::calibrate {

DriftWatch::DriftWatch(const sensor::Sensor& sensor, const DriftOptions& options)
    : sensor_(sensor)
    , options_(options)
    , fit_(sensor)
    , mean_px_(2 * static_cast<std::size_t>(sensor.markerCount()))
    , seen_ns_(static_cast<std::size_t>(sensor.markerCount()))
    , rest_px_(mean_px_.size()) {}

void DriftWatch::add(const MarkerField& field) {
  if (field.zero == Id{}) return;
  if (field.zero != zero_) {
    zero_ = field.zero;
    drift_ = {};
    std::ranges::fill(mean_px_, 0.0F);
    std::ranges::fill(seen_ns_, 0);
    warned_ = false;
  }
  const auto motion = fit_({field.byForces_px(), field.valid});
  if (!motion || (field.flags & kFewMarkers) != 0) return;
  for (std::size_t i = 0; i < field.valid.size(); ++i) {
    const Eigen::Vector2d common = fit_.at(static_cast<int>(i), motion->value);
    rest_px_[2 * i] = field.byForces_px()[2 * i] - static_cast<float>(common.x());
    rest_px_[2 * i + 1] = field.byForces_px()[2 * i + 1] - static_cast<float>(common.y());
  }
  if (largestBulge(sensor_, {rest_px_, field.valid}, options_.allowance_px).found()) return;

  const std::int64_t now_ns = field.info.times.received_ns;
  const auto shareSince = [&](std::int64_t seen_ns) {
    return seen_ns == 0 ? 1.0 : -std::expm1(-1e-9 * static_cast<double>(now_ns - seen_ns) / options_.average_s);
  };
  const double share = shareSince(drift_.seen_ns);
  const auto follow = [share](double& mean, double value) { mean += share * (value - mean); };
  follow(drift_.shiftU_px, motion->value[0]);
  follow(drift_.shiftV_px, motion->value[1]);
  follow(drift_.scale, motion->value[2]);
  follow(drift_.roll, motion->value[3]);
  double square = 0.0;
  for (std::size_t i = 0; i < field.valid.size(); ++i) {
    if (!field.valid[i]) continue;
    const auto own = static_cast<float>(shareSince(std::exchange(seen_ns_[i], now_ns)));
    for (const std::size_t c : {2 * i, 2 * i + 1}) {
      mean_px_[c] += own * (rest_px_[c] - mean_px_[c]);
      square += mean_px_[c] * mean_px_[c];
    }
  }
  drift_.rms_px = std::sqrt(square / (2.0 * field.validCount));
  drift_.seen_ns = now_ns;
}

/// Returns how far a motion displaces the edge of the picture.
double DriftWatch::edge_px(double shift_px, double scale, double roll) const {
  return shift_px + 0.5 * sensor_.camera.height * std::hypot(scale, roll);
}

bool DriftWatch::takeWarning() {
  if (drift_.seen_ns == 0) return false;
  const sensor::PictureMotion& usual = sensor_.pictureMotion;
  const double limit = options_.largest * edge_px(usual.shift_px, usual.scale, usual.roll);
  const double now = edge_px(std::hypot(drift_.shiftU_px, drift_.shiftV_px), drift_.scale, drift_.roll);
  if (now < 0.5 * limit) warned_ = false;
  return now > limit && !std::exchange(warned_, true);
}

}  // namespace tractiond::calibrate
