#include "tests/simulation/account.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <bit>

namespace tractiond::simulation {
namespace {

struct Name {
  const char* name;  ///< in traction.v1.Ledger
  Counter Ledger::*counter;
};
constexpr std::array kNames = {
    Name{"received", &Ledger::received},
    Name{"published", &Ledger::published},
    Name{"incomplete", &Ledger::incomplete},
    Name{"wrong_size", &Ledger::wrongSize},
    Name{"wrong_format", &Ledger::wrongFormat},
    Name{"stale", &Ledger::stale},
    Name{"implausible", &Ledger::implausible},
    Name{"evicted_before_track", &Ledger::evictedBeforeTrack},
    Name{"no_rest_pose", &Ledger::noRestPose},
    Name{"no_gel", &Ledger::noGel},
    Name{"evicted_before_solve", &Ledger::evictedBeforeSolve},
    Name{"evicted_before_publish", &Ledger::evictedBeforePublish},
    Name{"discarded_at_stop", &Ledger::discardedAtStop},
    Name{"missing", &Ledger::missing},
    Name{"reconnects", &Ledger::reconnects},
    Name{"invalid", &Ledger::invalid},
    Name{"doubted", &Ledger::doubted},
};

/// In the order of their bits.
constexpr std::array kFlagNames = {"zero_unverified", "few_markers",  "discontinuity", "reacquiring",   "torn",
                                   "unexplained",     "out_of_range", "gel_mismatch",  "doubted_origin"};

}  // namespace

void Account::add(const Ledger& ledger) {
  static_assert(kNames.size() == kCounters && kFlagNames.size() == kFlags);
  for (std::size_t i = 0; i < kCounters; ++i) counters_[i] += (ledger.*kNames[i].counter).get();
}

void Account::add(const TractionField& field) {
  ++fields_;
  valid_ += field.valid ? 1 : 0;
  for (std::size_t i = 0; i < kFlags; ++i) flags_[i] += (field.flags >> i) & 1U;

  const auto bits = [](auto value) { return std::bit_cast<std::uint64_t>(value); };
  const FrameInfo& info = field.markers.info;
  const FrameTimes& times = info.times;
  const std::array scalars = {
      info.cameraFrameId,
      info.frameNumber,
      bits(times.device_ns),
      bits(times.received_ns),
      bits(times.receivedReal_ns),
      bits(times.captured_ns),
      bits(times.capturedError_ns),
      std::uint64_t{static_cast<std::uint8_t>(times.capturedBound)},
      bits(times.tracked_ns),
      bits(times.solved_ns),
      std::uint64_t{field.flags},
      std::uint64_t{field.valid} | std::uint64_t{field.centreOfPressureValid} << 1U |
          std::uint64_t{static_cast<std::uint8_t>(field.method)} << 8U,
      bits(std::int64_t{field.markers.validCount}),
      bits(std::int64_t{field.contactCount}),
      bits(field.residual_px),
      bits(field.strength),
  };
  hash(scalars.data(), sizeof scalars);
  const auto add = [this](const auto& values) { hash(values.data(), values.size() * sizeof values[0]); };
  add(field.force_N);
  add(field.deviation_N);
  add(field.resultant_N);
  add(field.moment_Nm);
  add(field.noise);
  add(field.systematic);
  add(field.centreOfPressure_m);
  add(field.pictureMotion);
  add(field.markers.zero);
  static_assert(sizeof(Contact) == 12 * sizeof(double));  // no bytes between members
  hash(field.contacts.data(), static_cast<std::size_t>(field.contactCount) * sizeof(Contact));
}

void Account::hash(const void* bytes, std::size_t size) {
  hash_ = XXH3_64bits_withSeed(bytes, size, hash_);
}

std::string Account::text() const {
  std::string text;
  for (std::size_t i = 0; i < kCounters; ++i) {
    if (counters_[i] > 0) text += fmt::format("{}: {}\n", kNames[i].name, counters_[i]);
  }
  for (std::size_t i = 0; i < kFlags; ++i) {
    if (flags_[i] > 0) text += fmt::format("flag {}: {}\n", kFlagNames[i], flags_[i]);
  }
  return text;
}

}  // namespace tractiond::simulation
