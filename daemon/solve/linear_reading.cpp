#include "daemon/solve/linear_reading.h"

#include "daemon/solve/around_patches.h"
#include "daemon/solve/mechanics_noise.h"
#include "daemon/solve/wrench.h"

#include <Eigen/Dense>

namespace tractiond::solve {
namespace {

/// Reads a contact by the nodes around it and the picture's motion.
/// \param pointOf of each node, its point
/// \param motion P Q^1/2
Reading byNodesAround(int node, const sensor::Sensor& sensor, const RowMatrix& influence,
                      const std::vector<int>& pointOf, const Eigen::MatrixXd& motion, double noise_px) {
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
  // The unknowns are in units of the expected forces.
  const Eigen::Index forces = 3 * static_cast<Eigen::Index>(near.size());
  Eigen::MatrixXd seen(coordinates, forces + kMotions), wrenches = Eigen::MatrixXd::Zero(6, forces + kMotions);
  for (Eigen::Index i = 0; i < forces; ++i) {
    seen.col(i) = kNodeForce_N * influence.view().row(3 * pointOf[near[i / 3]] + i % 3).transpose().cast<double>();
  }
  for (Eigen::Index i = 0; 3 * i < forces; ++i) {
    wrenches.middleCols<3>(3 * i) = kNodeForce_N * unitWrenches(nodes.col(near[i]));
  }
  seen.rightCols<kMotions>() = motion;
  Eigen::MatrixXd normal = seen.transpose() * seen;
  normal.diagonal().array() += noise_px * noise_px;
  return wrenches * normal.llt().solve(seen.transpose());
}

/// Reads a round contact.
struct PatchReader {
  static constexpr int kOwn = kPatchLoads + kPatchPlaces;
  static constexpr double kRoughness = AroundPatches::kRoughness.front();  // of a contact that is one round patch
  static constexpr double kSmall = 0.02;                                   // difference for derivatives [deviations]

  const Factors& factors;
  const Atoms& atoms;
  const double noise_px, mechanicsError;
  const Eigen::MatrixXd& motion;  ///< P Q^1/2
  PatchInfluence influence;
  Selection selection{factors};
  Roughness roughness{factors, atoms};
  PatchSpread spread{atoms};
  std::vector<double> columns = std::vector<double>(kPatchLoads * influence.stride());
  std::span<const double> gamma{};

  Readings readings(const Eigen::Vector3d& at) { return {read(at, 0), read(at, 1), read(at, 2)}; }

  Reading read(const Eigen::Vector3d& at, int axis) {
    const std::vector<int> rough = roughen(at, axis);
    const Eigen::Index size = kOwn + kMotions + 3 * static_cast<Eigen::Index>(rough.size());
    Eigen::MatrixXd seen(motion.rows(), size), wrenches = Eigen::MatrixXd::Zero(6, size);
    const double noise = setPatch(at, axis, seen, wrenches);
    seen.middleCols<kMotions>(kOwn) = motion;
    Block along = Block::Zero();
    along(axis, axis) = 1.0;
    const Block root = Eigen::LLT<Block>(directions(along)).matrixL();
    for (std::size_t i = 0; i < rough.size(); ++i) {
      const auto column = kOwn + kMotions + 3 * static_cast<Eigen::Index>(i);
      const double deviation = kRoughness * std::sqrt(gamma[rough[i]]);
      const Eigen::Matrix<double, Eigen::Dynamic, 3> unit =
          factors.influence.view().middleRows<3>(3 * rough[i]).transpose().cast<double>();
      seen.middleCols<3>(column) = deviation * unit * root;
      wrenches.middleCols<3>(column) = deviation * atoms.wrench.middleCols<3>(3 * Eigen::Index{rough[i]}) * root;
    }
    Eigen::MatrixXd normal = seen.transpose() * seen;
    normal.diagonal().array() += square(noise);
    return wrenches * normal.llt().solve(seen.transpose());
  }

