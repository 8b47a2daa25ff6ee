#include "daemon/solve/rest_places.h"

#include "sensor/elastic/parallel.h"
#include "sensor/elastic/quadrature.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// A marker that seems to lie farther from its place than this share of its layer's pitch is taken for another one or
/// dirt. Of those of 0.3 mm of scatter one in 250 lies beyond a third: with the grid's place it spoils a contact.
constexpr double kPlausible = 0.5;

/// Times that the picture's motion is fitted, and that a pixel is projected back: each begins with what the last one
/// left.
constexpr int kFits = 3, kSteps = 4;

/// Markers that make a motion of the picture.
constexpr int kFewest = 10;

/// Markers along either axis that the smooth part is interpolated between. Largest error under 4 N on one point of the
/// paper's gel of 15 and 40 mm, 0.3 mm of scatter: 0.18 and 0.03 of a marker's noise, with four 0.40 and 0.18.
constexpr int kAlong = 6;

/// Where the lateral place at a pixel is on the plane of `place`, from which the search begins.
Vector2d backProjected(const sensor::Projection& project, Eigen::Vector3d place, const Vector2d& pixel) {
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Matrix2d slope = project.jacobian(place).leftCols<2>();
    place.head<2>() += slope.inverse() * (pixel - project(place));
  }
  return place.head<2>();
}

/// From values at the markers of the grids to those at the scattered places, 2M x 2M: u and v alike.
Eigen::SparseMatrix<double, Eigen::RowMajor> interpolation(const sensor::Sensor& sensor) {
  const Index markers = sensor.markerCount();
  std::vector<Eigen::Triplet<double>> shares;
  shares.reserve(2 * kAlong * kAlong * markers);
  Index first = 0;
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    const std::array<int, 2> count = {layer.columns, layer.rows};
    for (int own = 0; own < layer.count(); ++own) {
      const std::array<int, 2> place = {own % layer.columns, own / layer.columns};
      std::array<int, 2> low{}, along{};
      std::array<MatrixXd, 2> share;  // of the polynomial through these markers
      for (int axis = 0; axis < 2; ++axis) {
        const double at = place[axis] + sensor.scatter(axis, first + own) / layer.pitch;
        along[axis] = std::min(kAlong, count[axis]);
        low[axis] = std::clamp(static_cast<int>(std::floor(at)) - kAlong / 2 + 1, 0, count[axis] - along[axis]);
        share[axis] = sensor::elastic::lagrange(VectorXd::LinSpaced(along[axis], 0.0, along[axis] - 1.0),
                                                VectorXd::Constant(1, at - low[axis]));
      }
      for (int y = 0; y < along[1]; ++y) {
        for (int x = 0; x < along[0]; ++x) {
          const Index from = first + Index{low[1] + y} * layer.columns + low[0] + x;
          const double product = share[1](y) * share[0](x);
          for (int row = 0; row < 2; ++row) shares.emplace_back(2 * (first + own) + row, 2 * from + row, product);
        }
      }
    }
    first += layer.count();
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> result(2 * markers, 2 * markers);
  result.setFromTriplets(shares.begin(), shares.end());
  return result;
}

/// Multiplied by a sparse matrix it is read in memory order.
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Influence of points on the markers as if the block were a half-space [px/N].
MatrixXd halfSpace(const sensor::Sensor& sensor, const sensor::Points& points) {
  using sensor::elastic::displacementMatrix;
  return sensor::elastic::toImage(sensor, displacementMatrix(sensor.gel, sensor::elastic::Model::kHalfSpace,
                                                             sensor::markerPositions(sensor), points));
}

}  // namespace

RestPlaces restPlaces(const sensor::Sensor& sensor, std::span<const float> place_px,
                      std::span<const std::uint8_t> present) {
  assert(!sensor.body && std::ssize(present) == sensor.markerCount());
  sensor::Sensor drawn = sensor;
  drawn.scatter.resize(3, 0);
  const sensor::Points markers = sensor::markerPositions(drawn);
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  const MatrixXd byMotion = sensor::elastic::pictureMotionMatrix(drawn);
  std::vector<double> limits_m;
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    limits_m.insert(limits_m.end(), static_cast<std::size_t>(layer.count()), kPlausible * layer.pitch);
  }
  RestPlaces places;
  std::vector<std::uint8_t> counts(present.begin(), present.end());
  Eigen::Vector4d motion = Eigen::Vector4d::Zero();
  for (int fit = 0; fit < kFits; ++fit) {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (Index m = 0; m < markers.cols(); ++m) {
      if (counts[m] == 0) continue;
      const auto slope = byMotion.middleRows<2>(2 * m);
      const Vector2d pixel = Eigen::Vector2f::Map(place_px.data() + 2 * m).cast<double>();
      normal += slope.transpose() * slope;
      right += slope.transpose() * (pixel - project(markers.col(m)));
    }
    const int counted = static_cast<int>(std::count(counts.begin(), counts.end(), std::uint8_t{1}));
    motion = counted < kFewest ? Eigen::Vector4d::Zero().eval() : normal.ldlt().solve(right).eval();
    places = RestPlaces{.scatter = sensor::Points::Zero(3, markers.cols())};
    for (Index m = 0; m < markers.cols(); ++m) {
      const auto i = static_cast<std::size_t>(m);
      counts[i] = 0;
      if (present[i] == 0) {
        ++places.missing;
        continue;
      }
      const Vector2d pixel =
          Eigen::Vector2f::Map(place_px.data() + 2 * m).cast<double>() - byMotion.middleRows<2>(2 * m) * motion;
      const Vector2d beside = backProjected(project, markers.col(m), pixel) - markers.col(m).head<2>();
      if (!(beside.norm() <= limits_m[i])) {
        ++places.implausible;
        continue;
      }
      counts[i] = 1;
      places.scatter.col(m).head<2>() = beside;
      ++places.measured;
    }
  }
  places.rms_m = std::sqrt(places.scatter.squaredNorm() / std::max(2 * places.measured, 1));
  return places;
}

MatrixXd influenceAtPlaces(const sensor::Sensor& sensor, const Atoms& atoms, const Factors& drawn) {
  assert(!sensor.body && sensor.scatter.cols() == sensor.markerCount());
  constexpr Index kTogether = 128, kMarkers = 64;  // points, markers together
  sensor::Sensor straight = sensor;
  straight.scatter.resize(3, 0);
  const auto scattered = interpolation(sensor);
  MatrixXd influence(2 * Index{sensor.markerCount()}, 3 * static_cast<Index>(atoms.pointCount()));
  for (Index first = 0; first < atoms.points.cols(); first += kTogether) {
    const sensor::Points points = atoms.points.middleCols(first, std::min(kTogether, atoms.points.cols() - first));
    RowMajorMatrix rest = -halfSpace(straight, points);
    rest += drawn.influence.view().middleRows(3 * first, rest.cols()).transpose().cast<double>();
    influence.middleCols(3 * first, rest.cols()) = halfSpace(sensor, points);
    sensor::elastic::inParallel((sensor.markerCount() + kMarkers - 1) / kMarkers, [&](Index part) {
      const Index row = 2 * kMarkers * part, rows = std::min(2 * kMarkers, scattered.rows() - row);
      influence.block(row, 3 * first, rows, rest.cols()) += RowMajorMatrix(scattered.middleRows(row, rows) * rest);
    });
  }
  return influence;
}

}  // namespace tractiond::solve
