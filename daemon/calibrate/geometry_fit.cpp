// The unknowns are the twelve numbers of the camera, and for each layer its depth, pitch and place (except that of the
// first one, which defines the frame). All are scaled to an effect of about one pixel, so that one step size suits all
// central differences.
#include "daemon/calibrate/geometry_fit.h"

#include "daemon/calibrate/scaled_equations.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace tractiond::calibrate {

namespace {

constexpr int kFocal = 0, kPrincipal = 1, kPosition = 3, kRotation = 6, kDistortion = 9, kAspect = 11;  // unknowns
constexpr int kCamera = 12;        // number of the camera's unknowns, above
constexpr int kOfLayer = 4;        // unknowns of a layer: depth, pitch, x, y
constexpr double kStep = 1e-3;     // step of the scaled unknowns for finite differences
constexpr double kSettled = 1e-2;  // step that ends the iteration, in deviations of the unknowns
constexpr int kRounds = 4;
constexpr double kScatterFloor_px = 1e-4;  // scatter that is assumed for exact data

/// Returns the size of a unit of each unknown of the camera: about a pixel at the picture's edge.
Eigen::Matrix<double, kCamera, 1> cameraUnits() {
  Eigen::Matrix<double, kCamera, 1> units;
  units << 4e-3, 1.0, 1.0, 0.15e-3, 0.15e-3, 0.6e-3, 1e-3, 1e-3, 4e-3, 0.07, 1.0, 4e-3;
  return units;
}

/// Returns the prior deviations of the unknowns; 0: it is fixed.
Eigen::VectorXd deviationsOf(const sensor::Sensor& start, const GeometryOptions& options) {
  const auto units = cameraUnits();
  Eigen::VectorXd deviation =
      Eigen::VectorXd::Constant(kCamera + kOfLayer * std::ssize(start.layers), std::numeric_limits<double>::infinity());
  deviation[kFocal] = start.uncertainty.focal / units[kFocal];
  deviation.segment<2>(kPrincipal).setConstant(start.uncertainty.principal_px / units[kPrincipal]);
  deviation[kDistortion] = start.uncertainty.k1 / units[kDistortion];
  deviation[kDistortion + 1] = start.uncertainty.k2 / units[kDistortion + 1];
  deviation[kAspect] = options.aspect / units[kAspect];
  for (int i = 0; i < std::ssize(start.layers); ++i) {
    auto ofLayer = deviation.segment<kOfLayer>(kCamera + kOfLayer * i);
    ofLayer << options.depth, options.pitch, options.shift, options.shift;
    if (i == 0) ofLayer.tail<2>().setZero();
    if (i == 0 && options.holdsFirst) ofLayer.setZero();
  }
  return deviation;
}

/// The iteration: present unknowns, residuals, and the markers that are used.
class Fit {
 public:
  Fit(const sensor::Sensor& start, const sensor::Camera& from, std::span<const float> seen_px,
      std::span<const std::uint8_t> present, const GeometryOptions& options)
      : start_(start)
      , options_(options)
      , markers_(sensor::markerPositions(start))
      , deviation_(deviationsOf(start, options))
      , unknowns_(static_cast<int>(deviation_.size()))
      , seen_(
            Eigen::Map<const Eigen::VectorXf>(seen_px.data(), static_cast<Eigen::Index>(seen_px.size())).cast<double>())
      , counts_(present.begin(), present.end())
      , x_(Eigen::VectorXd::Zero(unknowns_))
      , modelled_(seen_.size())
      , residual_(seen_.size())
      , jacobian_(seen_.size(), unknowns_) {
    const auto units = cameraUnits();
    if (!isFixed(kDistortion)) x_[kDistortion] = (from.k1 - start.camera.k1) / units[kDistortion];
    if (!isFixed(kDistortion + 1)) x_[kDistortion + 1] = (from.k2 - start.camera.k2) / units[kDistortion + 1];
  }

  Geometry::Outcome run() {
    using Outcome = Geometry::Outcome;
    if (counted() < options_.fewest) return Outcome::kFewMarkers;
    if (!moveTo(x_)) return Outcome::kDiverged;
    int rounds = 0;
    for (int iteration = 0; iteration < options_.iterations; ++iteration) {
      const std::optional<double> moved = step();
      if (!moved) return Outcome::kDiverged;
      if (*moved > kSettled) continue;
      // Repeats the fit without outliers, a few times at most: if a touch displaces many markers, they cannot be
      // sorted out.
      const bool dropped = dropOutliers();
      if (counted() < options_.fewest) return Outcome::kFewMarkers;
      if (!dropped || ++rounds == kRounds) return Outcome::kConverged;
    }
    return Outcome::kDiverged;
  }

