#include "tests/simulation/line_counts.h"

#include <fmt/format.h>

#include <regex>
#include <sstream>
#include <utility>

namespace tractiond::simulation {

void LineCounts::add(const Result& result) {
  static const std::regex time("^ *[0-9]+ ms  "), number("[A-Za-z0-9.+%#!-]*[0-9][A-Za-z0-9.+%#!-]*");
  std::istringstream log(result.log), account(result.account.text());
  for (std::string line; std::getline(log, line);)
    ++counts_[std::regex_replace(std::regex_replace(line, time, ""), number, "#")];
  for (std::string line; std::getline(account, line);) {
    const std::size_t colon = line.rfind(": ");
    counts_["sum: " + line.substr(0, colon)] += std::stoull(line.substr(colon + 2));
  }
  for (const auto& [name, count] : {std::pair{"answers", result.answers},
                                    {"fields", result.account.fields()},
                                    {"messages read", result.delivered},
                                    {"restarts", result.restarts},
                                    {"undone", result.undone},
                                    {"valid fields", result.account.valid()},
                                    {"zeros asked", result.zerosAsked},
                                    {"zeros taken", result.zerosTaken}})
    counts_[std::string("sum: ") + name] += count;
}

std::string LineCounts::text() const {
  std::string text;
  for (const auto& [line, count] : counts_) text += fmt::format("{:>8}  {}\n", count, line);
  return text;
}

}  // namespace tractiond::simulation
