// Fields that are even or odd across two mirror planes, x = 0 and y = 0: four parity classes.
#pragma once

#include "sensor/elastic/half_space.h"

#include <Eigen/Core>

#include <vector>

namespace sensor::elastic {

// A class and a mirror image have two bits each: bit 0 for the plane x = 0, bit 1 for y = 0. A set bit means odd, or
// mirrored.
inline constexpr unsigned kClasses = 4;

/// Returns the sign of an image in a class.
double character(unsigned parity, unsigned image);

/// Returns the signs of a point's coordinates in a mirror image.
Eigen::Vector3d mirror(unsigned image);

/// Returns whether a component is zero on the plane across `axis`: of an even field the component across the plane, of
/// an odd field the two others.
bool vanishes(unsigned parity, int axis, int component);

/// Points mirrored into the quarter x, y >= 0.
struct Folded {
  Points distinct;
  std::vector<Eigen::Index> index;  ///< index of each point in `distinct`
  std::vector<unsigned> image;      ///< mirror image that maps `distinct` back to the point
};

/// Mirrors points into the quarter x, y >= 0 and merges those that coincide there.
Folded fold(const Points& points);

}  // namespace sensor::elastic
