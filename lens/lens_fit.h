// Estimates focal length, principal point and distortion from a chessboard in several poses.
#pragma once

#include "lens/chessboard.h"
#include "sensor/projection.h"

#include <optional>
#include <vector>

namespace lens {

struct LensFitOptions {
  double largestFocalDeviation = 0.01;  ///< relative; above it the views do not determine the focal length
  double aspect = 1.0;                  ///< expected aspect; it is held unless the views contradict it
  double otherAspect = 5.0;             ///< number of standard deviations from the expected aspect, and ...
  double leastOtherAspect = 2e-3;       ///< ... relative difference, beyond both of which the aspect is estimated
  /// The board's squares were measured along both sides. If not, oblong squares are tried as the cause first, with the
  /// same two limits.
  bool boardIsMeasured = false;
  bool fisheye = false;    ///< the lens is a fisheye, not a pinhole with radial distortion
  double better = 2.5;     ///< deviations by which one of the two causes must explain the views better, or ...
  double farBetter = 2.0;  ///< ... factor of the sum of squares; else it is not known which one it is
  /// A view is odd if its residual exceeds that of the other views, fitted without it, by this factor, ...
  double odd = 3.0;
  /// ... and this limit [px]. Smaller residuals come from noise, light or blur, which may differ several times between
  /// views, and do not harm the lens.
  double leastOdd_px = 0.2;
};

/// What the views say of the board's squares and the camera's pixels.
enum class Scale {
  kAsExpected,  ///< square squares and the expected aspect explain them
  kPixels,      ///< another aspect explains them
  kBoard,       ///< oblong squares explain them
  kEither       ///< one of the two, but which is not known; the lens is that of the expected aspect
};

struct LensFit {
  enum class Outcome { kDone, kDegenerate, kDiverged };

  Outcome outcome = Outcome::kDiverged;
  sensor::Camera
      camera;  ///< size, focal length, aspect, principal point, k1, k2, of a fisheye k3, k4; its pose is not set
  // Standard deviations of the above.
  double focalDeviation_px = 0.0;
  Eigen::Vector2d principalDeviation_px = Eigen::Vector2d::Zero();
  double k1Deviation = 0.0, k2Deviation = 0.0, k3Deviation = 0.0, k4Deviation = 0.0;
  std::optional<double> aspectDeviation;  ///< empty: the aspect was held
  Scale scale = Scale::kAsExpected;
  double otherAspect = 1.0;    ///< kPixels, kEither: the aspect that explains the views
  double tall = 1.0;           ///< kBoard, kEither: side of a square along y relative to x that explains the views
  double tallDeviation = 0.0;  ///< its standard deviation
  double residual_px = 0.0;    ///< root mean square over all coordinates
  std::vector<double> viewResidual_px;  ///< per view
  std::vector<double> tilt;             ///< per view: angle between the board and the picture's plane [rad]
  std::optional<int> oddView;           ///< view that does not fit the others; all other results are then unreliable
  /// Per view: its picture is flipped against those of more views; all other results are then unreliable. Empty: none.
  std::vector<bool> isFlipped;
  Eigen::Vector2d flip = Eigen::Vector2d::Ones();  ///< -1 along the coordinates of the picture that are flipped
};

/// Minimises the sum over views and corners of |seen - project(camera, pose, corner)|^2 over camera and poses, by
/// OpenCV's Levenberg-Marquardt. The lens has one focal length, k1 and k2 (a fisheye k1 to k4), no tangential
/// distortion, and a free aspect only if the views contradict the expected one.
///
/// A board that was printed wider than high looks much like pixels that are not square. So if the views contradict the
/// expected aspect, both are estimated, and the one that explains the views better, by the differences of the views'
/// squares (Vuong 1989), is used. Boards that all stand alike in the picture do not tell them apart, those turned by 90
/// degrees do. A board with as many columns as rows may lie either way, and is taken for one of squares.
///
/// A picture that is turned by 180 degrees or mirrored has its principal point on the other side. Each view is tried
/// so: if they explain the others much better, the views are of one camera, but of pictures that were stored in two
/// ways. Accepted risk: a principal point that is closer to the picture's middle than four deviations of a single view
/// is not told from its mirror image, and errs by no more than that.
///
/// Each standard deviation is the larger of two estimates: one from the residuals, with separate noise for each view,
/// which holds if the errors of corners are independent; the other from the change of the lens without one view
/// (jackknife), because in real pictures errors are correlated within a view. Outcome: kDegenerate if the views do not
/// determine the focal length or fewer than two are tilted by 10 degrees; the other results are set all the same.
/// kDiverged if no fit was found; all others are then those of LensFit{}. An odd view is sought among four or more.
/// Reentrant.
/// \param views of this board, all in pictures of width_px x height_px
LensFit fitLens(const std::vector<Corners>& views, const Board& asGiven, int width_px, int height_px,
                const LensFitOptions& options = {});

}  // namespace lens
