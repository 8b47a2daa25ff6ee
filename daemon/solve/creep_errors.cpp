#include "daemon/solve/creep_errors.h"

#include "daemon/solve/kernels.h"
#include "daemon/solve/mechanics_noise.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace tractiond::solve {
namespace {

/// Farther away from a contact than so many pitches of the nodes, the markers tell of other contacts as well.
constexpr double kReach = 2.0;
/// Markers beyond so many times that have no weight.
constexpr double kFarthest = 3.0;

/// Of the squares of what is displaced, at least this share counts as no noise.
constexpr double kLeastSignal = 0.1;

/// Returns by which share of the displacement of now an error is one, less the noise in its squares.
double shareOf(double with, double squares, double noise) {
  return squares > 0.0 ? with / std::max(squares - noise, kLeastSignal * squares) : 0.0;
}

}  // namespace

CreepErrors::CreepErrors(const sensor::Sensor& sensor)
    : places_(sensor::markerPositions(sensor))
    , reach_m_(kReach * sensor.nodes.pitch)
    , rest_(2 * places_.cols()) {}

void CreepErrors::take(const MarkerField& markers) {
  markers_ = &markers;
  noise_px_ = 0.0;
  ofAll_.setZero();
  if (!(markers.creepError_px > 0.0F)) return;
  const auto coordinates = std::ssize(markers.elastic_px);
  const Eigen::Map<const Eigen::VectorXf> elastic(markers.elastic_px.data(), coordinates);
  const Eigen::Map<const Eigen::VectorXf> variances(markers.variance_px2.data(), coordinates / 2);
  const double squares = double{elastic.squaredNorm()}, noise = 2.0 * double{variances.sum()};
  double variance = 0.0;
  for (Eigen::Index k = 0; k < std::ssize(markers.creepErrors_px) / coordinates; ++k) {
    const Eigen::Map<const Eigen::VectorXf> error(markers.creepErrors_px.data() + k * coordinates, coordinates);
    const double with = double{error.dot(elastic)};
    ofAll_[k] = shareOf(with, squares, noise);
    rest_ = error - static_cast<float>(squares > 0.0 ? with / squares : 0.0) * elastic;
    variance +=
        square(noiseWithMechanics_px(std::span<const float>(rest_.data(), markers.elastic_px.size()), 0.0, 1.0));
  }
  noise_px_ = std::sqrt(variance);
}

CreepErrors::Shares CreepErrors::about(const Eigen::Vector3d& at) const {
  Shares shares = Shares::Zero();
  if (!(markers_->creepError_px > 0.0F)) return shares;
  constexpr int kSlow = 6, kAxes = 2;
  const std::size_t coordinates = markers_->elastic_px.size();
  const auto terms = static_cast<Eigen::Index>(markers_->creepErrors_px.size() / coordinates);
  // Of an axis: the slow functions, the displacement of now, the errors; products of these with the slow ones and the
  // displacement, by the markers' weights.
  Eigen::Matrix<double, kSlow + 1 + kMost, 1> row = decltype(row)::Zero();
  std::array<Eigen::Matrix<double, kSlow + 1, kSlow + 1 + kMost>, kAxes> products;
  for (auto& each : products) each.setZero();
  double noise = 0.0;
  for (std::size_t marker = 0; marker < coordinates / kAxes; ++marker) {
    const Eigen::Vector3d away = (places_.col(static_cast<Eigen::Index>(marker)) - at) / reach_m_;
    if (markers_->valid[marker] == 0 || away.squaredNorm() > square(kFarthest)) continue;
    const double by = std::exp(-0.5 * away.squaredNorm());
    const double x = away.x(), y = away.y();
    noise += kAxes * by * double{markers_->variance_px2[marker]};
    row.head<kSlow>() << 1.0, x, y, x * x, x * y, y * y;
    for (std::size_t axis = 0; axis < kAxes; ++axis) {
      const std::size_t i = kAxes * marker + axis;
      row[kSlow] = double{markers_->elastic_px[i]};
      for (Eigen::Index k = 0; k < terms; ++k)
        row[kSlow + 1 + k] = double{markers_->creepErrors_px[k * coordinates + i]};
      products[axis] += by * row.head<kSlow + 1>() * row.transpose();
    }
  }
  Eigen::Matrix<double, 1, 1 + kMost> with = decltype(with)::Zero();
  for (const auto& each : products) {
    const Eigen::LDLT<Eigen::Matrix<double, kSlow, kSlow>> slow(each.topLeftCorner<kSlow, kSlow>());
    with += each.bottomRightCorner<1, 1 + kMost>() -
            each.block<kSlow, 1>(0, kSlow).transpose() * slow.solve(each.topRightCorner<kSlow, 1 + kMost>());
  }
  for (Eigen::Index k = 0; k < terms; ++k) shares[k] = shareOf(with[1 + k], with[0], noise);
  return shares;
}

}  // namespace tractiond::solve
