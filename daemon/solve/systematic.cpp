#include "daemon/solve/systematic.h"

#include "daemon/solve/wrench.h"
#include "sensor/elastic/influence.h"

#include <Eigen/Dense>

#include <cmath>

namespace tractiond::solve {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix63 = Eigen::Matrix<double, 6, 3, Eigen::RowMajor>;
using Vector18 = Eigen::Matrix<double, 18, 1>;
using Matrix18 = Eigen::Matrix<double, 18, 18>;

constexpr int kCameraNumbers = 7;

/// The camera a deviation elsewhere; nothing where that deviation is 0.
sensor::Camera strayed(const sensor::Sensor& sensor, int number) {
  sensor::Camera camera = sensor.camera;
  const sensor::Uncertainty& by = sensor.uncertainty;
  if (number < 3)
    camera.position[number] += by.position[number];
  else if (number < 6)
    camera.rotation[number - 3] += by.rotation[number - 3];
  else
    camera.focal_px *= 1.0 + by.focal * std::sqrt(1.0 - by.focalDistance * by.focalDistance);
  if (number == 2) camera.focal_px *= 1.0 + by.focal * by.focalDistance;  // what strays with the distance
  return camera;
}

/// Nine nodes across the face, and forces there that make up any wrench.
struct Loads {
  explicit Loads(const sensor::Sensor& sensor) {
    const sensor::NodeGrid& grid = sensor.nodes;
    for (const int row : {grid.rows / 4, grid.rows / 2, grid.rows * 3 / 4}) {
      for (const int column : {grid.columns / 4, grid.columns / 2, grid.columns * 3 / 4}) {
        nodes.push_back(row * grid.columns + column);
      }
    }
    positions = sensor::nodePositions(sensor)(Eigen::all, nodes);
    Eigen::MatrixXd wrenches(6, 3 * positions.cols());
    for (Eigen::Index i = 0; i < positions.cols(); ++i) wrenches.middleCols<3>(3 * i) = unitWrenches(positions.col(i));
    forces = wrenches.completeOrthogonalDecomposition().pseudoInverse();  // a row of nodes makes no moment along it
  }

