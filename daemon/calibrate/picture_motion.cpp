#include "daemon/calibrate/picture_motion.h"

#include "base/quantile.h"
#include "sensor/elastic/influence.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace tractiond::calibrate {

namespace {

constexpr int kFewestMarkers = 10;      // markers that are needed to determine a motion
constexpr int kNeighbours = 6;          // number of the 3 x 3 markers that must be valid
constexpr double kSixSigma = 6.0;       // the largest of a thousand medians stays below 4.5
constexpr double kMedianOfNine = 0.41;  // deviation of the median of nine values, relative to that of one

}  // namespace

PictureMotionFit::PictureMotionFit(const sensor::Sensor& sensor)
    : byMotion_(sensor::elastic::pictureMotionMatrix(sensor)) {}

Eigen::Vector2d PictureMotionFit::at(int marker, const Eigen::Vector4d& motion) const {
  return byMotion_.middleRows<2>(2 * Eigen::Index{marker}) * motion;
}

std::vector<float> PictureMotionFit::without(const Eigen::Vector4d& motion, std::span<const float> value_px) const {
  std::vector<float> remains(value_px.begin(), value_px.end());
  for (std::size_t i = 0; i < remains.size() / 2; ++i) {
    Eigen::Map<Eigen::Vector2f>(remains.data() + 2 * i) -= at(static_cast<int>(i), motion).cast<float>();
  }
  return remains;
}

std::optional<PictureMotion> PictureMotionFit::operator()(const Displacements& displacements) const {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  double square = 0.0;
  int markers = 0;
  for (Eigen::Index i = 0; 2 * i < byMotion_.rows(); ++i) {
    if (!displacements.valid[i]) continue;
    const auto byMotion = byMotion_.middleRows<2>(2 * i);
    const Eigen::Vector2d seen(displacements.value_px[2 * i], displacements.value_px[2 * i + 1]);
    normal += byMotion.transpose() * byMotion;
    right += byMotion.transpose() * seen;
    square += seen.squaredNorm();
    ++markers;
  }
  if (markers < kFewestMarkers) return std::nullopt;
  const Eigen::LDLT<Eigen::Matrix4d> factor(normal);
  PictureMotion motion;
  motion.value = factor.solve(right);
  const double remains = std::max(square - motion.value.dot(right), 0.0);
  motion.rms_px = std::sqrt(remains / (2 * markers));
  motion.covariance = factor.solve(Eigen::Matrix4d::Identity()) * (remains / (2 * markers - 4));
  return motion;
}

Bulge largestBulge(const sensor::Sensor& sensor, const Displacements& displacements, double allowance_px) {
  return BulgeSearch(sensor)(displacements, allowance_px);
}

BulgeSearch::BulgeSearch(const sensor::Sensor& sensor)
    : layers_(sensor.layers)
    , markers_(sensor::markerPositions(sensor)) {
  squares_.reserve(static_cast<std::size_t>(markers_.cols()));
}

Bulge BulgeSearch::operator()(const Displacements& displacements, double allowance_px) {
  Bulge bulge;
  squares_.clear();
  Eigen::Index first = 0;
  for (const sensor::MarkerLayer& layer : layers_) {
    for (int row = 1; row + 1 < layer.rows; ++row) {
      for (int column = 1; column + 1 < layer.columns; ++column) {
        std::array<float, 9> u{}, v{};
        int count = 0;
        for (int y = row - 1; y <= row + 1; ++y) {
          for (int x = column - 1; x <= column + 1; ++x) {
            const Eigen::Index i = first + y * layer.columns + x;
            if (!displacements.valid[i]) continue;
            u[count] = displacements.value_px[2 * i];
            v[count] = displacements.value_px[2 * i + 1];
            ++count;
          }
        }
        if (count < kNeighbours) continue;
        const auto number = static_cast<std::size_t>(count);
        const Eigen::Vector2d middle(quantile(std::span(u).first(number)), quantile(std::span(v).first(number)));
        const Eigen::Index own = first + row * layer.columns + column;
        if (displacements.valid[own]) {
          const Eigen::Vector2d value(displacements.value_px[2 * own], displacements.value_px[2 * own + 1]);
          squares_.push_back((value - middle).squaredNorm());
        }
        if (const double size = middle.norm(); size > bulge.size_px) {
          bulge.size_px = size;
          bulge.place = markers_.col(own).head<2>();
        }
      }
    }
    first += layer.count();
  }
  double deviation = 0.0;
  if (!squares_.empty()) {
    deviation =
        std::sqrt(quantile(squares_) / (2.0 * std::numbers::ln2));  // of a coordinate, by the median of the lengths
  }
  bulge.limit_px = kSixSigma * kMedianOfNine * deviation + allowance_px;
  return bulge;
}

}  // namespace tractiond::calibrate
