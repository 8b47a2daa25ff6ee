// A double of the tracker, which sees what pictures show. Its zeros are those of track::Tracker: a first one is in
// force at once and waits for a verdict, a requested one is a proposal.
#pragma once

#include "daemon/track/rest_pose.h"
#include "daemon/track/zero.h"
#include "tests/simulation/camera.h"

#include <optional>
#include <vector>

namespace tractiond::simulation {

inline constexpr int kZeroFrames = 10;

class Tracker {
 public:
  /// The gel must outlive it.
  explicit Tracker(const Gel& gel)
      : gel_(gel) {}

  /// Writes the markers of a picture.
  /// \return false: there is no zero in force for which setGelFits() was called
  bool track(const Picture& picture, MarkerField& field);

  void request() { state_ = track::ZeroState::kRequested; }
  bool cancel();
  track::ZeroState state() const { return state_; }
  bool takeRestPose(RestPose& pose);
  /// Returns what pressed while the zero was taken that takeRestPose() has returned last.
  double finishedPress_N() const { return finishedPress_N_; }

  void restore(const RestPose& pose);
  /// Puts the zero in force with the next picture.
  void putInForce(const RestPose& pose);
  void setGelFits(const Id& zero);

 private:
  void begin(bool requested);
  double placeOf(std::size_t coordinate, const Picture& picture) const;
  void take(const Picture& picture);
  void write(const Picture& picture, MarkerField& field) const;

  const Gel& gel_;
  track::ZeroState state_ = track::ZeroState::kNone;
  RestPose force_;
  bool hasForce_ = false;
  Id verdict_{};  ///< the zero of the last putInForce() or setGelFits()
  std::optional<RestPose> decision_, finished_;

  // The zero that is being taken.
  bool taking_ = false, takingRequested_ = false;
  int seen_ = 0;
  double first_N_ = -1.0;  ///< force of its first picture
  double finishedPress_N_ = 0.0;
  std::vector<double> sum_;
};

}  // namespace tractiond::simulation