  std::vector<int> nodes;
  sensor::Points positions;
  Eigen::MatrixXd forces;  // from wrenches to forces at the nodes, 27 x 6
};

using Reading = Eigen::MatrixXd;  // 6 x 2M: from displacements to the wrench

/// By all modes with the penalty lambda^2. `left`: U from column `first` on; `wrenches`: those of the modes' forces, r
/// x 6.
Reading byModes(const RowMatrix& left, int first, const std::vector<double>& singularValues, double lambda,
                Eigen::MatrixXd wrenches) {
  for (Eigen::Index k = 0; k < wrenches.rows(); ++k) {
    const double s = singularValues[static_cast<std::size_t>(k)];
    wrenches.row(k) *= s / (s * s + lambda * lambda);
  }
  Reading reading(6, left.rows());
  for (int i = 0; i < left.rows(); ++i) {
    reading.col(i) = wrenches.transpose() * Eigen::VectorXf::Map(left.row(i) + first, wrenches.rows()).cast<double>();
  }
  return reading;
}

/// As a contact about a node is read: by the nodes around it and the picture's motion. `rowOf(node)` is the first
/// of the node's three rows of `influence`; `motion`: P Q^1/2.
template <typename RowOf>
Reading byNodesAround(int node, const sensor::Sensor& sensor, const RowMatrix& influence, RowOf rowOf,
                      const Eigen::MatrixXd& motion, double noise_px) {
  constexpr int kReach = 3;             // in pitches
  constexpr double kNodeForce_N = 0.2;  // expected
  const sensor::NodeGrid& grid = sensor.nodes;
  const sensor::Points nodes = sensor::nodePositions(sensor);
  const Eigen::Index coordinates = motion.rows();
  std::vector<int> near;
  for (int other = 0; other < grid.count(); ++other) {
    const int rows = other / grid.columns - node / grid.columns, columns = other % grid.columns - node % grid.columns;
    if (rows * rows + columns * columns <= kReach * kReach) near.push_back(other);
  }
  // In numbers of what is expected of each.
  const Eigen::Index forces = 3 * static_cast<Eigen::Index>(near.size());
  Eigen::MatrixXd seen(coordinates, forces + kMotions), wrenches = Eigen::MatrixXd::Zero(6, forces + kMotions);
  for (Eigen::Index i = 0; i < forces; ++i) {
    const float* const row = influence.row(rowOf(near[static_cast<std::size_t>(i / 3)]) + static_cast<int>(i % 3));
    seen.col(i) = kNodeForce_N * Eigen::VectorXf::Map(row, coordinates).cast<double>();
  }
  for (Eigen::Index i = 0; 3 * i < forces; ++i) {
    wrenches.middleCols<3>(3 * i) = kNodeForce_N * unitWrenches(nodes.col(near[static_cast<std::size_t>(i)]));
  }
  seen.rightCols<kMotions>() = motion;
  Eigen::MatrixXd normal = seen.transpose() * seen;
  normal.diagonal().array() += noise_px * noise_px;
  return wrenches * normal.llt().solve(seen.transpose());
}

Eigen::MatrixXd bodyColumns(const sensor::Sensor& sensor, const std::vector<int>& nodes) {
  Eigen::MatrixXd columns(sensor.body->influence.rows(), 3 * static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    columns.middleCols<3>(3 * static_cast<Eigen::Index>(i)) =
        sensor.body->influence.middleCols<3>(3 * static_cast<Eigen::Index>(nodes[i])) *
        (sensor.body->youngsModulus / sensor.gel.youngsModulus);
  }
  return columns;
}

/// What a force at `at` is misread by [force, moment about the place of the force], from what the wrench is.
Reading aboutPlace(const Reading& reading, const Eigen::Vector3d& at) {
  Reading result = reading;
  for (Eigen::Index i = 0; i < reading.cols(); ++i) result.col(i).tail<3>() -= at.cross(reading.col(i).head<3>());
  return result;
}

/// Adds up what each marker's own depth misreads. `reading`: about the place of the force; `byDepth`: what a deviation
/// of depth adds to the displacements under unit forces there, 2M x 3 [px/N].
class ScatterSum {
 public:
  void add(const Reading& reading, const Eigen::Ref<const Eigen::MatrixXd>& byDepth, double weight) {
    for (Eigen::Index i = 0; i < byDepth.rows(); i += 2) {
      const Matrix63 misread = reading.middleCols<2>(i) * byDepth.middleRows<2>(i);
      const Eigen::Map<const Vector18> each(misread.data());
      sum_ += weight * each * each.transpose();
    }
  }

  /// Returns 6 x 3 matrices, row after row, of which each marker's are random combinations.
  std::vector<double> principal() const {
    const Eigen::SelfAdjointEigenSolver<Matrix18> eigen(sum_);
    const Matrix18 scaled = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    return {scaled.data(), scaled.data() + scaled.size()};
  }

 private:
  Matrix18 sum_ = Matrix18::Zero();
};

/// Of a contact about any of the nine places; `around` and `byDepth`: of each.
std::vector<double> contactScatter(const std::vector<Reading>& around, const Eigen::MatrixXd& byDepth,
                                   const sensor::Points& places) {
  ScatterSum sum;
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    sum.add(aboutPlace(around[static_cast<std::size_t>(i)], places.col(i)), byDepth.middleCols<3>(3 * i),
            1.0 / static_cast<double>(places.cols()));
  }
  return sum.principal();
}

/// Of a force that all nine places share.
std::vector<double> wholeFaceScatter(const Reading& wholeFace, const Eigen::MatrixXd& byDepth,
                                     const sensor::Points& places) {
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(byDepth.rows(), 3);
  for (Eigen::Index i = 0; i < places.cols(); ++i) mean += byDepth.middleCols<3>(3 * i);
  ScatterSum sum;
  sum.add(aboutPlace(wholeFace, places.rowwise().mean()), mean / static_cast<double>(places.cols()), 1.0);
  return sum.principal();
}

