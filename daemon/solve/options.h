// Options of a solver; fixed for its life.
#pragma once

#include "sensor/elastic/influence.h"

namespace tractiond::solve {

struct SolveOptions {
  /// The real block, or the paper's half-space (which misses the total force of a thick block by up to 60 %).
  sensor::elastic::Model model = sensor::elastic::Model::kBlock;

  /// Standard deviation of a marker's centre in one frame [px], as calibrated; the frame's own scales the uncertainty.
  double noise_px = 0.018;

  /// Modes with smaller singular values are left out [n / (E pitch^2)], n being noise_px. 32 makes a frame up to a
  /// quarter faster and misreads some contacts and palms.
  double faintest = 4.0;

  /// Frames that show a touch although nothing touches, by the noise of the markers alone [1/h].
  double falseAlarmsPerHour = 10.0;
  /// Rate of the frames that this refers to: of the camera, as configured. Fixed, so that a replay finds the same.
  double frameRate_Hz = 60.0;

  /// Returns the share of the frames without a touch that show one.
  double falseAlarms() const { return falseAlarmsPerHour / (3600.0 * frameRate_Hz); }

  /// Share of the markers that may be missing; beyond, the field is not valid. Isolated gaps of the zero are not among
  /// these markers (MarkerField::isolatedGaps).
  double maxMissingFraction = 0.25;
  /// Returns the least number of markers that gives a field.
  /// \param markers M, all of the sensor
  /// \param isolatedGaps as MarkerField::isolatedGaps
  int fewestMarkers(int markers, int isolatedGaps) const {
    const int expected = markers - isolatedGaps;
    return expected - static_cast<int>(maxMissingFraction * expected);
  }

  /// Normal force above which there is a centre of pressure [N], if it is not in the noise.
  double minPressForCentre_N = 0.03;
};

}  // namespace tractiond::solve
