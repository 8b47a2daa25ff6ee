#include "tests/simulation/account.h"

#include "traction/v1/header.pb.h"

#include <fmt/format.h>

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
