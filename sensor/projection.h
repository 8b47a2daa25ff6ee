// Projects gel coordinates to pixels: refraction at flat windows or at ellipsoids, a pose, a pinhole with radial
// distortion or a fisheye lens, focal lengths in u and v.
//
// Pixels: (0, 0) is the centre of the top left pixel, u points right, v down. Camera frame: X along u, Y along v, Z
// along the optical axis. In the nominal pose the camera looks along -z of the gel frame.
#pragma once

#include "sensor/sight_line.h"

#include <optional>

namespace sensor {

/// Parameters of the projection. The defaults are the paper's: 100 x 75 mm on 640 x 480 pixels from 150 mm in front of
/// the markers' mean depth, without distortion and without refraction (all indices 1).
struct Camera {
  int width = 640;          ///< [px]
  int height = 480;         ///< [px]
  double focal_px = 960.0;  ///< along u: 150 mm / 0.15625 mm per px
  double aspect = 1.0;      ///< focal length along v / focal length along u (OpenCV: fy / fx); 1 for square pixels
  Eigen::Vector2d principal_px = {319.5, 239.5};  ///< principal point (u, v)
  double k1 = 0.0;  ///< radial distortion r_d = r (1 + k1 r^2 + k2 r^4), r = distance from the axis / Z
  double k2 = 0.0;  ///< see k1
  Eigen::Vector3d position = {0.0, 0.0, 157e-3};  ///< projection centre, gel frame [m]
  Eigen::Vector3d rotation =
      Eigen::Vector3d::Zero();   ///< rotation vector, camera frame [rad]:
                                 ///< point_camera = exp(rotation) diag(1, -1, -1) (point - position)
  double gelIndex = 1.0;         ///< refractive index of the gel (silicone: 1.41)
  double windowIndex = 1.0;      ///< refractive index of the acrylic window (1.49)
  double windowThickness = 0.0;  ///< [m]; the window starts at z = gel thickness
  /// Where light is refracted on its way from the gel to the camera, in this order. Empty: at the flat window, which is
  /// otherwise not there.
  std::vector<RefractingSurface> surfaces;
  /// Whether the lens is a fisheye (Kannala and Brandt 2006; OpenCV's fisheye model): theta being the angle from the
  /// axis, r_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
  bool fisheye = false;
  double k3 = 0.0;  ///< of a fisheye alone
  double k4 = 0.0;  ///< see k3
};

/// Returns the angle from the axis [rad] at which the picture of a fisheye folds: r_d stops to rise there. Empty: it
/// rises up to the picture's farthest corner or 90 degrees, or the lens is a pinhole.
std::optional<double> foldOf(const Camera& camera);

/// Returns the rotation from the gel frame to the camera frame, and sets Camera::rotation by it.
Eigen::Matrix3d toCamera(const Camera& camera);
void setToCamera(Camera& camera, const Eigen::Matrix3d& rotation);

/// Returns whether the camera is behind everything that refracts, where a camera can be.
/// \param gelThickness [m]
bool isBehindWindow(const Camera& camera, double gelThickness);

/// Projects points through gel and windows; the camera is in air. Immutable and reentrant.
class Projection {
 public:
  /// Copies the camera's parameters; they are not checked.
  /// \param gelThickness z at which the gel ends [m]
  Projection(const Camera& camera, double gelThickness);

  /// Projects a point of the gel frame [m] to pixels (u, v), which may lie outside the picture. The point must lie in
  /// the gel and in front of the camera (not checked). NaN if curved surfaces hide it.
  Eigen::Vector2d operator()(const Eigen::Vector3d& point) const;

  /// Returns d(pixel) / d(point) [px/m], 2 x 3, at a point of the gel frame [m], as above. Computed analytically.
  Eigen::Matrix<double, 2, 3> jacobian(const Eigen::Vector3d& point) const;

  /// Returns d(pixel) / d(motion), 2 x 4, of a pixel [px] for small motions of the picture (du, dv, scale, roll) [px,
  /// px, 1, rad]. Scale and roll (from u to v) are about the principal point. A roll turns the camera, so it acts
  /// before the focal lengths of u and v differ.
  Eigen::Matrix<double, 2, 4> motionOf(const Eigen::Vector2d& pixel) const;

  const Camera& camera() const { return camera_; }  ///< Returns the parameters given to the constructor.

 private:
  SightLine sightLineTo(const Eigen::Vector3d& point) const;

  Camera camera_;
  double gelThickness_;
  Eigen::Vector2d focal_px_;  ///< along u and v
  Eigen::Matrix3d toCamera_;
};

}  // namespace sensor
