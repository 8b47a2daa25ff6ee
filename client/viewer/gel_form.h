// The gel as it is described in a form of the page.
#pragma once

#include "sensor/sensor.h"

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <string>

namespace traction::view {

/// Returns a number of what the page has sent.
/// \param otherwise what a number that is missing is
/// \param of begin of the error's sentence
/// \throws Error kRefused with its name and range if it is missing or out of range
double numberIn(const nlohmann::ordered_json& from, const char* name, double low, double high,
                std::optional<double> otherwise = {}, const std::string& of = "");
/// Returns a text of what the page has sent; empty: there is none.
/// \throws Error kRefused if it has more than 64 bytes
std::string textIn(const nlohmann::ordered_json& from, const char* name);

/// Returns `from` with what the form says of the gel, its layers and the window; the nodes lie over the first layer.
/// Unless the lens was measured, the form's lens and the picture's size are taken, too, with a lens's usual deviations.
/// The camera's pose is set to straight above the gel's centre at the form's distance.
/// \param form untrusted: {"width_mm", "height_mm", "thickness_mm", "youngs_modulus_kpa", "poisson_ratio", "gel_index",
/// "window": "none" | "acrylic" | "glass", "window_mm", "distance_mm", "marker_depth_mm", "marker_place_mm", "lens_mm",
/// "pixel_um", "width_px", "height_px", "layers": [{"colour", "contrast", "columns", "rows", "pitch_mm", "depth_mm",
/// "diameter_mm", "x_mm", "y_mm"}]}
/// \param isMeasured the lens of `from` was measured
/// \throws Error kRefused with the name and the range of a number that is missing or out of range
sensor::Sensor sensorOf(const nlohmann::ordered_json& form, sensor::Sensor from, bool isMeasured);

}  // namespace traction::view
