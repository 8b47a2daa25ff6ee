#include "client/input/strokes/recogniser.h"

#include <algorithm>
#include <bitset>
#include <cmath>

namespace traction::input {
namespace {

using Point = std::array<double, 2>;

/// Steps between the points from which two clouds are matched: about the root of their number.
constexpr std::size_t kStep = 6;

/// Larger side of a cloud, which is the unit of distances.
constexpr double kSide = 31.5;

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
  Point least = cloud.points[0], most = least, mean{};
  for (const Point& point : cloud.points) {
    for (std::size_t k : {0U, 1U}) {
      least[k] = std::min(least[k], point[k]);
      most[k] = std::max(most[k], point[k]);
      mean[k] += point[k] / kPoints;
    }
  }
  const double scale = kSide / std::max(most[0] - least[0], most[1] - least[1]);
  for (Point& point : cloud.points) {
    for (std::size_t k : {0U, 1U}) point[k] = scale * (point[k] - mean[k]);
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

double Recogniser::match(const Cloud& one, const Cloud& other, double worst) {
  for (std::size_t start = 0; start < kPoints; start += kStep) {
    worst = std::min(worst, distance(one, other, start, worst));
    worst = std::min(worst, distance(other, one, start, worst));
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