/// Covariance of a wrench by the arrays of SystematicErrors for a contact, or for the whole face.
Matrix6 covarianceBy(std::span<const double> shared, std::span<const double> scatter, const Vector6& wrench,
                     const Eigen::Vector3d& at) {
  Matrix6 covariance = Matrix6::Zero();
  for (std::size_t k = 0; k < shared.size(); k += Matrix6::SizeAtCompileTime) {
    const Vector6 error = Matrix6::Map(shared.data() + k) * wrench;
    covariance += error * error.transpose();
  }
  for (std::size_t k = 0; k < scatter.size(); k += Matrix63::SizeAtCompileTime) {
    Vector6 error = Matrix63::Map(scatter.data() + k) * wrench.head<3>();
    error.tail<3>() += at.cross(error.head<3>());
    covariance += error * error.transpose();
  }
  return covariance;
}

}  // namespace

bool isWeighed(const sensor::Sensor& sensor) {
  const auto& made = sensor.calibration;
  return made && !made->stiffness.empty() && made->stiffness >= made->geometry;
}

namespace {

/// `around(node)`, `wholeFace`: how a contact about the node, and one on all nodes, are read.
template <typename Around>
SystematicErrors errorsOf(const sensor::Sensor& sensor, const SolveOptions& options, const Reading& wholeFace,
                          Around aroundNode) {
  constexpr int kDegree = 6;  // a derivative need not be right to more than a hundredth
  constexpr double kSmall = 0.01;
  const Loads loads(sensor);
  const auto displacement = [&](const sensor::Sensor& of) {
    if (of.body) return bodyColumns(of, loads.nodes);
    return sensor::elastic::displacementMatrix(of.gel, options.model, sensor::markerPositions(of), loads.positions,
                                               {.degree = kDegree, .breaks = {}});
  };
  const Eigen::MatrixXd unit = displacement(sensor), straight = sensor::elastic::toImage(sensor, unit);
  std::vector<Eigen::MatrixXd> strays;  // 2M x 27 [px/N], by a deviation each
  Eigen::MatrixXd byDepth;              // of a block, 2M x 27 [px/(N m)]: by each marker's own depth
  const auto add = [&](const sensor::Sensor& strayed, const Eigen::MatrixXd& moved, double deviations) {
    strays.emplace_back(deviations * (sensor::elastic::toImage(strayed, moved) - straight));
  };
  for (int number = 0; number < kCameraNumbers; ++number) {
    sensor::Sensor elsewhere = sensor;
    elsewhere.camera = strayed(sensor, number);
    add(elsewhere, unit, 1.0);
  }
  if (!sensor.body) {
    const sensor::Uncertainty& by = sensor.uncertainty;
    sensor::Sensor other = sensor;
    const double step = other.gel.poissonRatio < 0.25 ? kSmall : -kSmall;
    other.gel.poissonRatio += step;
    add(other, displacement(other), by.poissonRatio / step);

    other = sensor;
    other.gel.size.z() *= 1.0 + kSmall;
    // The camera stays where it is: its pose has an error of its own.
    add(sensor, displacement(other), by.thickness / (kSmall * sensor.gel.size.z()));

    sensor::Sensor shallower = sensor;  // not deeper: a layer may lie next to the base
    for (sensor::MarkerLayer& layer : shallower.layers) layer.depth *= 1.0 - kSmall;
    byDepth = sensor::elastic::toImage(shallower, displacement(shallower)) - straight;
    Eigen::Index first = 0;
    for (const sensor::MarkerLayer& layer : sensor.layers) {
      const Eigen::Index rows = 2 * layer.count();
      byDepth.middleRows(first, rows) /= -kSmall * layer.depth;
      strays.emplace_back(Eigen::MatrixXd::Zero(straight.rows(), straight.cols()));
      strays.back().middleRows(first, rows) = by.layerDepth * byDepth.middleRows(first, rows);
      first += rows;
    }
  }

  std::vector<Reading> around;
  for (const int node : loads.nodes) around.push_back(aroundNode(node));
  const auto misread = [&](const Eigen::MatrixXd& stray, const auto& readingOf) {
    Matrix6 error = Matrix6::Zero();
    for (std::size_t i = 0; i < loads.nodes.size(); ++i) {
      const auto column = 3 * static_cast<Eigen::Index>(i);
      error += readingOf(i) * stray.middleCols<3>(column) * loads.forces.middleRows<3>(column);
    }
    return error;
  };
  SystematicErrors errors;
  for (const Eigen::MatrixXd& stray : strays) {
    Matrix6 contact = misread(stray, [&](std::size_t i) -> const Reading& { return around[i]; });
    Matrix6 whole = misread(stray, [&](std::size_t) -> const Reading& { return wholeFace; });
    if (isWeighed(sensor)) {  // with a contact that pressed: Young's modulus has since what makes it read right
      whole -= contact(2, 2) * Matrix6::Identity();
      contact -= contact(2, 2) * Matrix6::Identity();
    }
    errors.contact.insert(errors.contact.end(), contact.data(), contact.data() + contact.size());
    errors.wholeFace.insert(errors.wholeFace.end(), whole.data(), whole.data() + whole.size());
  }
  if (!sensor.body && sensor.uncertainty.markerDepth > 0.0) {
    byDepth *= sensor.uncertainty.markerDepth;
    errors.contactScatter = contactScatter(around, byDepth, loads.positions);
    errors.wholeFaceScatter = wholeFaceScatter(wholeFace, byDepth, loads.positions);
  }
  return errors;
}

/// 2M x 4.
Eigen::MatrixXd transposed(const RowMatrix& motion) {
  Eigen::MatrixXd result(motion.columns(), kMotions);
  for (int k = 0; k < kMotions; ++k) {
    result.col(k) = Eigen::VectorXf::Map(motion.row(k), motion.columns()).cast<double>();
  }
  return result;
}

}  // namespace

