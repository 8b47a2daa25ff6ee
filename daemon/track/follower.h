// Finds the markers of a reference in each picture.
#pragma once

#include "daemon/records/marker_sight.h"
#include "daemon/track/centre.h"
#include "daemon/track/centre_errors.h"
#include "daemon/track/detection.h"
#include "daemon/track/labelling.h"
#include "daemon/track/lattice.h"
#include "daemon/track/planes.h"
#include "daemon/track/reference.h"
#include "daemon/track/tear_finder.h"
#include "sensor/sensor.h"

#include <span>
#include <vector>

namespace tractiond::track {

/// Shared by followers of the same pictures: the picture, and scratch memory.
struct FollowerWorkspace {
  explicit FollowerWorkspace(const sensor::Sensor& sensor);

  Planes planes;  ///< of this frame
  Detector detector;
  Labeller labeller;
  PointGrid grid;
};

/// Thread-bound. A copy continues from the state of the original; the assignment of a follower of the same sensor
/// allocates only for the markers' appearance. look() allocates only when it learns the appearance: in the first
/// picture in which markers are found, and after learnAnew().
class Follower {
 public:
  /// One layer of markers.
  struct Layer {
    std::size_t index;  ///< of its planes in the workspace
    Lattice lattice;
    int rank;     ///< index in a rest pose's cross-talk
    bool nearer;  ///< nearer to the camera than the other layer, whose markers it hides
    Trust trust;
    double described_px;                ///< radius
    Plane plane = {}, otherPlane = {};  ///< of this frame
    std::vector<Spot> spots = {};       ///< of the last search of the whole picture
    LatticeSeen seen = {};              ///< at the last labelling
    MarkerTemplate rough = {};          ///< for spots whose blur is not known yet
    float roughScale = 0.0F;            ///< scale of its plane; 0: there is no template yet
  };

  /// \param sensor must be trackable() \param zeroFrames number of frames that a rest pose averages
  /// \param workspace must outlive the follower and its copies
  Follower(const sensor::Sensor& sensor, int zeroFrames, FollowerWorkspace& workspace);

  /// Replaces the pose that displacements are measured from; keeps the markers' places. The pose must have as many
  /// markers as the sensor.
  void adopt(const RestPose& pose);

  /// Takes over the layers' cross-talk of a pose that was taken in an earlier run.
  void setCrossTalk(const RestPose& pose);

  /// Exchanges the appearance of the markers; allocates nothing. Misfits are learned anew.
  void exchangeAppearance(Appearance& other);

  /// Learns the appearance, the cross-talk and each marker's own shape in the next picture in which markers are found,
  /// and seeks all markers from now on, including the absent ones.
  void learnAnew();

  /// Learns how far markers typically are from discs, from the last picture.
  void learnShape() { errors_.learnShape(centres_, valid_); }

  /// Finds the markers in the workspace's picture. Returns whether they were labelled anew. \param discontinuity the
  /// picture may differ much from the last one
  bool look(bool discontinuity);

  // Results of the last look(), by marker.
  std::span<const Vector> place_px() const { return place_; }  ///< of a lost one: interpolated from its neighbours
  std::span<const Vector> displacement_px() const { return displacement_; }
  std::span<const float> variance_px2() const { return errors_.variance_px2(); }
  std::span<const Centre> centres() const { return centres_; }
  std::span<const std::uint8_t> valid() const { return valid_; }
  bool following() const { return following_; }  ///< whether markers are followed from picture to picture
  bool torn() const { return torn_; }

  /// Returns whether as many columns and rows were seen as the sensor has.
  bool latticesFit() const;

  const Reference& reference() const { return reference_; }
  std::span<const Layer> layers() const { return layers_; }
  std::span<const Vector> nominal_px() const { return nominal_; }  ///< places by the sensor's description
  float spacing_px() const { return spacing_px_; }

  /// Returns the elements of a layer, of an array by marker.
  template <typename T>
  static std::span<const T> ofLayer(std::span<const T> all, const Layer& layer) {
    return all.subspan(static_cast<std::size_t>(layer.lattice.first), static_cast<std::size_t>(layer.lattice.count()));
  }

 private:
  /// Smallest amplitude of a marker, relative to rest.
  static constexpr float kDim = 0.5F;

  bool acquire();
  void follow();
  void finishFrame(bool thorough);
  void recover();
  bool recoverOne(const Layer& layer, int marker, int column, int row);
  bool searchAround(const Layer& layer, int marker, Vector place);
  bool fitAt(const Layer& layer, int marker, Vector place);
  bool adoptDeformed(const Layer& layer, int marker, float mostMisfit);
  Guess guessAt(int marker, Vector place) const;
  void heedSlope(const Layer& layer, int marker, Centre& centre);
  void learnSlopes();
  bool accept(int marker, const Centre& centre, Vector expected);
  void markOverlaps();
  void guessLost();

  const MarkerTemplate& roughOf(Layer& layer);
  void learnSize(const Layer& layer, std::span<const std::uint8_t> seen);
  void learnAppearance(std::span<const std::uint8_t> seen);
  void placeUnlabelled();
  void assumeRest();

  Appearance::Layer& looks(const Layer& layer) { return reference_.appearance.layers[layer.index]; }
  const Appearance::Layer& looks(const Layer& layer) const { return reference_.appearance.layers[layer.index]; }
  void fit(const Layer& layer, std::span<const Guess> guesses, std::span<Centre> centres) const;
  void fitAll(const Layer& layer);
  bool wanted(int marker) const { return reference_.present[marker] || seeksAll_; }
  int countValid() const;
  int countWanted() const;

  FollowerWorkspace* workspace_;
  int markers_;
  std::vector<Layer> layers_;
  std::vector<Vector> nominal_;
  float spacing_px_;
  Reference reference_;
  bool newAppearance_ = false;  ///< since the picture before
  bool seeksAll_ = false;       ///< and learns cross-talk and each marker's own shape, too

  // Per marker.
  std::vector<Vector> place_, previous_, velocity_;
  std::vector<Vector> displacement_, increment_;
  std::vector<std::uint8_t> valid_, wasValid_, stepped_;  ///< stepped: valid now and in the picture before
  std::vector<std::uint8_t> mixed_, attempts_;
  std::vector<Vector> slope_;              ///< of the surroundings' brightness [levels / px]
  std::vector<std::uint8_t> slopeFrames_;  ///< number averaged; 0: this picture alone
  std::vector<Vector> labelPlace_;
  std::vector<std::uint8_t> labelled_;
  std::vector<int> lostFor_;  ///< pictures
  std::vector<int> lost_;
  std::vector<Guess> guesses_;
  std::vector<Centre> centres_;
  bool following_ = false;
  int acquireIn_ = 0;  ///< pictures until the next try
  int searches_ = 0;   ///< wide searches left in this picture
  unsigned frames_ = 0;
  bool torn_ = false;

  TearFinder tears_;
  CentreErrors errors_;
};

}  // namespace tractiond::track
