// What traction-touch says of the slip of contacts, frame after frame.
//
// Reads observations.f64 from JOB: frames x 14, each sequence, time [s], position 2 [m], deviation 2, force 3 [N],
// deviation 3, spread ratio, deviation. Sequences follow each other, and have nothing to do with each other. Writes
// slip.f64: frames x 9, state
// (-1: not known, or a lower bound alone), stick ratio 3, friction 3 (estimate, low, high), probability of incipient
// slip, force that would hold.
#include "tests/evaluation/eye.h"
#include "touch/contact_tracker.h"

#include <cmath>
#include <fstream>

namespace {

constexpr double kBegin_s = 10.0;  // of the clock

}  // namespace

int main(int, char** argv) {
  const std::filesystem::path job = argv[1];
  std::ofstream file(job / "slip.f64", std::ios::binary);
  touch::ContactTracker tracker;
  double last = -1.0;
  for (const auto& row : evaluation::readAll<std::array<double, 14>>(job / "observations.f64")) {
    if (row[0] != last) tracker = {};
    last = row[0];
    touch::Field field;
    field.time_ns = std::llround(1e9 * (kBegin_s + row[1]));
    field.valid = true;
    field.contacts.push_back({.position_m = {row[2], row[3]},
                              .positionDeviation_m = {row[4], row[5]},
                              .force_N = {row[6], row[7], row[8]},
                              .forceDeviation_N = {row[9], row[10], row[11]},
                              .area_m2 = 5e-5,
                              .areaDeviation_m2 = 1e-6,
                              .spreadRatio = row[12],
                              .spreadRatioDeviation = row[13]});
    const touch::Slip slip = tracker.update(field).back().slip.value_or(touch::Slip{});
    const auto& [state, model, stick, friction, margin_N, holding_N, incipient] = slip;
    const std::array out{model == touch::SlipModel::kBound ? -1.0 : static_cast<double>(state),
                         stick.estimate,
                         stick.low,
                         stick.high,
                         friction.estimate,
                         friction.low,
                         friction.high,
                         incipient,
                         holding_N};
    file.write(reinterpret_cast<const char*>(out.data()), sizeof out);
  }
  return file.good() ? 0 : 1;
}
