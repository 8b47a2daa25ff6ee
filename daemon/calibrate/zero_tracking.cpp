#include "daemon/calibrate/zero_tracking.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::calibrate {
namespace {

constexpr int kWindowFrames = 10;      // of a window at least
constexpr double kFollow_s = 20.0;     // time constant of the drift
constexpr double kBulge_px = 0.003;    // bulge that is no touch: 10 K leave 0.0024 px, 5 gf show 0.015 px or more
constexpr double kTouch_px = 0.05;     // bulge that is a touch, however much the markers scatter: a touch scatters them
constexpr double kMostChange = 3.0;    // deviation over a window, in stated ones, beyond which something came or went
constexpr double kLargestDrift = 5.0;  // beyond which there is a warning, in deviations of the picture's motion

/// Returns how far a motion displaces the edge of the picture.
double edge_px(const sensor::Sensor& sensor, double shift_px, double scale, double roll) {
  return shift_px + 0.5 * sensor.camera.height * std::hypot(scale, roll);
}

double seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-9 * static_cast<double>(std::max<std::int64_t>(to_ns - from_ns, 0));
}

}  // namespace

SmoothFit::SmoothFit(const sensor::Sensor& sensor) {
  constexpr int kFewForCubic = 60;  // markers: a touch on fewer could look like a polynomial
  const sensor::Points markers = sensor::markerPositions(sensor);
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  basis_.setZero(markers.cols(), kTerms);
  int first = 0;
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    for (int i = first; i < first + layer.count(); ++i) {
      const Eigen::Vector2d at = (project(markers.col(i)) - sensor.camera.principal_px) / (0.5 * sensor.camera.width);
      const double x = at.x(), y = at.y();
      basis_.row(i).head<3>() << 1.0, x, y;
      if (layer.count() >= kFewForCubic)
        basis_.row(i).tail<7>() << x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
    }
    ends_.push_back(first += layer.count());
  }
}

bool SmoothFit::operator()(const Displacements& displacements, std::span<float> smooth_px) const {
  int first = 0;
  for (const int end : ends_) {
    Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    Eigen::Matrix<double, kTerms, 2> right = Eigen::Matrix<double, kTerms, 2>::Zero();
    int count = 0;
    for (int i = first; i < end; ++i) {
      if (displacements.valid[static_cast<std::size_t>(i)] == 0) continue;
      const Eigen::Map<const Eigen::RowVector2f> seen(displacements.value_px.data() + 2 * std::ptrdiff_t{i});
      normal += basis_.row(i).transpose() * basis_.row(i);
      right += basis_.row(i).transpose() * seen.cast<double>();
      ++count;
    }
    if (2 * count < end - first) return false;
    for (int k = 0; k < kTerms; ++k) {
      if (normal(k, k) == 0.0) normal(k, k) = 1.0;  // not used in this layer
    }
    right = normal.ldlt().solve(right).eval();
    for (int i = first; i < end; ++i) {
      Eigen::Map<Eigen::RowVector2f>(smooth_px.data() + 2 * std::ptrdiff_t{i}) = (basis_.row(i) * right).cast<float>();
    }
    first = end;
  }
  return true;
}

ZeroTracking::ZeroTracking(const sensor::Sensor& sensor, bool follows)
    : follows_(follows)
    , motion_(sensor)
    , smooth_(sensor)
    , bulges_(sensor)
    , drift_px_(2 * static_cast<std::size_t>(sensor.markerCount()))
    , mean_px_(drift_px_.size())
    , change_px_(drift_px_.size())
    , shown_(drift_px_.size() / 2)
    , enough_(shown_.size())
    , smooth_px_(drift_px_.size()) {}

void ZeroTracking::begin(const MarkerField& field) {
  zero_ = field.zero;
  now_ = {};
  frames_ = 0;
  const FrameTimes& times = field.info.times;
  const double old_s =
      std::min(seconds(resumed_ns_.value_or(times.receivedReal_ns), times.receivedReal_ns), kResumed_K / kHeat_K_per_s);
  resumed_ns_.reset();
  rested_ns_ = times.received_ns - static_cast<std::int64_t>(1e9 * old_s);
  rested_ = field.info.extras;
  std::ranges::fill(drift_px_, 0.0F);
}

void ZeroTracking::takeOff(MarkerField& field) {
  if (field.zero != zero_) begin(field);
  field.drift_px.resize(drift_px_.size());
  field.elastic_px.resize(drift_px_.size());
  for (std::size_t i = 0; i < drift_px_.size(); ++i) {
    field.drift_px[i] = follows_ && field.valid[i / 2] != 0 ? drift_px_[i] : 0.0F;
    field.elastic_px[i] = field.displacement_px[i] - field.drift_px[i];
  }
  field.drift = now_;
  field.heatDeviation_K = follows_ ? static_cast<float>(warmthDeviation(field.info)) : 0.0F;
}

/// The camera's temperature only ever adds to it: a camera that says nothing, or the same all day, proves nothing.
double ZeroTracking::warmthDeviation(const FrameInfo& now) const {
  const bool isTold = rested_.hasTemperature && now.extras.hasTemperature;
  const double told_K = isTold ? double{now.extras.temperature_C} - double{rested_.temperature_C} : 0.0;
  const double possible_K = kHeat_K_per_s * seconds(rested_ns_, now.times.received_ns);
  return std::min(std::hypot(possible_K, told_K), kMost_K);
}

