// Focal length, principal point and distortion from a chessboard in several poses.
#pragma once

#include "lens/chessboard.h"
#include "sensor/projection.h"

#include <optional>
#include <vector>

namespace lens {

struct LensFitOptions {
  double largestFocalDeviation = 0.01;  ///< relative: above, the views do not tell
  double aspect = 1.0;                  ///< as it is believed; it is held where the views do not contradict
  double otherAspect = 5.0;             ///< deviations off, and ...
  double leastOtherAspect = 2e-3;       ///< ... so much: then the aspect is estimated
  /// Times the residual that the other views have without it: a view that is not of their lens.
  double odd = 3.0;
  /// Of a coordinate: less is noise, which one view may have several times more of than the others.
  double leastOdd_px = 0.06;
};

struct LensFit {
  enum class Outcome { kDone, kDegenerate, kDiverged };

  Outcome outcome = Outcome::kDiverged;
  sensor::Camera camera;  ///< size, focal length, aspect, principal point, k1, k2; its pose means nothing
  double focalDeviation_px = 0.0;
  Eigen::Vector2d principalDeviation_px = Eigen::Vector2d::Zero();
  double k1Deviation = 0.0, k2Deviation = 0.0;
  std::optional<double> aspectDeviation;  ///< nothing: it was held
  double residual_px = 0.0;               ///< root mean square over all coordinates
  std::vector<double> viewResidual_px;    ///< of each view
  std::vector<double> tilt;               ///< of each view: angle of the board against the picture's plane [rad]
  std::optional<int> oddView;             ///< does not fit the others; then the rest means little
};

/// Least squares over camera and poses, sum over views and corners of |seen - project(camera, pose, corner)|^2, by
/// OpenCV's Levenberg and Marquardt with our lens: one focal length, k1, k2, no tangential part, and the aspect where
/// the views contradict the one that is believed. The deviations are our own: for each figure the larger of two
/// estimates, one by what is left of the corners, each view with noise of its own, the other by how much the lens
/// changes without one view (jackknife). The first holds where the errors of corners are independent; in real pictures
/// they are correlated within a view. Reentrant.
LensFit fitLens(const std::vector<Corners>& views, const Board& board, int width_px, int height_px,
                const LensFitOptions& options = {});

}  // namespace lens
