// Draws the picture of the markers that an ideal camera with given optics would send.
//
// level(u, v, channel) = brightness clear(u, v) {light(u, v) [background + sum over the markers of contrast
// weight(channel) cover(u, v)] + highlights(u, v)} + noise, rounded to the format's steps and limited to 0 ... 255.
//
// cover is the share of the pixel that the visible part of the marker's disc covers, after the blur. weight is 1 in the
// marker's own channel and crossTalk in the others; it is 1 in all channels for grey markers and in grey pictures, and
// negative for dark markers. A marker of a deeper layer, which is nearer to the camera, hides those behind it. clear is
// 1 without dust. With Variety, each marker is drawn with its own shape, but hides others as a disc. So is a marker of
// a body: it is a disc in the surface that its layer forms at rest, as the camera sees it from there; one that faces
// away is not drawn.
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

/// Draws pictures of one format and one set of optics. Thread-bound.
class Renderer {
 public:
  /// Prepares the markers' shapes and the background; takes the picture's size from the sensor's camera. The arguments
  /// need not outlive the object.
  Renderer(const sensor::Sensor& sensor, const Optics& optics, Format format);

  /// Returns the size of a picture [bytes].
  std::size_t pictureSize() const { return traits_->size(width_, height_); }

  /// Draws a picture. Allocates nothing, except for markers with their own shapes or with a diameter above some 60 px.
  /// \param markers_px (u, v) in the order of sensor::markerPositions, 2 x markers; a marker that is not finite is not
  /// drawn
  /// \param seed of the noise: the same seed gives the same noise
  /// \param picture pictureSize() bytes (asserted), rows without padding
  /// \param brightness of the LED, relative to that of the optics
  void render(const Eigen::Matrix2Xd& markers_px, std::uint32_t seed, std::span<std::uint8_t> picture,
              double brightness = 1.0);

  static constexpr int kUnits = 64;  ///< per level
  /// Returns the last picture before the noise, sample by sample in the order of the format [1 / kUnits level]. Valid
  /// until the next render().
  std::span<const std::int16_t> light() const { return light_; }

 private:
  struct Layer {
    int firstMarker, count;
    double depth, radius_px;
    std::array<float, 3> weight;  ///< per channel red, green, blue
    int patch;                    ///< side of the square in which a marker is drawn [px]
    /// The blurred marker for each phase of its centre between two pixels; empty: each is drawn by itself.
    std::vector<float> stamps;
  };

  // Parts of the constructor.
  void drawBackground(const Optics& optics);
  void makeLayers(const sensor::Sensor& sensor, const Optics& optics);
  void makeNoise();

  Layer makeLayer(const sensor::MarkerLayer& layer, int firstMarker, double radius_px, const Optics& optics) const;
  std::vector<float> makeStamps(double radius_px, int patch) const;
  /// Returns the first pixel (u, v) of the square in which a marker is drawn.
  Eigen::Vector2i corner(const Layer& layer, const Eigen::Vector2d& centre) const;
  /// Returns whether any part of a marker may be in the picture; false if it is not finite.
  bool isInSight(const Layer& layer, const Eigen::Vector2d& centre) const;
  /// Converts between discs of equal focal lengths and those of the camera's aspect.
  Strip stretched(const Strip& strip) const;
  std::vector<Strip> stretched(std::vector<Strip> region) const;
  void drawVariety(const Variety& variety);
  void foreshorten(const sensor::Sensor& sensor, const sensor::Projection& project);
  double radiusOf(const Layer& layer, int marker) const { return layer.radius_px * diameters_[marker]; }
  void drawMarker(const Layer& layer, const Eigen::Vector2d& centre);
  void drawOwnShape(const Layer& layer, int marker, const Eigen::Vector2d& centre);
  void hideBehindNearer(const Eigen::Matrix2Xd& markers_px);
  void hide(const Layer& layer, int marker, const Eigen::Vector2d& centre_px, double nearerRadius,
            const Eigen::Vector2d& nearer_px);
  void add(const Layer& layer, int left, int top, int row, const float* brightness);
  void addPiece(const Layer& layer, int left, int v, int count, const float* brightness);
  void prepareDust(const std::vector<Speck>& dust);
  void dim(double brightness);
  template <int kDown, int kUp, typename Sample>
  void addNoise(std::uint32_t seed, std::span<Sample> picture);

  struct Shade {
    std::size_t sample;
    float clear;  ///< share of the light that passes the dust
  };

  Format format_;
  const tractiond::PixelFormatTraits* traits_;
  std::size_t samplesPerPixel_;
  std::array<Channel, 4> cell_;  ///< channels of a mosaic
  int width_, height_;
  std::size_t columns_;  ///< samples per row
  Blur blur_;
  double gain_;  ///< brightness of a full marker in units of light_
  double shotNoise_, readNoise_;
  std::vector<Layer> layers_;
  bool ownShapes_ = false;   ///< markers differ from each other
  double elongation_ = 0.0;  ///< in the picture's corners
  double longest_ = 1.0;     ///< upper limit of a marker's half axes, relative to the radius of its layer
  /// Factors of discs along u and v due to the camera's aspect; their product is 1.
  Eigen::Vector2d stretch_ = {1.0, 1.0};
  std::vector<double> diameters_, contrasts_;  ///< of each marker, relative to its layer's
  /// Of each marker of a body, where it is drawn: makes its shape of a disc, without a change of area. Else empty.
  std::vector<Eigen::Matrix2d> shapes_;
  std::vector<float> lightAcross_, lightDown_;  ///< light(u, v) = lightAcross_[u] + lightDown_[v]
  std::vector<std::int16_t> background_;        ///< picture without markers and noise
  std::vector<std::int16_t> light_;             ///< picture being drawn
  std::vector<std::int16_t> noise_;
  std::vector<float> patch_;
  std::vector<Shade> shades_;        ///< of all dust
  std::vector<std::uint16_t> deep_;  ///< samples of more than 8 bits
};

}  // namespace twin
