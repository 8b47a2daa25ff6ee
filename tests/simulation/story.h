// A story: the events that happen to an instrument in one run, also as a readable text.
#pragma once

#include "tests/simulation/world.h"

#include <tl/expected.hpp>

#include <string>
#include <vector>

namespace tractiond::simulation {

enum class Event {
  // The camera's, each for a while [ms].
  kLoss,           ///< so many of 100 frames never arrive
  kBroken,         ///< so many of 100 frames arrive with packets missing
  kSilence,        ///< nothing arrives
  kAgain,          ///< so many of 100 frames arrive a second time, later
  kLate,           ///< frames are under way for up to so many ms longer
  kIdsRestart,     ///< the counter begins anew
  kIdsJump,        ///< the counter jumps by so many
  kOtherPictures,  ///< its settings are changed: pictures have another size until it is opened anew
  kNoClock,        ///< its clock shows 0 for a while
  kClockStep,      ///< the camera's clock steps by so many ms
  kGone,           ///< it has no power; then its counter begins anew
  kSlowAnswers,    ///< it answers after so many ms
  kHeld,           ///< another client holds its control when it is opened
  kHangs,          ///< a library hangs that opens it
  // The host's.
  kTimeSet,     ///< the time of day is set by so many seconds
  kStarved,     ///< a stage (0 .. 4), or the thread that makes models (5), gets no processor for a while
  kSlowModels,  ///< a solution, and a model, takes up to so many ms for a while
  kKill,        ///< the daemon is killed, and started again
  kPowerCut,
  // The disk's, each for a while.
  kSlowDisk,  ///< each fsync takes so many ms
  kFullDisk,
  kFailingDisk,  ///< fsync fails
  // People's.
  kZero,
  kZeroAnyway,
  kUndo,
  kReopen,      ///< the configuration is edited, as operator.h says, and reloaded
  kRestart,     ///< the daemon is stopped, and started again
  kQuestion,    ///< a feature of the camera is read
  kNoise,       ///< a calibration step over so many ms
  kFinish,      ///< the step that writes the calibrated gel file
  kTouch,       ///< something presses with so many mN for a while
  kFewMarkers,  ///< the markers are hidden for a while
};

inline constexpr std::size_t kEvents = 32;

struct Happening {
  std::int64_t at_ms = 0;
  Event event = Event::kLoss;
  std::int64_t amount = 0;
  std::int64_t for_ms = 0;
};

struct Story {
  std::uint64_t seed = 0;  ///< of noise, of delays, of what a loss of power leaves
  std::int64_t lasts_ms = 0;
  std::vector<Happening> happenings;  ///< in the order of their times
};

/// Draws a story at random; the same arguments give the same story.
Story draw(std::uint64_t seed, std::int64_t lasts_ms);

/// Returns the story as text, which fromText() reads.
std::string toText(const Story& story);
/// Reads a story. Fails with the line and what is wrong with it.
tl::expected<Story, std::string> fromText(const std::string& text);

}  // namespace tractiond::simulation
