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

/// Shared by followers of the same pictures: the picture, and memory that has no meaning between two calls of
/// findMarkers().
struct FollowerWorkspace {
  /// Allocates memory for pictures of the size of the sensor's camera, and for its markers. The sensor must be
  /// trackable(); it need not outlive the object.
  explicit FollowerWorkspace(const sensor::Sensor& sensor);

  Planes planes;  ///< of this frame
  Detector detector;
  Labeller labeller;
  PointGrid grid;
};

/// Follows the markers of a reference from picture to picture. Thread-bound. A copy continues independently from the
/// original's state; assigning a follower of the same sensor allocates only for the markers' appearance. findMarkers()
/// allocates only where it learns the appearance: in the first picture in which markers are found, and after
/// learnAnew().
class Follower {
 public:
  /// One layer of markers.
  struct Layer {
    std::size_t index;  ///< of the layer in the sensor, and of its planes
    Lattice lattice;    ///< indices of its markers
    int rank;           ///< index in RestPose::crossTalk
    bool nearer;        ///< to the camera than the other layer: its markers hide the other's
    Trust trust;
    double described_px;                ///< radius of its markers by the sensor's description
    Plane plane = {}, otherPlane = {};  ///< of this picture
    std::vector<Spot> spots = {};       ///< found when the whole picture was searched last
    LatticeSeen seen = {};              ///< when the markers were labelled last
    MarkerTemplate rough = {};          ///< for spots whose blur is not known yet
    float roughScale = 0.0F;            ///< scale of the plane that `rough` is for; 0: none yet
  };

  /// The sensor must be trackable(). `workspace` must outlive the follower and its copies.
  /// \param zeroFrames number of frames that a rest pose averages
  Follower(const sensor::Sensor& sensor, int zeroFrames, FollowerWorkspace& workspace);

  /// Makes `pose` the reference and recomputes the displacements from it; the markers' places are kept. Copies all of
  /// the pose but its cross-talk; the other results stay until the next findMarkers(). The pose must have as many
  /// markers as the sensor.
  void adopt(const RestPose& pose);

  /// Copies the cross-talk of the layers from a pose that was taken in an earlier run, and nothing else of it.
  void setCrossTalk(const RestPose& pose);

  /// Swaps the appearance of the markers with `other`, by which the appearance that one follower has learned is handed
  /// to another without allocating. Forgets the learned shapes; the next findMarkers() learns them again.
  /// \param other of a follower of the same sensor; may be empty if this follower is not used until it is assigned
  void exchangeAppearance(Appearance& other);

  /// Makes findMarkers() learn the appearance, with cross-talk and each marker's own shape, from the next picture in
  /// which markers are found. With a zero, from now on also seeks the markers that it lacks.
  void learnAnew();

  /// Learns from the markers found in the last picture how much they differ from discs. Spots that differ more are
  /// rejected later (CentreErrors::learnShape()).
  void learnShape() { errors_.learnShape(centres_, valid_); }

  /// Finds the markers in the workspace's picture, which must have been read. Searches near the places of the picture
  /// before. Searches the whole picture instead if following() is false, or if fewer than 60 % of the reference's
  /// markers are found near their places; after a search that found few it waits three pictures before the next.
  /// Returns whether the markers were labelled anew.
  /// \param discontinuity true: the picture may be far from the one before, and the whole of it is searched at once
  bool findMarkers(bool discontinuity);

  // Results of the last findMarkers(), by marker in the order of sensor::markerPositions. The spans stay in place. Only
  // place_px() and valid() have a meaning for markers that are not valid.

  /// Returns the places [px]. For a lost marker it is the place that its neighbours suggest; before the first labelling
  /// all are nominal_px().
  std::span<const Vector> place_px() const { return place_; }
  /// Returns the displacements from the reference's places [px]; before there is a zero, from the first labelled
  /// picture.
  std::span<const Vector> displacement_px() const { return displacement_; }
  /// Returns the variance of each of a displacement's two coordinates [px^2].
  std::span<const float> variance_px2() const { return errors_.variance_px2(); }
  /// Returns the result of the fit of each marker's template.
  std::span<const Centre> centres() const { return centres_; }
  /// Returns 1 for each marker that was found, else 0.
  std::span<const std::uint8_t> valid() const { return valid_; }
  /// Returns whether enough markers were found for the next picture to be followed from this one: a quarter of those
  /// that the reference has.
  bool following() const { return following_; }
  /// Returns whether the picture is torn: some rows are shifted or belong to another frame. False after a gap.
  bool torn() const { return torn_; }

  /// Returns whether each layer shows as many columns and rows as the sensor has, when the markers were labelled last
  /// or in this picture. A layer that was never labelled counts as fitting.
  bool latticesFit() const;

  const Reference& reference() const { return reference_; }  ///< Returns the reference that is followed.
  std::span<const Layer> layers() const { return layers_; }  ///< Returns the layers in the order of the sensor's.
  /// Returns the places [px] of the untouched markers by the sensor's description.
  std::span<const Vector> nominal_px() const { return nominal_; }
  /// Returns the smallest distance between neighbours of a layer [px], by the description.
  float spacing_px() const { return spacing_px_; }

  /// Returns the elements of a layer.
  /// \param all one element for each marker, in the order of sensor::markerPositions
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
  bool recoverOne(const Layer& layer, int marker);
  bool searchAround(const Layer& layer, int marker, Vector place);
  bool fitAt(const Layer& layer, int marker, Vector place);
  bool adoptDeformed(const Layer& layer, int marker, float mostMisfit);
  Guess guessAt(int marker, Vector place) const;
  void noteSlope(const Layer& layer, int marker, Centre& centre);
  void learnSlopes();
  bool accept(int marker, const Centre& centre, Vector expected);
  void markOverlaps();
  void guessLost();

  const MarkerTemplate& roughOf(Layer& layer);
  void learnSize(const Layer& layer, std::span<const std::uint8_t> seen);
  void learnAppearance(std::span<const std::uint8_t> seen);
  void placeUnlabelled();
  void assumeRest();

  Appearance::Layer& appearanceOf(const Layer& layer) { return reference_.appearance.layers[layer.index]; }
  const Appearance::Layer& appearanceOf(const Layer& layer) const { return reference_.appearance.layers[layer.index]; }
  void fit(const Layer& layer, std::span<const Guess> guesses, std::span<Centre> centres) const;
  void fitGuesses();
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
