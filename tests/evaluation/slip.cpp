// What traction-touch says of the slip of contacts, frame after frame.
//
// Reads observations.f64 from JOB: rows of 24 numbers, one a contact: sequence, time [s], position 2 [m], deviation 2,
// force 3 [N], deviation 3, area [m^2], deviation, spread ratio, deviation, torque [N m], variance, half axes 2 [m],
// deviation 2, orientation [rad], deviation. Contacts of one time are a field; one without normal force says that there
// is none. Sequences follow each other, and have nothing to do with each other. Writes slip.f64: fields x 9, of the
// contact that is pressed most: state (-1: not known, or a lower bound alone), stick ratio 3, friction 3 (estimate,
// low, high), probability of incipient slip, force that would hold.
#include "tests/evaluation/eye.h"
#include "touch/contact_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <vector>

namespace {

constexpr double kBegin_s = 10.0;  // of the clock

using Row = std::array<double, 24>;

touch::Observation read(const Row& row) {
  touch::Observation seen{.position_m = {row[2], row[3]},
                          .positionDeviation_m = {row[4], row[5]},
                          .force_N = {row[6], row[7], row[8]},
                          .forceDeviation_N = {row[9], row[10], row[11]},
                          .area_m2 = row[12],
                          .areaDeviation_m2 = row[13],
                          .moment_Nm = {0.0, 0.0, row[16]},
                          .halfAxes_m = {row[18], row[19]},
                          .halfAxesDeviation_m = {row[20], row[21]},
                          .orientation_rad = row[22],
                          .orientationDeviation_rad = row[23],
                          .shearSpreadRatio = row[14],
                          .shearSpreadRatioDeviation = row[15]};
  seen.momentCovariance_N2m2.noise[8] = row[17];
  return seen;
}

std::array<double, 9> judge(const std::vector<touch::Contact>& contacts) {
  const auto most = std::ranges::max_element(contacts, {}, [](const touch::Contact& one) { return one.force_N[2]; });
  const touch::Slip slip = most == contacts.end() ? touch::Slip{} : most->slip.value_or(touch::Slip{});
  const bool isKnown = slip.model == touch::SlipModel::kBall || slip.model == touch::SlipModel::kSliding;
  return {isKnown ? static_cast<double>(slip.state) : -1.0,
          slip.stickRatio.estimate,
          slip.stickRatio.low,
          slip.stickRatio.high,
          slip.friction.estimate,
          slip.friction.low,
          slip.friction.high,
          slip.incipient,
          slip.holdingForce_N};
}

}  // namespace

int main(int, char** argv) {
  const std::filesystem::path job = argv[1];
  std::ofstream file(job / "slip.f64", std::ios::binary);
  touch::ContactTracker tracker;
  double sequence = -1.0;
  const std::vector<Row> rows = evaluation::readAll<Row>(job / "observations.f64");
  for (auto row = rows.begin(); row != rows.end();) {
    if ((*row)[0] != sequence) tracker = {};
    sequence = (*row)[0];
    const double time_s = (*row)[1];
    touch::Field field;
    field.time_ns = std::llround(1e9 * (kBegin_s + time_s));
    field.valid = true;
    for (; row != rows.end() && (*row)[0] == sequence && (*row)[1] == time_s; ++row) {
      if ((*row)[8] != 0.0) field.contacts.push_back(read(*row));
    }
    const auto out = judge(tracker.update(field));
    file.write(reinterpret_cast<const char*>(out.data()), sizeof out);
  }
  return file.good() ? 0 : 1;
}
