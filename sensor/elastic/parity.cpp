#include "sensor/elastic/parity.h"

#include <array>
#include <bit>
#include <cmath>
#include <map>

namespace sensor::elastic {

using Eigen::Index, Eigen::Vector3d;

double character(unsigned parity, unsigned image) {
  return std::popcount(parity & image) % 2 == 0 ? 1.0 : -1.0;
}

Vector3d mirror(unsigned image) {
  return {image & 1U ? -1.0 : 1.0, image & 2U ? -1.0 : 1.0, 1.0};
}

bool vanishes(unsigned parity, int axis, int component) {
  return (parity >> axis & 1U) == (component == axis ? 0U : 1U);
}

Folded fold(const Points& points) {
  constexpr double kSame = 1e-12;  // [m]
  std::map<std::array<long long, 3>, Index> known;
  std::vector<Vector3d> distinct;
  Folded folded;
  for (Index i = 0; i < points.cols(); ++i) {
    const Vector3d p = points.col(i);
    const unsigned image = (p.x() < 0.0 ? 1U : 0U) | (p.y() < 0.0 ? 2U : 0U);
    const Vector3d moved = mirror(image).cwiseProduct(p);
    const std::array key = {std::llround(moved.x() / kSame), std::llround(moved.y() / kSame),
                            std::llround(moved.z() / kSame)};
    const auto [entry, isNew] = known.try_emplace(key, static_cast<Index>(distinct.size()));
    if (isNew) distinct.push_back(moved);
    folded.index.push_back(entry->second);
    folded.image.push_back(image);
  }
  folded.distinct.resize(3, static_cast<Index>(distinct.size()));
  for (std::size_t i = 0; i < distinct.size(); ++i) folded.distinct.col(static_cast<Index>(i)) = distinct[i];
  return folded;
}

}  // namespace sensor::elastic
