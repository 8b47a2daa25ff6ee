#include "tests/simulation/simulation.h"
#include "tests/support/places.h"
#include "tests/support/recorded.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr std::int64_t kMinute_ms = 60'000;

Simulation& simulation() {
  static Simulation one;
  return one;
}

/// Sums the ledger's counters, the flags of fields, and answers.
class Sums {
 public:
  void add(const Result& result) {
    std::istringstream account(result.account.text());
    for (std::string line; std::getline(account, line);) {
      const std::size_t colon = line.rfind(": ");
      sums_[line.substr(0, colon)] += std::stoull(line.substr(colon + 2));
    }
    for (const auto& [name, count] : {std::pair{"answers", result.answers},
                                      {"fields", result.account.fields()},
                                      {"restarts", result.restarts},
                                      {"undone", result.undone},
                                      {"valid fields", result.account.valid()},
                                      {"zeros asked", result.zerosAsked},
                                      {"zeros taken", result.zerosTaken}})
      sums_[name] += count;
  }
  /// Compares them with tests/golden/simulation/NAME.txt.
  void expectAsRecorded(const std::string& name) const {
    std::string text;
    for (const auto& [what, sum] : sums_) text += fmt::format("{:>8}  {}\n", sum, what);
    test::expectAsRecorded(text, "tests/golden/simulation/" + name + ".txt");
  }

 private:
  std::map<std::string, std::uint64_t> sums_;
};

TEST(Simulation, NoLawIsBrokenInStoriesOfTenMinutes) {
  Sums sums;
  for (const std::uint64_t seed : {1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 12}) {
    const Result result = simulation().run(draw(seed, 10 * kMinute_ms));
    ASSERT_FALSE(result.broken) << "seed " << seed << " after " << result.broken->at_ms << " ms: " << result.broken->law
                                << ": " << result.broken->what << "; tools/simulate --seed " << seed;
    sums.add(result);
  }
  sums.expectAsRecorded("instrument");
}

TEST(Simulation, TheSameSeedGivesTheSameLog) {
  for (const std::uint64_t seed : {6, 7}) {
    const Story story = draw(seed, 5 * kMinute_ms);
    const Result one = simulation().run(story), other = simulation().run(story);
    EXPECT_EQ(one.log, other.log);
    EXPECT_NE(simulation().run(draw(seed + 8, 5 * kMinute_ms)).log, one.log);
  }
}

TEST(Simulation, StoriesThatOnceBrokeALawBreakNone) {
  Sums sums;
  for (const auto& entry : std::filesystem::directory_iterator(test::source("tests/simulation/stories"))) {
    std::ifstream file(entry.path());
    const auto story = fromText({std::istreambuf_iterator<char>(file), {}});
    ASSERT_TRUE(story) << entry.path() << ": " << story.error();
    const Result result = simulation().run(*story);
    EXPECT_FALSE(result.broken) << entry.path() << ": " << result.broken->law << "\n" << result.log;
    sums.add(result);
  }
  sums.expectAsRecorded("stories");
}

}  // namespace
}  // namespace tractiond::simulation
