#include "daemon/solve/field_rules.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

/// Beyond this, the picture shows what no forces do.
constexpr double kUnexplained_noise = 2.0;
constexpr double kUnexplained_share = 0.1;

/// Below so many of its deviations, a normal force has no centre.
constexpr double kCentre_deviations = 5.0;

}  // namespace

void clear(TractionField& field) {
  std::fill(field.force_N.begin(), field.force_N.end(), 0.0F);
  std::fill(field.deviation_N.begin(), field.deviation_N.end(), 0.0F);
  field.valid = false;
  field.method = Method::kNone;
  field.solution = Solution::kNone;
  field.modelFrame = 0;
  field.resultant_N = {};
  field.moment_Nm = {};
  field.noise = {};
  field.systematic = {};
  field.centreOfPressure_m = {};
  field.centreOfPressureValid = false;
  field.residual_px = 0.0;
  field.pictureMotion = {};
  field.contactCount = 0;
  field.work = {};
}

void centre(double least_N, TractionField& field) {
  const auto& [x, y, z] = field.resultant_N;
  field.centreOfPressureValid = z > least_N && z > kCentre_deviations * std::sqrt(field.noise[14]);
  if (field.centreOfPressureValid) field.centreOfPressure_m = {-field.moment_Nm[1] / z, field.moment_Nm[0] / z};
}

void explain(double squaredResidual_px2, const UsedMarkers& markers, TractionField& field) {
  const auto count = static_cast<double>(markers.count());
  // Rounding can leave a perfect fit just below zero.
  const double square_px2 = std::max(squaredResidual_px2, 0.0) / count;
  field.residual_px = std::sqrt(square_px2);
  if (square_px2 >
      square(kUnexplained_noise * markers.noise_px()) + square(kUnexplained_share) * markers.squares_px2() / count) {
    field.flags |= kUnexplained;
  }
}

bool finite(const TractionField& field) {
  const auto isFinite = [](const auto& numbers) {
    return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
  };
  const auto isFiniteContact = [&](const Contact& contact) {
    return isFinite(contact.position_m) && isFinite(contact.positionDeviation_m) && isFinite(contact.moment_Nm) &&
           isFinite(contact.noise) && isFinite(contact.systematic) && std::isfinite(contact.areaDeviation_m2) &&
           isFinite(contact.halfAxes_m) && isFinite(contact.halfAxesDeviation_m) &&
           std::isfinite(contact.orientation_rad) && std::isfinite(contact.orientationDeviation_rad) &&
           std::isfinite(contact.spreadRatio) && std::isfinite(contact.spreadRatioDeviation);
  };
  return std::isfinite(field.residual_px) && isFinite(field.resultant_N) && isFinite(field.moment_Nm) &&
         isFinite(field.noise) && isFinite(field.systematic) &&
         std::all_of(field.contacts.begin(), field.contacts.begin() + field.contactCount, isFiniteContact);
}

}  // namespace tractiond::solve