  /// Sets the columns of loads, place and spread of a point-like patch under a force of Factors::force_N. Returns the
  /// noise with the mechanics' under that force.
  double setPatch(const Eigen::Vector3d& at, int axis, Eigen::MatrixXd& seen, Eigen::MatrixXd& wrenches) {
    const double force = factors.force_N, pitch = atoms.pitch_m, loose = RoundPatches::kFreeLoad * force;
    const PatchPlace place{at.x(), at.y(), 0.0};
    PatchLoad load = PatchLoad::Zero();
    load[axis] = force;
    influence.columns(place, columns.data());
    const auto column = [&](int i) {
      return Eigen::VectorXd::Map(columns.data() + i * influence.stride(), seen.rows());
    };
    for (int i = 0; i < kPatchLoads; ++i) seen.col(i) = (i < 3 ? loose : pitch * loose) * column(i);
    wrenches.leftCols<3>() = loose * unitWrenches(at);
    wrenches(5, 3) = pitch * loose;
    influence.displacement(place, load, columns.data());
    const Eigen::VectorXd here = column(0);
    for (int i = 0; i < kPatchPlaces; ++i) {
      const double unit = i < 2 ? RoundPatches::kFreePlace * pitch : RoundPatches::kSpreadDeviation * square(pitch);
      PatchPlace moved = place;
      element(moved, i) += kSmall * unit;
      influence.displacement(moved, load, columns.data());
      seen.col(kPatchLoads + i) = (column(0) - here) / kSmall;
      if (i < 2) {
        wrenches.col(kPatchLoads + i).tail<3>() =
            unit * Eigen::Vector3d::Unit(i).cross(Eigen::Vector3d(load.head<3>()));
      }
    }
    return noiseWithMechanics_px(std::span(here.data(), here.size()), noise_px, mechanicsError);
  }

  /// Sets gamma to q_a^2 / 3 of the patch, and returns the atoms that its roughness makes visible.
  std::vector<int> roughen(const Eigen::Vector3d& at, int axis) {
    const auto share = spread.divide({at.x(), at.y(), 0.0}, false);
    std::vector<double> forces(3 * share.size());
    for (std::size_t p = 0; p < share.size(); ++p) forces[3 * p + axis] = factors.force_N * share[p];
    gamma = roughness.ofPatches(forces);
    std::vector<double> visible(gamma.begin(), gamma.end());
    for (double& each : visible) each *= square(kRoughness);
    Chosen chosen;
    constexpr int kMost = ModelConstants::kMost[0].back();
    chosen.reserve(kMost);
    selection.choose(visible, kMost, false, noise_px, chosen);
    return chosen.atoms;
  }
};

}  // namespace

Reading wholeFaceReading(const Factors& factors, const Atoms& atoms, double noise_px) {
  constexpr double kAtomForce_N = 9e-3;
  const double lambda = noise_px / kAtomForce_N;
  Eigen::MatrixXd wrenches = Eigen::MatrixXd::Zero(factors.rank(), 6), modes(3, factors.rank());
  for (int a = 0; a < atoms.count(); ++a) {
    modesOfAtom(factors, atoms, a, modes);
    wrenches += (atoms.wrench.middleCols<3>(3 * a) * modes).transpose();
  }
  for (Eigen::Index k = 0; k < wrenches.rows(); ++k) {
    const double s = factors.singularValues[k];
    wrenches.row(k) *= s / (square(s) + square(lambda));
  }
  Reading reading(6, factors.coordinateCount());
  for (int i = 0; i < factors.coordinateCount(); ++i) {
    const auto left = Eigen::VectorXf::Map(factors.left.row(i) + kMotions, factors.rank());
    reading.col(i) = wrenches.transpose() * left.cast<double>();
  }
  return reading;
}

std::vector<Readings> contactReadings(const sensor::Sensor& sensor, const Factors& factors, const Atoms& atoms,
                                      double noise_px, double mechanicsError, const std::vector<int>& nodes) {
  const Eigen::MatrixXd motion = factors.motion.view().transpose().cast<double>();  // P Q^1/2
  std::vector<Readings> readings;
  if (PatchInfluence::possible(atoms)) {
    const sensor::Points positions = sensor::nodePositions(sensor);
    PatchReader reader{factors, atoms, noise_px, mechanicsError, motion, PatchInfluence(sensor, atoms, factors)};
    for (const int node : nodes) readings.push_back(reader.readings(positions.col(node)));
    return readings;
  }
  std::vector<int> pointOf(sensor.nodes.count());
  for (int p = 0; p < atoms.pointCount(); ++p) {
    const int node = atoms.nodes[p];
    if (node >= 0) pointOf[node] = p;
  }
  for (const int node : nodes) {
    const Reading reading = byNodesAround(node, sensor, factors.influence, pointOf, motion, noise_px);
    readings.push_back({reading, reading, reading});
  }
  return readings;
}

}  // namespace tractiond::solve
