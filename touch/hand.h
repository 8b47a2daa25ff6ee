// Joins several fingers to one hand: frames that were captured together, and the wrench of all fingers in one frame.
//
// Matching. Half the shortest interval between two frames of a finger is the tolerance.
//   1. A set is one frame of each finger. The times of capture of all of them agree with that of the first finger's
//      frame within the tolerance, to which the stated errors of both times are added. So fingers whose cameras run
//      freely, at the same rate, have sets as well.
//   2. Of the frames that wait, the set is taken whose times agree best. Its frames, and those before them, are used
//   up:
//      none is matched twice, and sets come in the order of time.
//   3. Interval: the median of the last ones, each divided by the increase of the frame's number, so that lost frames
//      count for nothing.
//   4. A finger without a frame makes the grasp invalid, and is named. A grasp is never that of some of the fingers.
//
// Wrench. With the pose (R, p) of a gel in the hand, force and moment about the hand's origin are A w, and their
// covariance A C A^T, where A = [R 0; [p]x R, R]. Noise of two fingers is independent. Systematic errors are not where
// fingers have their numbers of one gel file: for errors a, b with any correlation, cov(a + b) <= 2 (cov(a) + cov(b)),
// and so on, since cov(a - b) >= 0. The right side is what is stated.
#pragma once

#include "touch/field.h"
#include "touch/intervals.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace touch {

/// From a gel's frame to the hand's.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
};

/// Force and moment about an origin, x y z each [N, N m], with the two parts of their covariance.
struct Wrench {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  Vector6 value = Vector6::Zero();
  Matrix6 noise = Matrix6::Zero(), systematic = Matrix6::Zero();
};

using traction::CaptureBound, traction::FingerState;

/// What a field of one finger says.
struct FingerFrame {
  traction::Header header;  ///< all fingers have one clock
  bool valid = false;
  Wrench wrench{};  ///< of all that acts on the gel, gel frame
};

struct Grasp {
  struct Finger {
    FingerState state = FingerState::kMissing;
    FingerFrame frame;  ///< the wrench is in the hand's frame, and 0 unless the state is kMatched
  };
  bool valid = false;  ///< all fingers are matched
  Wrench wrench{};     ///< hand's frame; 0 unless valid
  /// Interval that contains the times of capture of all fingers, with their errors; 0 if there is no set.
  std::int64_t earliest_ns = 0, latest_ns = 0;
  std::vector<Finger> fingers;
};

/// Thread-bound.
class Hand {
 public:
  /// Limits of silence_ns().
  static constexpr double kLeastSilence_ns = 1e8, kMostSilence_ns = 5e8;
  /// How long a finger is ambiguous after it was seen to be.
  static constexpr std::int64_t kAmbiguity_ns = 1'000'000'000;

  /// \param poses of the fingers' gels
  explicit Hand(const std::vector<Pose>& poses);

  // The grasps that these return are valid until the next call. `now_ns`: any clock, the same in all calls.

  /// Takes a frame of a finger. Returns the grasp, if the frame completes a set; else null.
  const Grasp* take(std::size_t finger, const FingerFrame& frame, std::int64_t now_ns);
  /// Returns an invalid grasp, which says of each finger what is known of it.
  const Grasp& wait(std::int64_t now_ns);
  /// Returns the time without a frame after which a finger is missing, which the slowest one decides.
  std::int64_t silence_ns() const;

 private:
  struct Track {
    Wrench::Matrix6 toHand;
    std::vector<FingerFrame> waiting;  ///< not matched yet, at most kWaiting; oldest first
    Intervals intervals_ns;
    FingerFrame last;           ///< whatever it is
    Id bootBefore{};            ///< that from which the boot of `last` differs
    std::int64_t heard_ns = 0;  ///< when it arrived
    std::int64_t ambiguousUntil_ns = 0;
    bool isHeard = false;
  };
  static constexpr std::size_t kWaiting = 8;

  bool isAmbiguous(std::size_t finger, const FingerFrame& frame, std::int64_t now_ns);
  static void follow(Track& track, const FingerFrame& frame);
  /// Returns the places of a set in each `waiting`; empty if there is none.
  std::vector<std::size_t> findSet() const;
  void join(const std::vector<std::size_t>& set);

  std::vector<Track> tracks_;
  Grasp grasp_;
};

}  // namespace touch
