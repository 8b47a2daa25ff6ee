// One physical sensor as mathematics: what the gel file holds.
#pragma once

#include "sensor/gel.h"
#include "sensor/projection.h"

#include <memory>
#include <optional>
#include <string>

namespace sensor {

/// How well the sensor's numbers are known: standard deviations. The systematic part of a force's uncertainty.
struct Uncertainty {
  double youngsModulus = 0.02;                                   ///< relative
  double poissonRatio = 0.005;                                   ///< of a block
  double thickness = 0.2e-3;                                     ///< of a block [m]
  double layerDepth = 0.1e-3;                                    ///< of each layer of markers in a block [m]
  double model = 0.003;                                          ///< what else the mechanics err by, relative
  double focal = 0.002;                                          ///< of the focal length, relative
  Eigen::Vector3d position = Eigen::Vector3d::Constant(0.3e-3);  ///< of the camera, gel frame [m]
  Eigen::Vector3d rotation = Eigen::Vector3d::Constant(2e-3);    ///< of the camera, its own frame [rad]
  /// Correlation of the errors of focal length and position.z: near 1 where only their quotient, the picture's scale,
  /// has been measured.
  double focalDistance = 0.0;
  // What a calibration of the geometry starts from. By default the lens has been measured by nobody.
  double principal_px = 5.0;  ///< of the principal point, in u and in v: a sensor's seat in its housing
  double k1 = 1.0, k2 = 10.0;
};

/// How far the whole picture strays from frame to frame against that of the zero, by vibration and heat: standard
/// deviations. Scale and roll are about the principal point.
struct PictureMotion {
  double shift_px = 0.02;  ///< in u and in v [px]
  double scale = 1e-4;     ///< relative
  double roll = 1e-4;      ///< [rad]
};

/// How the numbers were measured. Dates are UTC, "2026-11-20T08:15:30Z"; empty: never.
struct Calibration {
  std::string camera;            ///< "VENDOR-SERIAL" of the one it was made with
  std::string date;              ///< of the file
  std::string geometry;          ///< when the camera's pose and distortion were measured
  double residual_px = 0.0;      ///< root mean square of what they leave
  std::string noise;             ///< when the picture's motion was measured
  double noise_px = 0.0;         ///< deviation of a marker's coordinate in a frame
  std::string stiffness;         ///< when Young's modulus was measured
  std::vector<double> weights;   ///< that it was measured with [N]
  std::vector<double> readings;  ///< what they read with it [N]
  double linearity = 0.0;        ///< their largest deviation from proportion, relative
  std::string hash;              ///< of all that the file says besides: 32 hexadecimal digits
};

/// Any other body than the block: its own Green's functions, from an influence file. Markers are in the order of the
/// sensor's layers, nodes in that of its grid; neighbours in a grid are neighbours in the body.
struct Body {
  std::string file;            ///< where it comes from
  double youngsModulus = 0.0;  ///< with which `influence` was computed [Pa]
  Eigen::MatrixXd influence;   ///< 3 M x 3 N [m/N]: displacement of each marker per newton at each node
  Points nodes;                ///< 3 x N, on the touched surface [m]
  Points normals;              ///< 3 x N, of length 1, into the body
  Eigen::VectorXd areas;       ///< N, of the surface that is a node's [m^2]
  Points markers;              ///< 3 x M [m]
};

/// The paper's sensor by default.
struct Sensor {
  Gel gel;
  std::vector<MarkerLayer> layers = paperLayers();
  NodeGrid nodes;
  Camera camera;
  Uncertainty uncertainty;
  PictureMotion pictureMotion;
  std::optional<Calibration> calibration;  ///< none: the numbers are as they were designed or guessed
  std::shared_ptr<const Body> body;        ///< none: the block; else `gel` gives Young's modulus and thickness alone

  int markerCount() const;
};

/// Of the body, or of the block's layers and grid.
Points markerPositions(const Sensor& sensor);
Points nodePositions(const Sensor& sensor);
Points nodeNormals(const Sensor& sensor);
Eigen::VectorXd nodeAreas(const Sensor& sensor);

}  // namespace sensor
