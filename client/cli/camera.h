// Reads and changes the camera's features from the command line.
#pragma once

#include "traction/control.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

/// Carries out the steps in order and prints their reports together, as a table or one line of JSON. If a step fails,
/// prints the reports of the steps before it and throws its error, which names the step; later steps are not sent.
/// \throws Error, OutputError
void camera(const ControlOptions& control, const std::vector<CameraStep>& steps, bool json);

/// Prints the features that the configuration sets or that were written, and the camera's temperature. \throws Error,
/// OutputError
void cameraSummary(const ControlOptions& control, bool json);

/// Sends one software trigger, and prints the remarks of the answer. \throws Error, OutputError
void trigger(const ControlOptions& control);

/// Parses "ExposureTime=4000" into a step that writes, split at the first '='. Returns nothing if there is no '=', or
/// nothing before it; the value may be empty.
std::optional<CameraStep> parseWrite(const std::string& text);

/// Joins words into the writes that were probably meant, for an error message: "Gain 3" -> "Gain=3", "Gain" ->
/// "Gain=VALUE"; an example if that is not clear.
std::string asWrites(const std::vector<std::string>& words);

/// Returns a table: a block of lines for a single feature, one line per feature for several; empty without features.
/// Marks with '*' values that differ from the configuration or from before the session's first write. Control
/// characters become blanks.
std::string table(const CameraReport& report);

}  // namespace traction::cli
