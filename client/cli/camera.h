// The camera's features as a person asks for them, and as a table.
#pragma once

#include "traction/control.h"

#include <optional>
#include <string>
#include <vector>

namespace traction::cli {

/// One after another; what they tell is printed together, also of those before one that fails: a table, or one line of
/// JSON. \throws Error, OutputError
void camera(const ControlOptions& control, const std::vector<CameraStep>& steps, bool json);

/// What the configuration set or somebody has written, and how warm the camera is. \throws Error, OutputError
void cameraSummary(const ControlOptions& control, bool json);

/// One software trigger. \throws Error
void trigger(const ControlOptions& control);

/// "ExposureTime=4000" -> a step that writes; nothing where that is none.
std::optional<CameraStep> parseWrite(const std::string& text);

/// How words that are no writes were meant: "Gain 3" -> "Gain=3".
std::string asWrites(const std::vector<std::string>& words);

/// A block of lines a feature or, of more than one, a line each in columns; what is not as the configuration says or as
/// it was is marked.
std::string table(const CameraReport& report);

}  // namespace traction::cli
