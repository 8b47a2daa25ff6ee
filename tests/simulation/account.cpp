#include "tests/simulation/account.h"

#include "traction/v1/header.pb.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <bit>
#include <cctype>

namespace tractiond::simulation {

void Account::add(const Ledger& ledger) {
  ledger.each([this](const char* name, std::uint64_t count) { counters_[name] += count; });
}

void Account::add(const TractionField& field) {
  ++fields_;
  valid_ += field.valid ? 1 : 0;
  linear_ += field.solution == Solution::kLinear ? 1 : 0;
  for (std::size_t i = 0; i < flags_.size(); ++i) flags_[i] += (field.flags >> i) & 1U;

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
          std::uint64_t{static_cast<std::uint8_t>(field.method)} << 8U |
          std::uint64_t{static_cast<std::uint8_t>(field.solution)} << 16U,
      field.modelFrame,
      bits(std::int64_t{field.markers.validCount}),
      bits(std::int64_t{field.contactCount}),
      bits(field.residual_px),
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
  // Numbers alone, with no bytes between them.
  hash(field.contacts.data(), static_cast<std::size_t>(field.contactCount) * sizeof(Contact));
}

void Account::hash(const void* bytes, std::size_t size) {
  hash_ = XXH3_64bits_withSeed(bytes, size, hash_);
}

std::string Account::text() const {
  std::string text;
  for (const auto& [name, count] : counters_) {
    if (count > 0) text += fmt::format("{}: {}\n", name, count);
  }
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    if (flags_[i] == 0) continue;
    std::string name = traction::v1::Flag_Name(static_cast<traction::v1::Flag>(1U << i)).substr(sizeof "FLAG");
    for (char& letter : name) letter = static_cast<char>(std::tolower(letter));
    text += fmt::format("flag {}: {}\n", name, flags_[i]);
  }
  if (linear_ > 0) text += fmt::format("solution linear: {}\n", linear_);
  return text;
}

}  // namespace tractiond::simulation
