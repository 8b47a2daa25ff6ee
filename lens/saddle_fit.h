// A chessboard's corners to hundredths of a pixel.
#pragma once

#include "lens/corner_grid.h"

namespace lens {

/// Fits to the pixels around each corner what two blurred edges that cross there look like,
///     level + step erf(d1 / (blur sqrt 2)) erf(d2 / (blur sqrt 2)),  d_k = n_k (pixel - corner) - c_k s_k^2 / 2,
/// by Gauss and Newton over corner, the edges' directions, level, step and blur. The edges' curvatures c are the
/// lens's, and read from the rows of corners: in perspective alone, second differences lie along a row. What this form
/// leaves out near the middle of edges that are not at right angles is the same on both sides of the corner, and does
/// not move it. A corner at which the fit comes to nothing stays where it is. Reentrant. \param radius_px of the pixels
/// that count: shorter than half a square \param blur_px start of the fit
void fitSaddles(const cv::Mat& grey, double radius_px, double blur_px, CornerGrid& grid);

}  // namespace lens