  int counted() const { return static_cast<int>(std::ranges::count(counts_, 1)); }
  double rms_px() const { return std::sqrt(residual_.squaredNorm() / (2 * counted())); }
  sensor::Camera camera() const { return camera(x_); }
  /// Returns the covariance of the camera's unknowns, in their units.
  Eigen::Matrix<double, kCamera, kCamera> covariance() const {
    const auto units = cameraUnits();
    return units.asDiagonal() * covariance_.topLeftCorner<kCamera, kCamera>() * units.asDiagonal();
  }
  /// Sets Geometry's offset of the second layer and its deviation.
  void compareLayers(Geometry& result) const {
    constexpr std::array kOffset = {kCamera + kOfLayer, kCamera + kOfLayer + 2, kCamera + kOfLayer + 3};
    if (unknowns_ < kCamera + 2 * kOfLayer) return;
    result.offset = x_(kOffset);
    result.offsetDeviation = covariance_.diagonal()(kOffset).cwiseSqrt();
  }
  /// Returns the residuals of all markers, including those that are not used.
  std::vector<float> remains_px() const {
    const Eigen::VectorXf all = (seen_ - modelled_).cast<float>();
    return {all.begin(), all.end()};
  }

 private:
  /// Returns whether an unknown is fixed: its prior deviation is zero.
  bool isFixed(int unknown) const { return deviation_[unknown] == 0.0; }
  double stepOf(int unknown) const { return unknown < kCamera ? kStep : kStep * deviation_[unknown]; }

  sensor::Camera camera(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd change = x.head<kCamera>().cwiseProduct(cameraUnits());
    sensor::Camera camera = start_.camera;
    camera.focal_px *= 1.0 + change[kFocal];
    camera.principal_px += change.segment<2>(kPrincipal);
    camera.position += change.segment<3>(kPosition);
    camera.rotation += change.segment<3>(kRotation);
    camera.k1 += change[kDistortion];
    camera.k2 += change[kDistortion + 1];
    camera.aspect *= 1.0 + change[kAspect];
    return camera;
  }

  /// Projects all markers. Returns false if no camera can have this pose.
  bool project(const Eigen::VectorXd& x, Eigen::VectorXd& pixels) const {
    const sensor::Camera seen = camera(x);
    if (!(seen.focal_px > 0.0) || !(seen.aspect > 0.0)) return false;
    if (!sensor::isBehindWindow(seen, start_.gel.size.z())) return false;
    const sensor::Projection projection(seen, start_.gel.size.z());
    Eigen::Index marker = 0;
    for (std::size_t i = 0; i < start_.layers.size(); ++i) {
      const int count = start_.layers[i].count();
      const Eigen::Vector2d centre = markers_.block(0, marker, 2, count).rowwise().mean();
      // In units of the tolerances; a tolerance of zero keeps the value fixed.
      const Eigen::Vector4d error = x.segment<kOfLayer>(kCamera + kOfLayer * static_cast<int>(i));
      for (const Eigen::Index end = marker + count; marker < end; ++marker) {
        Eigen::Vector3d point = markers_.col(marker);
        point.head<2>() += error[1] * (point.head<2>() - centre) + error.tail<2>();
        point.z() += error[0];
        pixels.segment<2>(2 * marker) = projection(point);
      }
    }
    return pixels.allFinite();
  }

  bool moveTo(const Eigen::VectorXd& x) {
    if (!project(x, modelled_)) return false;
    x_ = x;
    for (Eigen::Index i = 0; i < seen_.size(); ++i) residual_[i] = counts_[i / 2] != 0 ? seen_[i] - modelled_[i] : 0.0;
    return true;
  }

  bool differentiate() {
    Eigen::VectorXd after(seen_.size()), before(seen_.size());
    for (int k = 0; k < unknowns_; ++k) {
      if (isFixed(k)) {
        jacobian_.col(k).setZero();
        continue;
      }
      Eigen::VectorXd moved = x_;
      moved[k] += stepOf(k);
      if (!project(moved, after)) return false;
      moved[k] -= 2 * stepOf(k);
      if (!project(moved, before)) return false;
      jacobian_.col(k) = (after - before) / (2 * stepOf(k));
    }
    for (Eigen::Index i = 0; i < seen_.size(); ++i) {
      if (counts_[i / 2] == 0) jacobian_.row(i).setZero();
    }
    return true;
  }

  /// Returns the cost that is minimised, for a given scatter.
  double cost(double scatter2) const {
    double sum = residual_.squaredNorm() / scatter2;
    for (int k = 0; k < unknowns_; ++k) {
      const double deviation = deviation_[k];
      if (deviation > 0.0 && std::isfinite(deviation)) sum += std::pow(x_[k] / deviation, 2);
    }
    return sum;
  }

