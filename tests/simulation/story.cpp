#include "tests/simulation/story.h"

#include <algorithm>
#include <array>
#include <sstream>
#include <string>

namespace tractiond::simulation {
namespace {

constexpr const char* kTitle = "tractiond simulation, version 1";

struct Sort {
  Event event;
  const char* name;
  int weight;               ///< of being drawn
  std::int64_t low, high;   ///< of the amount
  std::int64_t longest_ms;  ///< 0: it is of a moment
};
constexpr std::array kSorts = {
    Sort{Event::kLoss, "loss", 4, 1, 100, 20'000},
    Sort{Event::kBroken, "broken", 3, 1, 100, 20'000},
    Sort{Event::kSilence, "silence", 3, 0, 0, 8'000},
    Sort{Event::kAgain, "again", 4, 1, 100, 20'000},
    Sort{Event::kLate, "late", 3, 1, 60, 10'000},
    Sort{Event::kIdsRestart, "ids-restart", 2, 0, 0, 0},
    Sort{Event::kIdsJump, "ids-jump", 1, 1, 30'000, 0},
    Sort{Event::kOtherPictures, "other-pictures", 1, 0, 0, 0},
    Sort{Event::kNoClock, "no-clock", 1, 0, 0, 20'000},
    Sort{Event::kClockStep, "clock-step", 2, -20'000, 20'000, 0},
    Sort{Event::kGone, "gone", 3, 0, 0, 20'000},
    Sort{Event::kSlowAnswers, "slow-answers", 3, 1, 3'000, 20'000},
    Sort{Event::kHeld, "held", 2, 0, 0, 15'000},
    Sort{Event::kHangs, "hangs", 1, 0, 0, 45'000},
    Sort{Event::kTimeSet, "time-set", 3, -100'000, 100'000, 0},
    Sort{Event::kStarved, "starved", 4, 0, 5, 3'000},
    Sort{Event::kSlowModels, "slow-models", 3, 1, 200, 20'000},
    Sort{Event::kKill, "kill", 1, 0, 0, 0},
    Sort{Event::kPowerCut, "power-cut", 3, 0, 0, 0},
    Sort{Event::kSlowDisk, "slow-disk", 5, 1, 80'000, 90'000},
    Sort{Event::kFullDisk, "full-disk", 2, 0, 0, 60'000},
    Sort{Event::kFailingDisk, "failing-disk", 2, 0, 0, 60'000},
    Sort{Event::kZero, "zero", 14, 0, 0, 0},
    Sort{Event::kZeroAnyway, "zero-anyway", 3, 0, 0, 0},
    Sort{Event::kUndo, "undo", 8, 0, 0, 0},
    Sort{Event::kReopen, "reopen", 5, 0, 6, 0},
    Sort{Event::kRestart, "restart", 1, 0, 0, 0},
    Sort{Event::kQuestion, "question", 3, 0, 0, 0},
    Sort{Event::kNoise, "noise", 3, 500, 10'000, 0},
    Sort{Event::kFinish, "finish", 3, 0, 0, 0},
    Sort{Event::kTouch, "touch", 6, 20, 4'000, 15'000},
    Sort{Event::kFewMarkers, "few-markers", 2, 0, 0, 60'000},
};
static_assert(kSorts.size() == kEvents);

const Sort& sortOf(Event event) {
  return *std::ranges::find(kSorts, event, &Sort::event);
}

/// Draws an event by the weights.
const Sort& drawSort(Chance& chance) {
  int weights = 0;
  for (const Sort& sort : kSorts) weights += sort.weight;
  auto drawn = static_cast<int>(chance.below(static_cast<std::uint64_t>(weights)));
  const Sort* sort = kSorts.data();
  for (; drawn >= sort->weight; ++sort) drawn -= sort->weight;
  return *sort;
}

/// Reads TIME ms: EVENT [AMOUNT] [for TIME ms]. Returns whether the line is that.
bool parse(const std::string& line, Happening& one) {
  std::istringstream words(line);
  std::string unit, name, lasting;
  if (!(words >> one.at_ms >> unit >> name) || unit != "ms:") return false;
  const auto* sort = std::ranges::find_if(kSorts, [&](const Sort& each) { return name == each.name; });
  if (sort == kSorts.end()) return false;
  one.event = sort->event;
  if (sort->low != sort->high) words >> one.amount;
  if (sort->longest_ms > 0) words >> lasting >> one.for_ms >> unit;
  const bool isWhole = !words.fail() && words.eof();
  return isWhole && one.at_ms >= 0 && one.for_ms >= 0 && one.amount >= sort->low && one.amount <= sort->high;
}

}  // namespace

Story draw(std::uint64_t seed, std::int64_t lasts_ms) {
  constexpr std::int64_t kMeanPause_ms = 9'000, kCalm_ms = 15'000;
  Chance chance(seed ^ 0x5eed);
  Story story{seed, lasts_ms, {}};
  // Some begin before there is a first zero.
  for (std::int64_t at_ms = chance.oneIn(4) ? chance.between(0, 150) : chance.between(1000, 6000);
       at_ms < lasts_ms - kCalm_ms;
       at_ms += chance.oneIn(3) ? chance.between(1, 300) : chance.between(0, 2 * kMeanPause_ms)) {
    const Sort* const sort = &drawSort(chance);
    std::int64_t high = sort->high;
    if (sort->event == Event::kSlowDisk && !chance.oneIn(4)) high = 6'000;
    Happening one{at_ms, sort->event, chance.between(sort->low, high), 0};
    if (sort->longest_ms > 0)
      one.for_ms = chance.between(10, std::min(sort->longest_ms, lasts_ms - kCalm_ms - at_ms + 10));
    // A stage often lacks the processor for about as long as the links bridge.
    if (sort->event == Event::kStarved && chance.oneIn(3)) one.for_ms = chance.between(10, 120);
    story.happenings.push_back(one);
    // What touches changes while models are made slowly, or not at all.
    if (one.event == Event::kTouch && !chance.oneIn(3)) {
      constexpr std::int64_t kModelling = 5;
      const std::int64_t from_ms = at_ms + chance.between(0, one.for_ms), for_ms = chance.between(10, 3'000);
      chance.oneIn(2) ? story.happenings.push_back({from_ms, Event::kStarved, kModelling, for_ms})
                      : story.happenings.push_back({from_ms, Event::kSlowModels, chance.between(1, 200), for_ms});
      story.happenings.push_back(
          {from_ms + chance.between(0, for_ms), Event::kTouch, chance.between(20, 4'000), chance.between(10, 3'000)});
    }
    // People ask at the worst moment.
    const auto askWithin = [&](std::int64_t most_ms, Event event, std::int64_t amount) {
      at_ms += chance.between(0, std::min(one.for_ms, most_ms));
      story.happenings.push_back({at_ms, event, amount, 0});
    };
    if (one.event == Event::kFewMarkers && chance.oneIn(3))
      askWithin(2'000, Event::kNoise, chance.between(500, 10'000));
    const bool fails = one.event == Event::kFullDisk || one.event == Event::kFailingDisk;
    if ((!fails && one.event != Event::kSlowDisk) || chance.oneIn(2)) continue;
    askWithin(10'000, chance.oneIn(4) ? Event::kUndo : Event::kZero, 0);
    if (!fails || chance.oneIn(2)) continue;
    // A disk that recovers is slow, and people ask again.
    const std::int64_t well_ms = one.at_ms + one.for_ms;
    story.happenings.push_back({well_ms, Event::kSlowDisk, chance.between(2'000, 20'000), 90'000});
    story.happenings.push_back({well_ms + chance.between(0, 15'000), Event::kZero, 0, 0});
  }
  std::ranges::stable_sort(story.happenings, {}, &Happening::at_ms);
  return story;
}

std::string toText(const Story& story) {
  std::ostringstream out;
  out << kTitle << "\nseed " << story.seed << "\nlasts " << story.lasts_ms << " ms\n";
  for (const Happening& one : story.happenings) {
    const Sort& sort = sortOf(one.event);
    out << one.at_ms << " ms: " << sort.name;
    if (sort.low != sort.high) out << ' ' << one.amount;
    if (sort.longest_ms > 0) out << " for " << one.for_ms << " ms";
    out << '\n';
  }
  return out.str();
}

tl::expected<Story, std::string> fromText(const std::string& text) {
  std::istringstream lines(text);
  Story story;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    if (++number == 1 ? line == kTitle : line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first == "seed" && words >> story.seed) continue;
    if (first == "lasts" && words >> story.lasts_ms) continue;
    if (!parse(line, story.happenings.emplace_back()))
      return tl::unexpected("line " + std::to_string(number) + ": '" + line + "' is no line of a story");
  }
  std::ranges::stable_sort(story.happenings, {}, &Happening::at_ms);
  return story;
}

}  // namespace tractiond::simulation