void ZeroTracking::watch(const MarkerField& field) {
  if (zero_ == Id{} || (field.flags & (kFewMarkers | kTorn)) != 0) return;
  const std::int64_t now_ns = field.info.times.received_ns;
  if (frames_ == 0) {
    for (auto* sums : {&mean_px_, &change_px_}) std::ranges::fill(*sums, 0.0F);
    std::ranges::fill(shown_, 0);
    shift_px_.setZero();
    variance_px2_ = 0.0;
    from_ns_ = now_ns;
  }
  add(field);
  if (frames_ < kWindowFrames || seconds(from_ns_, now_ns) < kWindow_s) return;
  endWindow(field.info);
  frames_ = 0;
}

/// Adds a frame to the window. Its mean displacement counts apart from the others: vibration is no touch.
void ZeroTracking::add(const MarkerField& field) {
  const auto left_px = [&](std::size_t i) { return field.elastic_px[i] - (follows_ ? 0.0F : drift_px_[i]); };
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  double variance_px2 = 0.0;
  int valid = 0;
  for (std::size_t marker = 0; marker < shown_.size(); ++marker) {
    if (field.valid[marker] == 0) continue;
    shift_px += Eigen::Vector2d(left_px(2 * marker), left_px(2 * marker + 1));
    variance_px2 += double{field.variance_px2[marker]};
    ++valid;
  }
  if (valid == 0) return;
  shift_px /= valid;
  ++frames_;
  shift_px_ += shift_px;
  variance_px2_ += variance_px2 / valid;
  for (std::size_t marker = 0; marker < shown_.size(); ++marker) {
    if (field.valid[marker] == 0) continue;
    ++shown_[marker];
    for (const std::size_t i : {2 * marker, 2 * marker + 1}) {
      const float beside_px = left_px(i) - static_cast<float>(shift_px[static_cast<Eigen::Index>(i % 2)]);
      mean_px_[i] += beside_px;
      change_px_[i] += beside_px * beside_px;
    }
  }
}

/// Returns whether neighbouring markers agree that they moved within the window by more than noise. Heat takes minutes.
bool ZeroTracking::changed() {
  const double noise_px = std::sqrt(2.0 * variance_px2_ / frames_);
  return bulges_({change_px_, enough_}, 0.0).size_px > kMostChange * noise_px;
}

void ZeroTracking::endWindow(const FrameInfo& last) {
  const Eigen::Vector2f shift_px = (shift_px_ / frames_).cast<float>();
  for (std::size_t marker = 0; marker < shown_.size(); ++marker) {
    enough_[marker] = 2 * shown_[marker] >= frames_ ? 1 : 0;
    for (const std::size_t i : {2 * marker, 2 * marker + 1}) {
      if (enough_[marker] == 0) {
        mean_px_[i] = 0.0F;
        continue;
      }
      const auto count = static_cast<float>(shown_[marker]);
      mean_px_[i] /= count;
      change_px_[i] = std::sqrt(std::max(change_px_[i] / count - mean_px_[i] * mean_px_[i], 0.0F));
      mean_px_[i] += shift_px[static_cast<Eigen::Index>(i % 2)];
    }
  }
  if (changed() || !smooth_({mean_px_, enough_}, smooth_px_)) return;
  for (std::size_t i = 0; i < mean_px_.size(); ++i) mean_px_[i] -= smooth_px_[i];
  const Bulge bulge = bulges_({mean_px_, enough_}, kBulge_px);
  if (bulge.found() || bulge.size_px > kTouch_px) return;

  const double since_s = seconds(std::exchange(rested_ns_, last.times.received_ns), last.times.received_ns);
  rested_ = last.extras;
  const auto share = static_cast<float>(-std::expm1(-since_s / kFollow_s));
  for (std::size_t i = 0; i < drift_px_.size(); ++i) drift_px_[i] += share * smooth_px_[i];
  if (const auto drifted = motion_({drift_px_, enough_})) {
    now_ = {.seen_ns = rested_ns_,
            .shiftU_px = drifted->value[0],
            .shiftV_px = drifted->value[1],
            .scale = drifted->value[2],
            .roll = drifted->value[3],
            .rms_px = drifted->rms_px,
            .isFollowed = follows_};
  }
}

bool DriftWarning::take(const sensor::Sensor& sensor, const MarkerField& field) {
  if (field.zero != std::exchange(zero_, field.zero)) warned_ = false;
  const RestDrift& drift = field.drift;
  if (drift.seen_ns == 0) return false;
  const sensor::PictureMotion& usual = sensor.pictureMotion;
  const double limit_px = kLargestDrift * edge_px(sensor, usual.shift_px, usual.scale, usual.roll);
  const double now_px = edge_px(sensor, std::hypot(drift.shiftU_px, drift.shiftV_px), drift.scale, drift.roll);
  if (now_px < 0.5 * limit_px) warned_ = false;
  return now_px > limit_px && !std::exchange(warned_, true);
}

}  // namespace tractiond::calibrate
