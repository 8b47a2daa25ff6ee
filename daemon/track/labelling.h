// Labels spots: decides which spot is which marker.
#pragma once

#include "daemon/records/gel_report.h"
#include "daemon/track/detection.h"
#include "daemon/track/lattice.h"

#include <span>
#include <vector>

namespace tractiond::track {

struct LabelOptions {
  bool seenBefore = false;  ///< true: the reference is of an earlier picture, from which this one is not far
  double least = 0.3;       ///< share of a layer's markers that must be labelled
  float border_px = 0.0F;   ///< width of the picture's border in which spots may be missed
};

/// Thread-bound. Allocates only in the constructor.
class Labeller {
 public:
  /// \param lattices of the sensor's layers (latticesOf())
  /// \param width_px, height_px size of the pictures
  /// \param spots largest number of spots per layer
  Labeller(const std::vector<Lattice>& lattices, int width_px, int height_px, int spots);

  /// Decides which spot is which marker, in three steps. (1) In each layer, in their order, grows a group of labelled
  /// spots from a seed: one marker after the other, the one with most labelled neighbours first, takes the spot at the
  /// place that these predict. (2) Rates every shift of a group's labels by whole columns and rows: spots outside the
  /// lattice, markers without a spot where the picture should show one, and the distance from the reference count
  /// against it. (3) Applies the best shift; of two layers, the pair that also moves alike.
  ///
  /// The picture may be shifted, turned and scaled against the reference, and the gel deformed, as long as neighbours'
  /// displacements differ by less than about 0.4 of the spacing. Returns false, with undefined outputs, if some layer's
  /// largest group has at most half as many spots as it has markers, or if fewer than options.least of its markers are
  /// labelled in the end. There is no other error: sizes are not checked.
  /// \param spots per layer, in the order of the lattices: those of its colour, in any order, and at most as many as
  /// the constructor was given
  /// \param reference_px expected places, by marker of all layers; also of those that the picture does not show
  /// \param place_px by marker of all layers: the place of each labelled one; the others stay as they are
  /// \param labelled likewise; 1: labelled, 0: not
  bool label(std::span<const std::span<const Spot>> spots, std::span<const Vector> reference_px,
             const LabelOptions& options, std::span<Vector> place_px, std::span<std::uint8_t> labelled);

  /// Returns the columns and rows that label() saw, one per layer. Valid after a label() that returned true, until the
  /// next one.
  std::span<const LatticeSeen> seen() const { return seen_; }

 private:
  /// A shift of all labels by (x, y): how well the picture then fits, and its distance from the reference.
  struct Shift {
    float score = 0.0F;
    int x = 0, y = 0;
    Vector mean;  ///< px
  };

  /// One layer while it is labelled.
  struct Work {
    Lattice lattice;  ///< of the layer
    Lattice wide;     ///< extended by the slack on all sides; first = 0
    int slackX = 0, slackY = 0;
    float spacing = 0.0F;           ///< smallestSpacing() [px]
    std::vector<Vector> reference;  ///< extended beyond the lattice
    std::vector<Vector> displacement;
    std::vector<int> spot;                 ///< by node; -1: none
    std::vector<std::uint8_t> has;         ///< spot >= 0
    std::vector<std::uint8_t> tried;       ///< number of labelled neighbours when it was last tried
    std::vector<std::uint8_t> neighbours;  ///< labelled ones among the eight nearest
    std::vector<int> open;                 ///< nodes without a spot that have a neighbour with one
    std::vector<std::uint8_t> taken;       ///< by spot: it is assigned
    std::vector<std::uint8_t> visible;     ///< by node: its place is well within the picture
    std::vector<int> hasSum, missingSum;   ///< sums over rectangles of nodes: with a spot; visible, without one
    std::vector<Vector> displacementSum;
    std::vector<Shift> shifts;  ///< the best ones, best first
    Shift chosen;
  };

  void prepare(Work& work, std::span<const Spot> spots, std::span<const Vector> reference);
  bool grow(Work& work, std::span<const Spot> spots);
  int growFrom(Work& work, std::span<const Spot> spots, int seed, int spot);
  int nearest(const Work& work, std::span<const Spot> spots, Vector place, float reach, float* distance,
              float* second) const;
  void setSpot(Work& work, std::span<const Spot> spots, int node, int spot);
  void findVisible(Work& work, float border_px) const;
  void scoreShifts(Work& work, bool seenBefore) const;
  void chooseShifts();
  LatticeSeen extent(const Work& work) const;

  float width_, height_;
  std::vector<Work> works_;
  std::vector<LatticeSeen> seen_;
  PointGrid grid_;
};

}  // namespace tractiond::track
