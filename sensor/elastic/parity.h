// Fields that are even or odd across two mirror planes, x = 0 and y = 0: four parity classes.
#pragma once

#include "sensor/gel.h"

#include <Eigen/Core>

#include <vector>

namespace sensor::elastic {

// A class and a mirror image have two bits each: bit 0 for the plane x = 0, bit 1 for y = 0. A set bit means odd, or
// mirrored.
inline constexpr unsigned kClasses = 4;

/// Returns the sign, 1 or -1, with which a field of the class `parity` contributes to a mirror image.
double character(unsigned parity, unsigned image);

/// Returns the signs, 1 or -1, by which a mirror image multiplies the coordinates of a point; that of z is 1.
Eigen::Vector3d mirror(unsigned image);

/// Returns whether a component is zero on the plane across `axis`: of an even field the component across the plane, of
/// an odd field the two others.
/// \param axis 0: plane x = 0; 1: plane y = 0
/// \param component 0 to 2
bool vanishes(unsigned parity, int axis, int component);

/// Points mirrored into the quarter x, y >= 0.
struct Folded {
  Points distinct;                  ///< 3 x D [m], each once, in the order of their first appearance
  std::vector<Eigen::Index> index;  ///< index of each point in `distinct`
  std::vector<unsigned> image;      ///< mirror image that maps `distinct` back to the point
};

/// Mirrors points (3 x N [m]) into the quarter x, y >= 0 and merges those that coincide there within about 1e-12 m.
Folded fold(const Points& points);

}  // namespace sensor::elastic
