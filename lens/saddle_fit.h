// Refines a chessboard's corners to hundredths of a pixel.
#pragma once

#include "lens/corner_grid.h"

namespace lens {

/// Fits the model of two blurred edges that cross at a corner to the pixels around each corner,
///     level + step erf(d1 / (blur sqrt 2)) erf(d2 / (blur sqrt 2)),  d_k = n_k (pixel - corner) - c_k s_k^2 / 2,
/// by Gauss-Newton over corner, directions of the edges, level, step and blur. The edges' curvatures c_k are those of
/// the lens and are taken from the rows of corners: with perspective alone, second differences lie along a row. The
/// model is inexact near the middle of edges that are not perpendicular, but equally on both sides of the corner, so
/// the corner is not affected. A corner is left unchanged if its fit fails, moves it by more than 1.5 px, or needs
/// pixels outside the picture. Reentrant.
/// \param grey one channel of 8 bits
/// \param radius_px radius of the pixels used; less than half a square
/// \param blur_px start value of the blur, the standard deviation of the edges
/// \param grid corners to refine, in place [px]; at least 3 x 3
void fitSaddles(const cv::Mat& grey, double radius_px, double blur_px, CornerGrid& grid);

}  // namespace lens
