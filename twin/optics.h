// Optics of the twin's camera.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace twin {

/// Reflection of the LED on a surface, added to all channels: strength exp(-r^2 / (2 radius^2)).
struct Highlight {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< (u, v)
  double radius_px = 10.0;                              ///< standard deviation of the brightness
  double strength = 300.0;                              ///< [levels]; above 255 its centre is saturated
};

/// Dust on the camera side of the gel: opaque and dark, at a fixed place of the picture, blurred like the markers.
struct Speck {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< (u, v)
  double radius_px = 2.0;
};

/// Variation of handmade markers, and elongation of discs by a wide lens.
struct Variety {
  double diameter = 0.0;  ///< standard deviation of the markers' diameters, relative to the layer's
  double contrast = 0.0;  ///< standard deviation of their contrasts, relative to the layer's
  /// Of markers in the picture's corners, radially; grows with the squared distance from the centre.
  double elongation = 0.0;
  unsigned seed = 0;  ///< of the markers' diameters and contrasts

  /// Returns whether there is any variation.
  bool any() const { return diameter > 0.0 || contrast > 0.0 || elongation > 0.0; }
};

/// One level is 1/255 of the range: 1 step of an 8-bit picture, 16 steps of a 12-bit one. The defaults are those of the
/// project's accuracy figures.
struct Optics {
  /// Level of a marker above the background (below, if it is darker) in its own colour channel [levels].
  double contrast = 100.0;
  double background = 20.0;  ///< level of the gel in all channels [levels]
  double blur_px = 0.8;      ///< standard deviation of the Gaussian point spread
  double crossTalk = 0.2;    ///< share of the contrast in each of the two other channels
  double readNoise = 2.0;    ///< standard deviation [levels]
  double shotNoise = 0.0;    ///< variance per level of brightness [levels]
  // Uneven light: all levels are multiplied by 1 + slope . (X, Y) - falloff (X^2 + Y^2) / 2, where X and Y run from -1
  // to 1 across the picture, right and down.
  Eigen::Vector2d lightSlope = Eigen::Vector2d::Zero();
  double lightFalloff = 0.0;
  // Brightness of the LED over time, relative: 1 + drift sin(2 pi t / driftPeriod).
  double drift = 0.0;
  double driftPeriod = 60.0;  ///< [s]
  std::vector<Highlight> highlights;
  std::vector<Speck> dust;
  Variety variety;
};

}  // namespace twin
