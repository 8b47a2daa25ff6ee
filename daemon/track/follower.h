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

/// What followers of the same pictures share: the picture, and memory that none of them keeps from one to the next.
struct FollowerWorkspace {
  explicit FollowerWorkspace(const sensor::Sensor& sensor);

  Planes planes;  ///< of this frame
  Detector detector;
  Labeller labeller;
  PointGrid grid;
};

/// Thread-bound. A copy goes on from where the original is; assigning a follower of the same sensor allocates only for
/// what markers look like. look() allocates only where it learns that: in the first picture in which markers are found,
/// and after learnAnew().
class Follower {
 public:
  /// One layer of markers.
  struct Layer {
    std::size_t index;  ///< of its planes
    Lattice lattice;
    int rank;     ///< in a rest pose's cross-talk
    bool nearer;  ///< to the camera than the other layer: its markers hide the other's
    Trust trust;
    double described_px;                ///< radius
    Plane plane = {}, otherPlane = {};  ///< of this frame
    std::vector<Spot> spots = {};       ///< where they were last sought in the whole picture
    LatticeSeen seen = {};              ///< when the markers were labelled last
    MarkerTemplate rough = {};          ///< for spots whose blur is not known yet
    float roughScale = 0.0F;            ///< of the plane that it is for; 0: none yet
  };

  /// The sensor is trackable(). `workspace` must outlive the follower and its copies; a rest pose averages `zeroFrames`
  /// frames.
  Follower(const sensor::Sensor& sensor, int zeroFrames, FollowerWorkspace& workspace);

  /// Measures from this pose from now on; the markers' places are kept. The pose has as many markers as the sensor.
  void adopt(const RestPose& pose);

  /// Takes the cross-talk of the layers from a pose that was taken in an earlier run.
  void setCrossTalk(const RestPose& pose);

  /// Exchanges what the markers look like; allocates nothing. What both leave unexplained is learned anew.
  void exchangeAppearance(Appearance& other);

  /// Learns in the next picture in which markers are found what they look like, cross-talk and each one's own shape
  /// included, and seeks all markers from now on, the absent ones, too.
  void learnAnew();

  /// Learns from the picture that was looked at last how far markers typically are from discs.
  void learnShape() { errors_.learnShape(centres_, valid_); }

  /// Finds the markers in the workspace's picture. `discontinuity`: it may be far from the one before. Returns whether
  /// they were labelled anew.
  bool look(bool discontinuity);

  // Of the picture that was looked at last, by marker.
  std::span<const Vector> place_px() const { return place_; }  ///< of a lost one: where its neighbours say it is
  std::span<const Vector> displacement_px() const { return displacement_; }
  std::span<const float> variance_px2() const { return errors_.variance_px2(); }
  std::span<const Centre> centres() const { return centres_; }
  std::span<const std::uint8_t> valid() const { return valid_; }
  bool following() const { return following_; }  ///< the markers are known from one picture to the next
  bool torn() const { return torn_; }

  /// Returns whether as many columns and rows were seen as the sensor has.
  bool latticesFit() const;

  const Reference& reference() const { return reference_; }
  std::span<const Layer> layers() const { return layers_; }
  std::span<const Vector> nominal_px() const { return nominal_; }  ///< places by the sensor's description
  float spacing_px() const { return spacing_px_; }

  /// Returns a layer's elements of what is given by marker.
  template <typename T>
  static std::span<const T> ofLayer(std::span<const T> all, const Layer& layer) {
    return all.subspan(static_cast<std::size_t>(layer.lattice.first), static_cast<std::size_t>(layer.lattice.count()));
  }

 private:
  /// Least amplitude of a marker that is believed, relative to rest.
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
  bool seeksAll_ = false;       ///< and learns cross-talk and each marker's own shape

  // Per marker.
  std::vector<Vector> place_, previous_, velocity_;
  std::vector<Vector> displacement_, increment_;
  std::vector<std::uint8_t> valid_, wasValid_, stepped_;  ///< stepped: valid now and in the picture before
  std::vector<std::uint8_t> mixed_, attempts_;
  std::vector<Vector> slope_;              ///< of the surroundings' brightness [levels / px]
  std::vector<std::uint8_t> slopeFrames_;  ///< that it is the mean of; 0: of this picture alone
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
