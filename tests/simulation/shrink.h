// Shrinks a story that breaks a law to one of few happenings.
#pragma once

#include "tests/simulation/story.h"

#include <functional>
#include <optional>

namespace tractiond::simulation {

/// Returns when a story breaks the law in question [ms]; nothing if it does not, or breaks another one first.
using Breaks = std::function<std::optional<std::int64_t>(const Story&)>;

/// Returns a story of few happenings that breaks the law, often of another seed than `story`; `story` if that does not
/// break it. The same arguments give the same story. Runs at most 20 h of simulated time for other seeds.
Story shrink(const Story& story, const Breaks& breaks);

}  // namespace tractiond::simulation