SystematicErrors systematicErrors(const sensor::Sensor& sensor, const SolveOptions& options, const Factors& factors,
                                  const Atoms& atoms) {
  constexpr double kAtomForce_N = 9e-3;  // expected of each, if all are solved for
  Eigen::MatrixXd wrenches = Eigen::MatrixXd::Zero(factors.rank(), 6), modes(3, factors.rank());
  std::vector<int> pointOf(static_cast<std::size_t>(sensor.nodes.count()));
  for (int p = 0; p < atoms.pointCount(); ++p) {
    const int node = atoms.nodes[static_cast<std::size_t>(p)];
    if (node >= 0) pointOf[static_cast<std::size_t>(node)] = p;
  }
  for (int a = 0; a < atoms.count(); ++a) {
    Eigen::Matrix<double, 6, 3> unit = Eigen::Matrix<double, 6, 3>::Zero();
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
      unit += it.value() * unitWrenches(atoms.points.col(it.row()));
    }
    modesOfAtom(factors, atoms, a, modes);
    wrenches += (unit * modes).transpose();
  }
  const Eigen::MatrixXd motion = transposed(factors.motion);
  const double lambda = options.noise_px / kAtomForce_N;
  return errorsOf(
      sensor, options, byModes(factors.left, kMotions, factors.singularValues, lambda, wrenches), [&](int node) {
        return byNodesAround(
            node, sensor, factors.influence, [&](int near) { return 3 * pointOf[static_cast<std::size_t>(near)]; },
            motion, options.noise_px);
      });
}

WrenchCovariance systematicCovariance(const std::array<double, 6>& wrench, const Eigen::Vector3d& at,
                                      const sensor::Uncertainty& uncertainty, double pitch_m,
                                      const SystematicErrors& errors, double whole) {
  const Vector6 w = Vector6::Map(wrench.data());
  const double force = w.head<3>().squaredNorm(), moment = w.tail<3>().squaredNorm();
  Matrix6 covariance = (uncertainty.youngsModulus * uncertainty.youngsModulus) * w * w.transpose();
  // What else the mechanics err by has any direction, and misplaces the force by a like share of a node's pitch.
  const double model = uncertainty.model * uncertainty.model;
  covariance.diagonal().head<3>().array() += model * force;
  covariance.diagonal().tail<3>().array() += model * (moment + pitch_m * pitch_m * force);
  if (whole < 1.0) covariance += (1.0 - whole) * covarianceBy(errors.contact, errors.contactScatter, w, at);
  if (whole > 0.0) covariance += whole * covarianceBy(errors.wholeFace, errors.wholeFaceScatter, w, at);
  WrenchCovariance result;
  Eigen::Map<Matrix6>(result.data()) = covariance;
  return result;
}

}  // namespace tractiond::solve
