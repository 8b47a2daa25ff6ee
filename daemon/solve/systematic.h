// Computes the part of a force's uncertainty that is the same in every frame.
#pragma once

#include "daemon/solve/factors.h"
#include "daemon/solve/wrench.h"
#include "sensor/sensor.h"

#include <vector>

namespace tractiond::solve {

/// Changes of the displacements by unit forces at nine nodes across the face, by one standard deviation of each
/// quantity that is not known exactly.
struct Strays {
  std::vector<int> nodes;
  sensor::Points places;             ///< of the nodes [m]
  Eigen::MatrixXd forces;            ///< from wrenches to forces at the nodes, 27 x 6
  std::vector<Eigen::MatrixXd> all;  ///< 2M x 27 [px/N], in the order of SystematicErrors
  Eigen::MatrixXd scatter;           ///< by each marker's own depth; empty if those do not scatter
  Eigen::VectorXd heat;              ///< displacements by 1 K, 2M [px/K]
  double displacement = 0.0;         ///< SystematicErrors::displacement
};

/// Computes the strays of a sensor. Takes most of a second for a block. Reentrant.
Strays straysOf(const sensor::Sensor& sensor, const SolveOptions& options);

/// Computes Factors::systematicErrors of the factors of the sensor's atoms. Reentrant.
/// \param strays of the sensor
SystematicErrors systematicErrors(const sensor::Sensor& sensor, const SolveOptions& options, const Factors& factors,
                                  const Atoms& atoms, const Strays& strays);

/// Returns whether Young's modulus was measured with weights, and not before the camera's pose (by Calibration's dates;
/// the pose may never have been measured): errors of the camera and the mechanics that scale a normal force are then
/// compensated by it.
bool isWeighed(const sensor::Sensor& sensor);

/// The systematic part of the covariance of forces on the nodes. Immutable once made.
class SystematicPart {
 public:
  /// `factors` must outlive it.
  SystematicPart(const Factors& factors, const sensor::Sensor& sensor);

  /// Returns the covariance of the wrench of forces on the nodes (3N [N]) about the origin, (Fx .. Mz), 6 x 6, row
  /// after row, by the errors of Young's modulus, of the mechanics, and by SystematicErrors; 0 if all forces are 0.
  /// What is pressed in one place is misread as the nodes around it misread it, what acts on all nodes as these;
  /// between the two by the share of the face that an even pressure as concentrated would cover.
  /// \param wrench of the forces about the origin [N, N m]
  /// \param heat_K standard deviation of the gel's temperature
  WrenchCovariance covariance(const Wrench& wrench, std::span<const double> nodeForces_N, double heat_K = 0.0) const;

 private:
  const SystematicErrors& errors_;
  const sensor::Uncertainty uncertainty_;
  const sensor::Points nodes_;
  const double pitch_m_;
};

}  // namespace tractiond::solve
