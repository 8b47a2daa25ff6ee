// Makes a plane for each layer of markers from a picture of any format.
#pragma once

#include "daemon/records/frame.h"
#include "daemon/track/plane.h"
#include "sensor/gel.h"

#include <array>
#include <span>
#include <vector>

namespace tractiond::track {

/// A plane lies in the camera's own buffer if its samples have 8 or 16 bits and the picture has the wanted colour as
/// such. Else it is computed once per picture: unpacked samples of packed formats; green and grey of a Bayer mosaic
/// (means of the two greens and of all four samples, in the middle of their two by two pixels); grey of RGB (mean of
/// the three); red, green and blue of YUV.
///
/// Thread-bound. read() allocates only for the first picture of a format and size.
class Planes {
 public:
  /// \param layers one or two, for which trackable() succeeds; copied
  explicit Planes(std::span<const sensor::MarkerLayer> layers);

  /// Makes the planes of a picture. They are valid until the next call, and no longer than the frame's memory.
  /// \param frame of any size and format that trackable() accepts
  void read(const Frame& frame);

  /// Returns the plane in which the layer's markers stand out.
  const Plane& own(std::size_t layer) const { return layers_[layer].own; }
  /// Returns the plane in which they stand out less: the other layer's colour, or one in which glare would show. It has
  /// the sign of the layer itself. Its `first` is nullptr for grey markers and in a grey picture.
  const Plane& other(std::size_t layer) const { return layers_[layer].other; }
  /// Returns whether two layers are told apart by their colours in the last picture, so that cross-talk must be
  /// removed. False in a grey one.
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

}  // namespace tractiond::track
