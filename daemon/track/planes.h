// Provides a plane for each layer of markers, from pictures of any format.
#pragma once

#include "daemon/records/frame.h"
#include "daemon/track/plane.h"
#include "sensor/gel.h"

#include <array>
#include <span>
#include <vector>

namespace tractiond::track {

/// Planes lie in the camera's own buffer if its samples have 8 or 16 bits and it has the wanted colour. Once per
/// picture, packed samples are unpacked, and other colours computed: green and grey of a Bayer mosaic (means of the two
/// greens, of all four samples, in the middle of two by two pixels), grey of RGB (the mean of the three), and red,
/// green and blue of YUV.
///
/// Thread-bound. read() allocates only for the first picture of a format and size.
class Planes {
 public:
  /// The layers must be trackable().
  explicit Planes(std::span<const sensor::MarkerLayer> layers);

  /// Reads a frame. The planes are valid until the next call, and as long as the frame's memory.
  void read(const Frame& frame);

  /// Returns the plane in which the layer's markers have the most contrast.
  const Plane& own(std::size_t layer) const { return layers_[layer].own; }
  /// Returns the plane in which they should have little contrast: of the other layer's colour, or one that shows glare;
  /// with the sign of the layer itself. Null for grey markers and in a grey picture.
  const Plane& other(std::size_t layer) const { return layers_[layer].other; }
  /// Returns whether the picture distinguishes two layers by colour, with cross-talk.
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

/// Returns a colour that the picture contains as samples: not for packed formats, green of a mosaic, colours of YUV.
Plane planeOf(const Frame& frame, sensor::Colour colour);

}  // namespace tractiond::track
