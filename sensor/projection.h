// From gel coordinates to pixels: flat refracting windows, a pose, a pinhole, radial distortion, the scales of u and v.
//
// Pixel coordinates: (0, 0) is the centre of the top left pixel, u to the right, v down. Camera frame: X along u, Y
// along v, Z along the optical axis. In the nominal pose the camera looks straight along -z of the gel frame.
#pragma once

#include "sensor/gel.h"

namespace sensor {

/// What is needed to project; the defaults are the paper's 100 x 75 mm on 640 x 480 from 150 mm in front of the
/// markers' mean depth, without distortion and without refraction (all indices 1).
struct Camera {
  int width = 640;          ///< [px]
  int height = 480;         ///< [px]
  double focal_px = 960.0;  ///< in u: 150 mm / 0.15625 mm per px
  double aspect = 1.0;      ///< focal length in v over that in u (OpenCV: fy / fx); 1 for square pixels
  Eigen::Vector2d principal_px = {319.5, 239.5};
  double k1 = 0.0;  ///< radial: r_d = r (1 + k1 r^2 + k2 r^4), r = distance / Z
  double k2 = 0.0;
  Eigen::Vector3d position = {0.0, 0.0, 157e-3};  ///< of the projection centre, gel frame [m]
  Eigen::Vector3d rotation =
      Eigen::Vector3d::Zero();   ///< rotation vector, camera frame [rad]:
                                 ///< point_camera = exp(rotation) diag(1, -1, -1) (point - position)
  double gelIndex = 1.0;         ///< refractive index of the gel (silicone: 1.41)
  double windowIndex = 1.0;      ///< of the acrylic window (1.49)
  double windowThickness = 0.0;  ///< [m]; it starts where the gel ends, at z = gel thickness
};

/// Gel, window and air meet in planes of constant z; the camera is in air. Reentrant; immutable after construction.
class Projection {
 public:
  Projection(const Camera& camera, double gelThickness);

  /// Gel point [m] -> pixel. The point lies in the gel and in front of the camera.
  Eigen::Vector2d operator()(const Eigen::Vector3d& point) const;

  /// d(pixel) / d(point) [px/m], 2 x 3; analytic.
  Eigen::Matrix<double, 2, 3> jacobian(const Eigen::Vector3d& point) const;

  /// Moves the pixel [px] of a point by small motions of the picture [px, px, 1, rad]: du, dv, scale, roll from u to v,
  /// the last two about the principal point. Returns d(pixel) / d(motion), 2 x 4. A roll is one of the camera, so it
  /// turns what the lens draws, before the scales of u and v differ.
  Eigen::Matrix<double, 2, 4> motionOf(const Eigen::Vector2d& pixel) const;

  const Camera& camera() const { return camera_; }

 private:
  struct Ray;
  Ray rayTo(const Eigen::Vector3d& point) const;

  Camera camera_;
  double gelThickness_;
  Eigen::Vector2d focal_px_;  ///< in u and in v
  Eigen::Matrix3d toCamera_;
};

}  // namespace sensor
