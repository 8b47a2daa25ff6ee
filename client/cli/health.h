// Decides what is wrong with an instrument, by its status and its fields: for status, watch and top alike.
#pragma once

#include "client/cli/scene.h"

#include <string>
#include <vector>

namespace traction::cli {

/// Returns whether the daemon runs without a gel file, and therefore publishes no field.
bool isWithoutGel(const v1::Status& status);

/// Returns the state of the camera, with the reason: "camera lost, being looked for (it does not answer)".
std::string cameraSentence(const v1::Status& status);

/// Returns why the daemon cannot publish fields: its camera does not stream, or there is no gel file; empty: it can.
std::string whyNoField(const v1::Status& status);

/// Returns what was configured for real time and not granted: "priority 20, memory"; empty: nothing.
std::string refusedOf(const v1::Status& status);

/// Returns why there are no valid forces that are current; empty: there are.
std::string whyNoForces(const Scene& scene, std::int64_t now_ns);

/// Returns warnings on the newest field, most important first: a recent restart, and its flags.
std::vector<std::string> warnings(const Scene& scene, std::int64_t now_ns);

/// Returns everything that is wrong, most important first, as printable text.
std::vector<std::string> problems(const Scene& scene, std::int64_t now_ns);

}  // namespace traction::cli
