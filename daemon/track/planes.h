// What the tracker needs of a picture, whatever its format: a plane for each layer of markers.
#pragma once

#include "daemon/records/frame.h"
#include "daemon/track/plane.h"
#include "sensor/gel.h"

#include <array>
#include <span>
#include <vector>

namespace tractiond::track {

/// Planes lie in the camera's own buffer where its samples have 8 or 16 bits and the light wanted is one that it has.
/// Packed samples are unpacked once per picture. Made once per picture, too, are green and grey of a Bayer mosaic
/// (means of the two greens, of all four, in the middle of their two by two pixels), grey of RGB (the mean of the
/// three), and red, green and blue of YUV.
///
/// Thread-bound. read() allocates only for the first picture of a format and size.
class Planes {
 public:
  /// One or two layers, as trackable() has them.
  explicit Planes(std::span<const sensor::MarkerLayer> layers);

  /// The planes are valid until the next call, and as long as the frame's memory.
  void read(const Frame& frame);

  /// Where the layer's markers stand out.
  const Plane& own(std::size_t layer) const { return layers_[layer].own; }
  /// Where they should not, or less: the other layer's colour, or one in which glare would show; with the sign of the
  /// layer itself. Null for grey markers and in a grey picture.
  const Plane& other(std::size_t layer) const { return layers_[layer].other; }
  /// The picture tells two layers apart by their colours, and mixes them.
  bool mixes() const { return mixes_; }

 private:
  struct Layer {
    sensor::Colour colour, otherColour;
    bool darker;
    Plane own = {}, other = {};
    std::vector<std::uint16_t> made = {};
  };
  struct Source;

  Source sourceOf(const Frame& frame);
  void makeOwn(const Source& source, Layer& layer);

  std::vector<Layer> layers_;
  std::vector<std::uint16_t> unpacked_;
  bool coloursDiffer_;
  bool mixes_ = false;
};

/// A colour of a picture that has it as such: no packed format, no green of a mosaic, no colour of YUV.
Plane planeOf(const Frame& frame, sensor::Colour colour);

}  // namespace tractiond::track
