// One physical sensor: the content of its gel file.
#pragma once

#include "sensor/gel.h"
#include "sensor/projection.h"

#include <memory>
#include <optional>
#include <string>

namespace sensor {

/// Standard deviations of the sensor's parameters: the systematic part of a force's uncertainty.
struct Uncertainty {
  double youngsModulus = 0.02;  ///< relative
  double poissonRatio = 0.005;  ///< of a block only
  double thickness = 0.2e-3;    ///< of a block only [m]
  double layerDepth = 0.1e-3;   ///< of each layer's depth, of a block only [m]
  /// of a marker's depth about its layer's, of a block only [m]; 0: layers that were not made by hand
  double markerDepth = 0.0;
  /// of a marker's place in the grid of its layer, along x and along y, of a block only [m]. Each zero shows the places
  /// themselves, so it only widens what is accepted as this gel's pattern; 0: a tenth of the pitch is.
  double markerPlace = 0.0;
  double model = 0.003;                                          ///< all other errors of the mechanics, relative
  double focal = 0.002;                                          ///< focal length, relative
  Eigen::Vector3d position = Eigen::Vector3d::Constant(0.3e-3);  ///< camera's position, gel frame [m]
  Eigen::Vector3d rotation = Eigen::Vector3d::Constant(2e-3);    ///< camera's rotation, camera frame [rad]
  /// Correlation of the errors of focal length and position.z. It is near 1 where only their quotient, the scale of the
  /// picture, was measured.
  double focalDistance = 0.0;
  // Start values of a geometry calibration. The defaults hold for a lens that was not measured.
  /// Principal point, along u and v [px]; the default is the tolerance of a sensor chip in its housing.
  double principal_px = 5.0;
  double k1 = 1.0, k2 = 10.0;  ///< of Camera::k1 and Camera::k2
};

/// A term of the gel's creep, a Prony series: under a load that stays, the compliance grows by
/// share (1 - exp(-t / time_s)).
struct CreepTerm {
  double share = 0.0;                    ///< of the compliance at once
  double time_s = 1.0;                   ///< [s]
  double deviation = 0.0;                ///< standard deviation of the share
  std::vector<double> correlation = {};  ///< of the share's error with those of the terms before this one
  bool operator==(const CreepTerm&) const = default;
};

inline constexpr int kMostCreepTerms = 8;

/// Motion of the whole picture from frame to frame, relative to the zero, by vibration and heat: standard deviations.
/// Scale and roll are about the principal point.
struct PictureMotion {
  double shift_px = 0.02;  ///< along u and v
  double scale = 1e-4;     ///< relative
  double roll = 1e-4;      ///< [rad]
};

/// How the parameters were measured. Dates are UTC, "2026-11-20T08:15:30Z"; empty: not measured.
struct Calibration {
  std::string camera;            ///< "VENDOR-SERIAL" of the camera used
  std::string date;              ///< of the file
  std::string geometry;          ///< date of the measurement of camera pose and distortion
  double residual_px = 0.0;      ///< root mean square of its residuals
  std::string noise;             ///< date of the measurement of the picture's motion
  double noise_px = 0.0;         ///< standard deviation of a marker's coordinate in one frame
  std::string stiffness;         ///< date of the measurement of Young's modulus
  std::vector<double> weights;   ///< weights that it was measured with [N]
  std::vector<double> readings;  ///< readings of these weights with the measured modulus [N]
  double linearity = 0.0;        ///< largest relative deviation of a reading from proportionality
  std::string hash;              ///< hash of the rest of the file: 32 hexadecimal digits
};

/// A body other than the block, given by its own Green's functions from an influence file. Markers are in the order of
/// the sensor's layers, nodes in that of its grid. Neighbours in a grid are neighbours in the body.
struct Body {
  std::string file;            ///< path of the influence file
  double youngsModulus = 0.0;  ///< modulus for which `influence` holds [Pa]
  Eigen::MatrixXd influence;   ///< 3 M x 3 N [m/N]: displacement of each marker per unit force at each node
  Points nodes;                ///< 3 x N, on the touched surface [m]
  Points normals;              ///< 3 x N, unit vectors into the body
  Eigen::VectorXd areas;       ///< N, surface area of each node [m^2]
  Points markers;              ///< 3 x M [m]
  /// As `influence`: its change by one standard deviation of each quantity of the body that is not known exactly, such
  /// as the position of a bone. The errors are independent.
  std::vector<Eigen::MatrixXd> errors;
};

/// A sensor. The defaults are the paper's.
struct Sensor {
  Gel gel;
  std::vector<MarkerLayer> layers = paperLayers();
  NodeGrid nodes;
  Camera camera;
  Uncertainty uncertainty;
  PictureMotion pictureMotion;
  std::string measuredWith;                ///< MeasuredWith::text() of lens and pose; empty: not known
  std::vector<CreepTerm> creep;            ///< empty: it is not known, and nothing is corrected for it
  std::optional<Calibration> calibration;  ///< empty: the parameters are as designed or estimated
  std::shared_ptr<const Body> body;  ///< null: the block; else `gel` supplies only Young's modulus and the thickness
  /// 3 x M [m]: offset of each marker of the block from its place in the grid of its layer. Empty: on the grid. It is
  /// not in the gel file.
  Points scatter;

  int markerCount() const;  ///< Returns M, the number of markers of all layers.
};

/// Number of markers from which on a rest picture verifies a gel file: in fewer, another lens or pose may go unnoticed.
inline constexpr int kVerifying = 50;

/// Returns the deviations of a sensor: those of its gel file, of camera and layers twice those if it has fewer markers
/// than kVerifying.
Uncertainty deviationsOf(const Sensor& sensor);

// These return positions (gel frame [m]) of markers (3 x M) and nodes (3 x N), unit normals into the body (3 x N) and
// areas (N [m^2]) of nodes: those of the body, or else of the block's layers, with `scatter`, and grid. A block's
// normals are +z and its areas the squared pitch.
Points markerPositions(const Sensor& sensor);
Points nodePositions(const Sensor& sensor);
Points nodeNormals(const Sensor& sensor);
Eigen::VectorXd nodeAreas(const Sensor& sensor);

/// Returns the covariance of the shares of terms of creep.
Eigen::MatrixXd creepCovariance(const std::vector<CreepTerm>& terms);

}  // namespace sensor
