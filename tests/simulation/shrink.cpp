// Strategy: delta debugging (Zeller and Hildebrandt 2002): halves are left out first, then ever smaller parts, until no
// single happening can be left out. A story with one happening less draws other numbers from there on, so that its law
// may hold though the happening has nothing to do with it. Therefore the rest is tried with other seeds: the last
// happenings alone, then with shorter pauses, then once more with parts left out. The shorter a story is, the more
// seeds are tried, as the simulated time for them is limited.
#include "tests/simulation/shrink.h"

#include <algorithm>

namespace tractiond::simulation {
namespace {

class Shrinking {
 public:
  Shrinking(const Story& story, const Breaks& breaks)
      : least_(story)
      , breaks_(breaks) {}

  const Story& least() const { return least_; }

  /// Replaces the least story by `story` if that breaks the law with its own seed or, if `others`, with one of the
  /// next. Returns whether it does.
  bool take(Story story, bool others) {
    constexpr std::int64_t kMost_ms = 1'800'000;  // for one story
    for (std::int64_t spent_ms = 0; !others || (spent_ms < kMost_ms && left_ms_ > 0); ++story.seed) {
      if (const auto at_ms = breaks_(story)) {
        least_ = std::move(story);
        least_.lasts_ms = std::min(least_.lasts_ms, *at_ms + 1000);
        std::erase_if(least_.happenings, [&](const Happening& one) { return one.at_ms > *at_ms; });
        return true;
      }
      if (!others) break;
      spent_ms += story.lasts_ms + kPause_ms;
      left_ms_ -= story.lasts_ms + kPause_ms;
    }
    return false;
  }

  /// Leaves out all but the last few happenings, with other seeds: these have often broken the law alone.
  void keepLast() {
    for (std::size_t count = 1; count < least_.happenings.size(); ++count) {
      Story last = least_;
      last.happenings.erase(last.happenings.begin(), last.happenings.end() - static_cast<std::ptrdiff_t>(count));
      if (take(sooner(std::move(last), 0), true)) return;
    }
  }

  /// Leaves out parts, by delta debugging.
  void leaveOut(bool others) {
    for (std::size_t part = std::max<std::size_t>(least_.happenings.size() / 2, 1);;) {
      bool hasShrunk = false;
      for (std::size_t i = 0; i < least_.happenings.size();) {
        Story shorter = least_;
        const auto first = shorter.happenings.begin() + static_cast<std::ptrdiff_t>(i);
        const std::size_t count = std::min(part, least_.happenings.size() - i);
        shorter.happenings.erase(first, first + static_cast<std::ptrdiff_t>(count));
        if (take(std::move(shorter), others))
          hasShrunk = true;
        else
          i += part;
      }
      if (part > 1)
        part /= 2;
      else if (!hasShrunk)
        return;
    }
  }

  /// Shortens the pauses before happenings, with other seeds.
  void hurry() {
    for (std::size_t i = 0; i < least_.happenings.size(); ++i) {
      Story cut = sooner(least_, i);
      if (cut.lasts_ms < least_.lasts_ms) take(std::move(cut), true);
    }
  }

 private:
  /// Time after which an instrument that has just started has a zero.
  static constexpr std::int64_t kPause_ms = 3000;

  /// Returns the story with at most that pause before happening `i`.
  static Story sooner(Story story, std::size_t i) {
    const std::int64_t before_ms = i == 0 ? 0 : story.happenings[i - 1].at_ms;
    const std::int64_t cut_ms = std::max<std::int64_t>(story.happenings[i].at_ms - before_ms - kPause_ms, 0);
    for (; i < story.happenings.size(); ++i) story.happenings[i].at_ms -= cut_ms;
    story.lasts_ms -= cut_ms;
    return story;
  }

  Story least_;
  const Breaks& breaks_;
  std::int64_t left_ms_ = 72'000'000;  ///< of simulated time for other seeds
};

}  // namespace

Story shrink(const Story& story, const Breaks& breaks) {
  Shrinking shrinking(story, breaks);
  if (!shrinking.take(story, false)) return story;
  shrinking.leaveOut(false);
  shrinking.keepLast();
  shrinking.hurry();
  shrinking.leaveOut(true);
  shrinking.hurry();
  return shrinking.least();
}

}  // namespace tractiond::simulation
