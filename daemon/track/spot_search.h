// Finds spots, and the grid that they form, in a picture whose scale is not known: for an operator's questions and for
// the first gel file. Allocates and takes up to a second: not for the threads that process frames.
#pragma once

#include "daemon/records/snapshot.h"
#include "daemon/track/detection.h"
#include "daemon/track/lattice.h"
#include "sensor/sensor.h"

#include <optional>
#include <span>

namespace tractiond::track {

/// Channels of a plain picture in which a layer's markers appear.
struct LayerChannels {
  int own = 0;     ///< 0: red or grey, 1: green, 2: blue
  int other = -1;  ///< of the other colour, in which they are weaker; -1: there is none
};
LayerChannels channelsOf(const sensor::MarkerLayer& layer, const PlainPicture& picture);

/// Searches one picture for spots again and again. Thread-bound.
class SpotSearch {
 public:
  /// \param markers expected number of markers
  /// \param picture must outlive the object
  SpotSearch(int markers, const PlainPicture& picture);

  /// Returns the spots of this radius that stand out more in channel `own` than in `other`. Valid until the next call.
  std::span<const Spot> spots(LayerChannels channels, double radius_px, bool dark);

 private:
  const PlainPicture& picture_;
  Detector detector_;
};

/// Returns the median distance between a spot and the nearest other one [px]; nothing for fewer than ten spots.
std::optional<float> spacingOf(std::span<const Spot> spots);

/// A square grid of spots in the picture.
struct SeenGrid {
  int spots = 0;            ///< spots that have neighbours on three sides or more
  float spacing_px = 0.0F;  ///< median, along u; along v it is `aspect` times that
  float roll_rad = 0.0F;    ///< direction of its rows or columns in the picture, from u to v, within 45 degrees
  Vector middle_px;         ///< mean of the spots
};

/// Finds the grid of a layer's markers by their appearance alone: for spots of each radius that can be tracked,
/// measures distance and direction of the nearest neighbours, and returns the grid with the most spots; nothing if
/// there are fewer than a third of the layer's markers. Neither pitch, diameter, depth nor the camera's pose of the
/// sensor are used.
/// \param index of the layer
std::optional<SeenGrid> seenGrid(const sensor::Sensor& sensor, std::size_t index, const PlainPicture& picture);

}  // namespace tractiond::track
