// How the twin's camera sees the markers.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace twin {

/// The LED's image on a surface, added to all channels: strength exp(-r^2 / (2 radius^2)).
struct Highlight {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 10.0;
  double strength = 300.0;  ///< [levels]; above 255 its middle is white
};

/// Dust on the lens's side of the gel: opaque, dark, at a fixed place of the picture; blurred like the markers.
struct Speck {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 2.0;
};

/// How markers made by hand differ from each other, and discs from circles behind a wide lens.
struct Variety {
  double diameter = 0.0;    ///< standard deviation of the markers' diameters, share of the layer's
  double contrast = 0.0;    ///< likewise of their contrasts
  double elongation = 0.0;  ///< in the picture's corners, away from its middle; grows with the distance squared
  unsigned seed = 0;

  bool any() const { return diameter > 0.0 || contrast > 0.0 || elongation > 0.0; }
};

/// A level is 1/255 of the range: one step of the 8-bit picture, 16 of one of 12 bits. Defaults: the picture the
/// project's accuracy figures are given for.
struct Optics {
  double contrast = 100.0;   ///< of a marker above the background, in its own colour channel; below, if darker [levels]
  double background = 20.0;  ///< of the gel, in all channels [levels]
  double blur_px = 0.8;      ///< standard deviation of the Gaussian point spread
  double crossTalk = 0.2;    ///< share of the contrast that appears in each of the two other channels
  double readNoise = 2.0;    ///< standard deviation [levels]
  double shotNoise = 0.0;    ///< variance per level of brightness [levels]
  // Uneven light: everything is multiplied by 1 + slope . (X, Y) - falloff (X^2 + Y^2) / 2, where X and Y run from -1
  // to 1 across the picture, right and down.
  Eigen::Vector2d lightSlope = Eigen::Vector2d::Zero();
  double lightFalloff = 0.0;
  // The LED's brightness, of all light: 1 + drift sin(2 pi t / driftPeriod).
  double drift = 0.0;
  double driftPeriod = 60.0;  ///< [s]
  std::vector<Highlight> highlights;
  std::vector<Speck> dust;
  Variety variety;
};

}  // namespace twin
