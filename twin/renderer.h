// Draws the picture of the markers: what an ideal camera with these optics would send.
//
// level(u, v, channel) = brightness clear(u, v) {light(u, v) [background + sum over the markers of contrast
// weight(channel) cover(u, v)] + highlights(u, v)} + noise, rounded to the format's steps and cut to 0 ... 255. cover
// is the share of the visible part of the marker's disc in the pixel, after the blur; weight is 1 in the marker's own
// channel and crossTalk in the others, 1 in all for grey markers and in grey pictures, and negative for dark markers. A
// marker of a deeper layer, which is nearer to the camera, hides what is behind it. clear is 1 without dust. Where
// markers differ from each other, each is drawn by itself; what hides another is a disc all the same.
#pragma once

#include "sensor/sensor.h"
#include "twin/blur.h"
#include "twin/format.h"
#include "twin/optics.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace twin {

/// Thread-bound: one thread calls render().
class Renderer {
 public:
  Renderer(const sensor::Sensor& sensor, const Optics& optics, Format format);

  std::size_t pictureSize() const { return twin::pictureSize(format_, width_, height_); }  ///< bytes

  /// Markers in the order of sensor::markerPositions, 2 x count [px]; one that is not finite is not drawn. The same
  /// seed gives the same noise. `picture` has pictureSize() bytes, rows without padding. `brightness`: of the LED now,
  /// relative to the optics'. Allocates nothing.
  void render(const Eigen::Matrix2Xd& markers_px, std::uint32_t seed, std::span<std::uint8_t> picture,
              double brightness = 1.0);

  /// The last picture before the noise, in 1 / kUnits of 1/255 of the range.
  static constexpr int kUnits = 64;
  std::span<const std::int16_t> light() const { return light_; }

 private:
  struct Layer {
    int firstMarker, count;
    double depth, radius_px;
    std::array<float, 3> weight;  ///< of the channels red, green, blue
    int patch;                    ///< width and height of a stamp [px]
    std::vector<float> stamps;    ///< the marker at each phase of its centre between two pixels
  };

  Layer makeLayer(const sensor::MarkerLayer& layer, int firstMarker, double radius_px, const Optics& optics) const;
  Strip stretched(const Strip& strip) const;
  std::vector<Strip> stretched(std::vector<Strip> region) const;
  void drawVariety(const Variety& variety);
  double radiusOf(const Layer& layer, int marker) const { return layer.radius_px * diameters_[marker]; }
  void drawMarker(const Layer& layer, const Eigen::Vector2d& centre);
  void drawOwnShape(const Layer& layer, int marker, const Eigen::Vector2d& centre);
  void hideBehindNearer(const Eigen::Matrix2Xd& markers_px);
  void hide(const Layer& layer, int marker, const Eigen::Vector2d& centre_px, double nearerRadius,
            const Eigen::Vector2d& nearer_px);
  void add(const Layer& layer, int left, int top, int row, const float* brightness);
  void sortIntoCells(const Eigen::Matrix2Xd& markers_px);
  void prepareDust(const std::vector<Speck>& dust);
  void dim(double brightness);
  template <int kDown, int kUp, typename Sample>
  void addNoise(std::uint32_t seed, std::span<Sample> picture);

  struct Shade {
    std::size_t sample;
    float clear;  ///< share of the light that passes
  };

  Format format_;
  int width_, height_;
  std::size_t columns_;  ///< samples in a row
  Blur blur_;
  double gain_;  ///< units of light_ in a marker
  double shotNoise_, readNoise_;
  std::vector<Layer> layers_;
  bool ownShapes_ = false;                      ///< markers differ from each other
  double elongation_ = 0.0;                     ///< in the corners
  Eigen::Vector2d stretch_ = {1.0, 1.0};        ///< of what is round before u and v differ in scale; keeps areas
  std::vector<double> diameters_, contrasts_;   ///< of the markers, relative to their layer's
  std::vector<float> lightAcross_, lightDown_;  ///< light(u, v) = lightAcross_[u] + lightDown_[v]
  std::vector<std::int16_t> background_;        ///< picture without markers and noise
  std::vector<std::int16_t> light_;             ///< the picture in the making
  std::vector<std::int16_t> noise_;
  std::vector<float> patch_;
  std::vector<Shade> shades_;        ///< of all dust
  std::vector<std::uint16_t> deep_;  ///< samples of more than 8 bits

  // Markers by square cells of the picture, to find those that overlap.
  double cell_px_;
  int cellColumns_, cellRows_;
  std::vector<int> firstInCell_, nextInCell_;
};

}  // namespace twin