  /// Moves by `change`, half of it, a quarter ..., whichever first lowers the cost. Returns false if none does.
  bool descend(const Eigen::VectorXd& change, double scatter2) {
    constexpr double kLeastShare = 1e-3, kRounding = 1e-9;
    const Eigen::VectorXd from = x_;
    const double before = cost(scatter2);
    for (double share = 1.0; share > kLeastShare; share *= 0.5) {
      if (moveTo(from + share * change) && cost(scatter2) <= before * (1.0 + kRounding)) return true;
    }
    moveTo(from);
    return false;
  }

  /// Makes a Gauss-Newton step, shortened if it does not lower the cost. Returns the length of the full step, in
  /// deviations.
  std::optional<double> step() {
    if (!differentiate()) return std::nullopt;
    const double scatter2 =
        std::max(residual_.squaredNorm() / (2 * counted() - kCamera), kScatterFloor_px * kScatterFloor_px);
    Eigen::MatrixXd normal = jacobian_.transpose() * jacobian_ / scatter2;
    Eigen::VectorXd right = jacobian_.transpose() * residual_ / scatter2;
    for (int k = 0; k < unknowns_; ++k) {
      if (isFixed(k)) {
        normal(k, k) = 1.0;
      } else if (std::isfinite(deviation_[k])) {
        const double weight = 1.0 / (deviation_[k] * deviation_[k]);
        normal(k, k) += weight;
        right[k] -= weight * x_[k];
      }
    }
    const ScaledEquations equations(normal);
    const Eigen::VectorXd change = equations.solve(right);
    if (!change.allFinite()) return std::nullopt;
    const bool lower = descend(change, scatter2);
    covariance_ = equations.inverse();
    return lower ? std::sqrt(change.dot(normal * change)) : 0.0;
  }

  bool dropOutliers() {
    const double limit = options_.outlier * rms_px() + kScatterFloor_px;
    bool dropped = false;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      auto own = residual_.segment<2>(2 * static_cast<Eigen::Index>(i));
      if (counts_[i] == 0 || own.norm() <= limit) continue;
      counts_[i] = 0;
      own.setZero();
      dropped = true;
    }
    return dropped;
  }

  const sensor::Sensor& start_;
  const GeometryOptions& options_;
  sensor::Points markers_;
  Eigen::VectorXd deviation_;  ///< as of deviationsOf()
  int unknowns_;
  Eigen::VectorXd seen_;
  std::vector<std::uint8_t> counts_;
  Eigen::VectorXd x_, modelled_, residual_;
  Eigen::MatrixXd jacobian_, covariance_;
};

}  // namespace

Geometry fitGeometry(const sensor::Sensor& start, std::span<const float> seen_px, std::span<const std::uint8_t> present,
                     const GeometryOptions& options) {
  return fitGeometryFrom(start.camera, start, seen_px, present, options);
}

Geometry fitGeometryFrom(const sensor::Camera& from, const sensor::Sensor& file, std::span<const float> seen_px,
                         std::span<const std::uint8_t> present, const GeometryOptions& options) {
  sensor::Sensor start = file;  // the prior deviations do not refer to the pose
  start.camera.position = from.position;
  start.camera.rotation = from.rotation;
  Geometry result;
  result.camera = start.camera;
  result.uncertainty = start.uncertainty;
  Fit fit(start, from, seen_px, present, options);
  result.markers = fit.counted();
  result.outcome = fit.run();
  if (result.outcome != Geometry::Outcome::kConverged) return result;

  const auto covariance = fit.covariance();
  const Eigen::Matrix<double, kCamera, 1> deviation = covariance.diagonal().cwiseSqrt();
  result.camera = fit.camera();
  result.uncertainty.focal = deviation[kFocal];
  result.uncertainty.position = deviation.segment<3>(kPosition);
  result.uncertainty.rotation = deviation.segment<3>(kRotation);
  result.uncertainty.focalDistance = covariance(kFocal, kPosition + 2) / (deviation[kFocal] * deviation[kPosition + 2]);
  result.k1Deviation = deviation[kDistortion];
  result.k2Deviation = deviation[kDistortion + 1];
  result.principalDeviation_px = deviation.segment<2>(kPrincipal).maxCoeff();
  if (options.aspect > 0.0) result.aspectDeviation = start.camera.aspect * deviation[kAspect];
  fit.compareLayers(result);
  result.residual_px = fit.rms_px();
  result.outliers = result.markers - fit.counted();
  result.markers = fit.counted();
  // A sharp touch displaces few markers, and so far that they are dropped as outliers.
  result.bulge = largestBulge(start, {fit.remains_px(), present}, options.allowance_px);
  return result;
}

}  // namespace tractiond::calibrate
