// Reads and changes the camera's features from the command line.
#pragma once

#include "traction/control.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

/// Carries out the steps in order and prints their reports together, as a table or one line of JSON; of a feature that
/// several report, only the last state. Without features and remarks, the text is "done", or that no feature matches.
/// If a step fails, later steps are not sent: the reports of the steps before it are printed, and its error is thrown
/// with the feature's name; the error of the first step is thrown as it is. \throws Error, OutputError
void camera(const ControlOptions& control, const std::vector<CameraStep>& steps, bool json);

/// Prints the features that the configuration sets or that were written, and the camera's temperatures: as a table
/// below a line with the camera's name and its number of features, or as one line of JSON. \throws Error, OutputError
void cameraSummary(const ControlOptions& control, bool json);

/// Sends one software trigger, and prints the remarks of the answer; nothing if there are none. \throws Error,
/// OutputError
void trigger(const ControlOptions& control);

/// Parses "ExposureTime=4000" into a step that writes, split at the first '='. Returns nothing if there is no '=', or
/// nothing before it; the value may be empty.
std::optional<CameraStep> parseWrite(const std::string& text);

/// Joins words into the writes that were probably meant, for an error message: "Gain 3" -> "Gain=3", "Gain" ->
/// "Gain=VALUE"; "ExposureTime=4000" if a word is empty or begins with '='; empty without words.
std::string asWrites(const std::vector<std::string>& words);

/// Returns a table whose lines end with a newline: a block of lines for a single feature, one line per feature for
/// several, below the names of their categories; empty without features. Marks with '*' values that differ from the
/// configuration or from before the session's first write. What is not printable becomes '?'.
std::string table(const CameraReport& report);

}  // namespace traction::cli
