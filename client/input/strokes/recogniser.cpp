#include "client/input/strokes/recogniser.h"

#include <algorithm>
#include <bitset>
#include <cmath>

namespace traction::input {
namespace {

using Point = std::array<double, 2>;

/// Steps between the points from which two clouds are matched: about the root of their number.
constexpr std::size_t kStep = 6;

double squared(const Point& a, const Point& b) {
  const double x = a[0] - b[0], y = a[1] - b[1];
  return x * x + y * y;
}

double lengthOf(const Stroke& stroke) {
  double length = 0.0;
  for (std::size_t i = 1; i < stroke.size(); ++i) length += std::sqrt(squared(stroke[i - 1], stroke[i]));
  return length;
}

}  // namespace

Recogniser::Cloud Recogniser::cloudOf(const Stroke& stroke) {
  Cloud cloud;
  const double length = lengthOf(stroke);
  if (!(length > 0.0) || !std::isfinite(length)) return cloud;
  cloud.isPoint = false;
  // Points of equal distance along the stroke.
  double passed = 0.0;
  std::size_t next = 0;
  for (std::size_t i = 1; i < stroke.size(); ++i) {
    const double step = std::sqrt(squared(stroke[i - 1], stroke[i]));
    for (; next < kPoints; ++next) {
      const double wanted = length * static_cast<double>(next) / (kPoints - 1);
      if (wanted > passed + step) break;
      const double part = step > 0.0 ? (wanted - passed) / step : 0.0;
      for (std::size_t k : {0U, 1U}) cloud.points[next][k] = std::lerp(stroke[i - 1][k], stroke[i][k], part);
    }
    passed += step;
  }
  for (; next < kPoints; ++next) cloud.points[next] = stroke.back();
  // The mean of the points is in the middle of the cells. The larger side is half of theirs, so that all points are in
  // cells.
  Point least = cloud.points[0], most = least, mean{};
  for (const Point& point : cloud.points) {
    for (std::size_t k : {0U, 1U}) {
      least[k] = std::min(least[k], point[k]);
      most[k] = std::max(most[k], point[k]);
      mean[k] += point[k] / kPoints;
    }
  }
  const double scale = 0.5 * (kCells - 1) / std::max(most[0] - least[0], most[1] - least[1]);
  for (Point& point : cloud.points) {
    for (std::size_t k : {0U, 1U}) point[k] = 0.5 * (kCells - 1) + scale * (point[k] - mean[k]);
  }
  for (std::size_t cell = 0; cell < cloud.nearest.size(); ++cell) {
    const Point place = {static_cast<double>(cell % kCells), static_cast<double>(cell / kCells)};
    const auto nearest =
        std::ranges::min_element(cloud.points, {}, [&](const Point& each) { return squared(each, place); });
    cloud.nearest[cell] = static_cast<std::uint8_t>(nearest - cloud.points.begin());
  }
  return cloud;
}

/// Returns the sum of the squared distances of a matching that takes the points of `from` one by one, each with the
/// nearest point of `to` that is free; the first count most. From `worst` on it stops.
double Recogniser::distance(const Cloud& from, const Cloud& to, std::size_t start, double worst) {
  std::bitset<kPoints> taken;
  double sum = 0.0;
  for (std::size_t count = 0; count < kPoints; ++count) {
    const Point& point = from.points[(start + count) % kPoints];
    double least = std::numeric_limits<double>::infinity();
    std::size_t best = 0;
    for (std::size_t j = 0; j < kPoints; ++j) {
      if (taken[j]) continue;
      const double here = squared(point, to.points[j]);
      if (here < least) {
        least = here;
        best = j;
      }
    }
    taken.set(best);
    sum += static_cast<double>(kPoints - count) * least;
    if (sum >= worst) break;
  }
  return sum;
}

/// Returns what distance() is at least, from each start, but for the size of a cell: as if no point were taken.
std::array<double, 6> Recogniser::lowerBounds(const Cloud& from, const Cloud& to) {
  std::array<double, kPoints> until{};  // sum of the distances up to each point
  std::array<double, 6> bounds{};
  double sum = 0.0;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const auto cell = [&](std::size_t k) { return static_cast<std::size_t>(std::round(from.points[i][k])); };
    const double here = squared(from.points[i], to.points[to.nearest[cell(1) * kCells + cell(0)]]);
    bounds[0] += static_cast<double>(kPoints - i) * here;
    until[i] = sum += here;
  }
  for (std::size_t i = 1; i < bounds.size(); ++i) {
    const std::size_t start = i * kStep;
    bounds[i] = bounds[0] + static_cast<double>(start) * sum - static_cast<double>(kPoints) * until[start - 1];
  }
  return bounds;
}

double Recogniser::match(const Cloud& one, const Cloud& other, double worst) {
  const auto bounds = lowerBounds(one, other), opposite = lowerBounds(other, one);
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    if (bounds[i] < worst) worst = std::min(worst, distance(one, other, i * kStep, worst));
    if (opposite[i] < worst) worst = std::min(worst, distance(other, one, i * kStep, worst));
  }
  return worst;
}

void Recogniser::add(const std::string& symbol, const Stroke& stroke) {
  Cloud cloud = cloudOf(stroke);
  if (!cloud.isPoint) known_.push_back({symbol, cloud});
}

Recogniser::Best Recogniser::recognise(const Stroke& stroke) const {
  const Cloud cloud = cloudOf(stroke);
  Best best;
  if (cloud.isPoint) return best;
  double second = std::numeric_limits<double>::infinity();  // of another symbol
  for (const Known& known : known_) {
    const bool isBest = known.symbol == best.symbol;
    const double found = match(cloud, known.cloud, isBest ? best.distance : second);
    if (found < best.distance) {
      if (!isBest) second = best.distance;
      best.symbol = known.symbol;
      best.distance = found;
    } else if (!isBest) {
      second = std::min(second, found);
    }
  }
  best.margin = best.distance < second ? 1.0 - best.distance / second : 0.0;
  return best;
}

}  // namespace traction::input
