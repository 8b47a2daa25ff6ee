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
  /// A view is odd if its residual exceeds that of the other views, fitted without it, by this factor, ...
  double odd = 3.0;
  /// ... and this limit [px]. Smaller residuals are noise, which may be several times larger in one view.
  double leastOdd_px = 0.06;
};

struct LensFit {
  enum class Outcome { kDone, kDegenerate, kDiverged };

  Outcome outcome = Outcome::kDiverged;
  sensor::Camera camera;  ///< size, focal length, aspect, principal point, k1, k2; its pose is not set
  // Standard deviations of the above.
  double focalDeviation_px = 0.0;
  Eigen::Vector2d principalDeviation_px = Eigen::Vector2d::Zero();
  double k1Deviation = 0.0, k2Deviation = 0.0;
  std::optional<double> aspectDeviation;  ///< empty: the aspect was held
  double residual_px = 0.0;               ///< root mean square over all coordinates
  std::vector<double> viewResidual_px;    ///< per view
  std::vector<double> tilt;               ///< per view: angle between the board and the picture's plane [rad]
  std::optional<int> oddView;             ///< view that does not fit the others; all other results are then unreliable
};

/// Minimises the sum over views and corners of |seen - project(camera, pose, corner)|^2 over camera and poses, by
/// OpenCV's Levenberg-Marquardt. The lens has one focal length, k1 and k2, no tangential distortion, and a free aspect
/// only if the views contradict the expected one.
///
/// Each standard deviation is the larger of two estimates: one from the residuals, with separate noise for each view,
/// which holds if the errors of corners are independent; the other from the change of the lens without one view
/// (jackknife), because in real pictures errors are correlated within a view.
/// Outcome: kDegenerate if the views do not determine the focal length or fewer than two are tilted by 10 degrees; the
/// other results are set all the same. kDiverged if no fit was found; all others are then those of LensFit{}. An odd
/// view is sought among four or more. Reentrant. \param views of this board, all in pictures of width_px x height_px
LensFit fitLens(const std::vector<Corners>& views, const Board& board, int width_px, int height_px,
                const LensFitOptions& options = {});

}  // namespace lens
