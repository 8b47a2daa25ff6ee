// Focal length, principal point and distortion from a chessboard in several poses.
#pragma once

#include "lens/chessboard.h"
#include "sensor/projection.h"

#include <optional>
#include <vector>

namespace lens {

struct LensFitOptions {
  double largestFocalDeviation = 0.01;  ///< relative: above, the views do not tell
  /// Times the residual that the other views have without it: a view that is not of their lens.
  double odd = 3.0;
  /// Of a coordinate: less is noise, which one view may have several times more of than the others.
  double leastOdd_px = 0.06;
};

struct LensFit {
  enum class Outcome { kDone, kDegenerate, kDiverged };

  Outcome outcome = Outcome::kDiverged;
  sensor::Camera camera;  ///< size, focal length, principal point, k1, k2; its pose means nothing
  double focalDeviation_px = 0.0;
  Eigen::Vector2d principalDeviation_px = Eigen::Vector2d::Zero();
  double k1Deviation = 0.0, k2Deviation = 0.0;
  double residual_px = 0.0;             ///< root mean square over all coordinates
  std::vector<double> viewResidual_px;  ///< of each view
  std::vector<double> tilt;             ///< of each view: angle of the board against the picture's plane [rad]
  std::optional<int> oddView;           ///< does not fit the others; then the rest means little
};

/// Least squares over camera and poses, sum over views and corners of |seen - project(camera, pose, corner)|^2, by
/// OpenCV's Levenberg and Marquardt with our lens: one focal length, k1, k2, no tangential part. The covariance is our
/// own, with the noise of each view by its own residual: OpenCV 4.6 has one noise for all, and counts a corner as one
/// measurement, not two, and so states deviations that are 1.4 times too large. Reentrant.
LensFit fitLens(const std::vector<Corners>& views, const Board& board, int width_px, int height_px,
                const LensFitOptions& options = {});

}  // namespace lens
