// Sensors and forward data for the solver's tests.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/solve/atom_products.h"
#include "sensor/elastic/half_space.h"
#include "sensor/sensor.h"

namespace tractiond::solve {

/// Two layers of 8 x 6 markers above 7 x 6 nodes: small enough for dense algebra in a sanitizer's build.
inline sensor::Sensor smallSensor() {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) {
    layer.columns = 8;
    layer.rows = 6;
  }
  sensor.nodes.columns = 7;
  sensor.nodes.rows = 6;
  return sensor;
}

/// Returns the marker displacements [px/N] on a half-space for unit forces at any points of its surface, 2M x 3S.
inline Eigen::MatrixXd halfSpaceImage(const sensor::Sensor& sensor, const sensor::Points& sources) {
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  const sensor::Projection projection(sensor.camera, sensor.gel.size.z());
  Eigen::MatrixXd image(2 * markers.cols(), 3 * sources.cols());
  for (Eigen::Index m = 0; m < markers.cols(); ++m) {
    const Eigen::Matrix<double, 2, 3> jacobian = projection.jacobian(markers.col(m));
    for (Eigen::Index s = 0; s < sources.cols(); ++s) {
      const Eigen::Vector3d offset = markers.col(m) - sources.col(s);
      image.block<2, 3>(2 * m, 3 * s) =
          jacobian * sensor::elastic::halfSpaceDisplacement(offset, sensor.gel.youngsModulus, sensor.gel.poissonRatio);
    }
  }
  return image;
}

/// A picture as the parts of the solver take it: rounded to floats, 0 where missing.
class Picture {
 public:
  Picture(const Factors& factors, const Eigen::VectorXd& displacement_px, std::vector<int> missing, double noise_px)
      : missing_(std::move(missing))
      , exact_(factors.influence.stride())
      , rounded_px_(displacement_px.size()) {
    Eigen::VectorXf::Map(rounded_px_.data(), displacement_px.size()) = displacement_px.cast<float>();
    for (const int coordinate : missing_) rounded_px_[coordinate] = 0.0F;
    std::copy(rounded_px_.begin(), rounded_px_.end(), exact_.data());
    given_ = {exact_.data(), missing_, dotProduct(exact_.data(), exact_.data(), factors.coordinateCount()), noise_px,
              rounded_px_};
  }
  Picture(const Picture&) = delete;
  operator const Displacements&() const { return given_; }  // NOLINT(*-explicit-*): it is one

 private:
  const std::vector<int> missing_;
  LineArray<double> exact_;
  std::vector<float> rounded_px_;
  Displacements given_;
};

/// Returns the prior of a picture that does not move.
/// \param coordinates 2M
inline MotionPrior still(Eigen::Index coordinates) {
  return {Eigen::MatrixXd::Zero(coordinates, kMotions), Eigen::Vector4d::Zero()};
}

/// Returns a field with these displacements (2M [px]) in which all markers are valid.
inline MarkerField fieldOf(const Eigen::VectorXd& displacement) {
  MarkerField field;
  field.resize(static_cast<int>(displacement.size() / 2));
  Eigen::VectorXf::Map(field.displacement_px.data(), displacement.size()) = displacement.cast<float>();
  std::fill(field.valid.begin(), field.valid.end(), std::uint8_t{1});
  field.validCount = static_cast<int>(field.valid.size());
  return field;
}

/// Marks a marker as missing, as the tracker does.
inline void loseMarker(MarkerField& field, int marker) {
  field.validCount -= field.valid[marker];
  field.valid[marker] = 0;
  field.displacement_px[2 * marker] = field.displacement_px[2 * marker + 1] = 0.0F;
}

}  // namespace tractiond::solve
