// Which spot is which marker.
#pragma once

#include "daemon/track/detection.h"
#include "daemon/track/lattice.h"

#include <span>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor.
class Labeller {
 public:
  Labeller(const std::vector<Lattice>& lattices, int width_px, int height_px, int spots);

  /// `spots`: what was found of each layer's colour. `reference_px`: where the markers are expected, all layers; the
  /// picture may be moved, turned and scaled against it, and the gel deformed, as long as neighbours' displacements
  /// differ by less than about 0.4 of the spacing. Writes places and `labelled` (0 or 1), all layers.
  /// False: some layer shows fewer than `least` of its markers; the outputs then mean nothing.
  bool label(std::span<const std::span<const Spot>> spots, std::span<const Vector> reference_px, double least,
             std::span<Vector> place_px, std::span<std::uint8_t> labelled);

 private:
  static constexpr int kSlack = 3;  ///< nodes beyond the lattice on each side: the seed's label may be wrong by it
  static constexpr int kShift = 2 * kSlack + 1;

  /// One layer while it is labelled, on a lattice that is kSlack wider on all sides.
  struct Work {
    Lattice lattice;                ///< the true one
    Lattice wide;                   ///< with slack; first = 0
    float spacing = 0.0F;           ///< px
    std::vector<Vector> reference;  ///< continued beyond the true lattice
    std::vector<Vector> displacement;
    std::vector<int> spot;                 ///< of a node; -1: none
    std::vector<std::uint8_t> has;         ///< spot >= 0
    std::vector<std::uint8_t> tried;       ///< number of labelled neighbours when it was last tried
    std::vector<std::uint8_t> neighbours;  ///< labelled ones among the eight nearest
    std::vector<std::uint8_t> taken;       ///< of a spot
    std::vector<float> visible;            ///< of a node without a spot: 1 if its place is well within the picture
    std::vector<float> score;              ///< kShift x kShift: how well the picture fits if all labels move by (x, y)
    std::vector<Vector> mean;              ///< kShift x kShift: mean displacement then
  };

  void prepare(Work& work, std::span<const Spot> spots, std::span<const Vector> reference);
  bool grow(Work& work, std::span<const Spot> spots);
  int growFrom(Work& work, std::span<const Spot> spots, int seed, int spot);
  int nearest(const Work& work, std::span<const Spot> spots, Vector place, float reach, float* distance,
              float* second) const;
  void setSpot(Work& work, std::span<const Spot> spots, int node, int spot);
  void scoreShifts(Work& work) const;

  float width_, height_;
  std::vector<Work> works_;
  PointGrid grid_;
};

}  // namespace tractiond::track
