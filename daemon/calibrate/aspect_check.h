// Checks whether the ratio of the picture's scales in u and v (its aspect) differs from the gel file's.
#pragma once

#include "sensor/sensor.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace tractiond::calibrate {

struct AspectCheckOptions {
  double pattern = 1e-3;  ///< deviation of the pitch in x against that in y, relative: a printer's feed
  int iterations = 60;    ///< of each fit
};

/// The aspect that explains the markers' places best.
struct AspectSeen {
  bool differs = false;    ///< it explains them, and the file's does not
  double expected = 1.0;   ///< camera.aspect of the file
  double aspect = 1.0;     ///< of the picture
  double deviation = 0.0;  ///< of `aspect`, with the pattern's own
  /// Residual of the best camera with the file's aspect; infinite: there is none; 0: it was not sought, as the aspects
  /// do not differ.
  double held_px = 0.0;
  double residual_px = 0.0;  ///< of the best camera

  // If `differs`; sentences without a full stop.
  std::string what() const;    ///< Describes the difference to an operator.
  std::string remedy() const;  ///< Describes what to do: the key of the gel file and its value, or what to measure.
};

/// Fits pose, lens and pattern to the markers' places (fitGeometry) with a free aspect and, if that is not the file's,
/// also with the file's, and compares the two. A tilt, another focal length, distance or distortion do not count as
/// another aspect: both fits are free to take them up. Where few markers of one layer are seen at a slant, a longer
/// lens and another aspect look alike, and `differs` is false. Takes a tenth of a second. Reentrant.
/// \param start the file's lens and aspect, and a pose from which the fits start
/// \param place_px 2 M, as in RestPose
/// \param first the aspect that the search starts from
/// \param present M; 0: the marker is ignored
/// \return nothing where no aspect explains the places within half a pixel, or too few markers are present
std::optional<AspectSeen> seenAspect(const sensor::Sensor& start, double first, std::span<const float> place_px,
                                     std::span<const std::uint8_t> present, const AspectCheckOptions& options = {});

}  // namespace tractiond::calibrate
