// Takes the rest pose: averages the markers over N frames if they and their light keep still.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/track/centre.h"
#include "daemon/track/lattice.h"

#include <span>
#include <vector>

namespace tractiond::track {

/// State of the last zero.
enum class ZeroState {
  kNone,         ///< no zero was requested, or the request was cancelled
  kRequested,    ///< requested, not begun yet
  kTaking,       ///< frames are being averaged for a requested zero
  kTakingFirst,  ///< frames are being averaged for the automatic first zero
  kTaken,        ///< done: Tracker::takeRestPose() returns it; it may still be rejected
  kMoving,       ///< refused: markers moved more than their noise while the frames were taken
  kTooFew,       ///< refused: too few markers were seen
  kTorn,         ///< refused: more than every second picture was torn
  kUnsteady,     ///< refused: brightness or contrast of the markers had a trend
};

/// Returns whether the state is one of those that say "refused".
inline bool isRefusal(ZeroState state) {
  return state >= ZeroState::kMoving;
}

/// Returns why a zero is refused, as a sentence without a full stop, for log and client; a literal, which lives as long
/// as the program. Of other states: empty.
const char* describe(ZeroState state);

/// Fits a straight line to a quantity of the frames. Thread-bound.
class Trend {
 public:
  void add(double value);
  /// Returns by which share of the mean the line rises over the frames added so far; 0 if that may be scatter. There
  /// must be at least two.
  double share() const;

 private:
  int count_ = 0;
  double sum_ = 0.0, square_ = 0.0, product_ = 0.0;  ///< product: with the frame's number, from 0
};

/// Thread-bound. Allocates only in the constructor.
class ZeroTaker {
 public:
  /// \param markers number of markers of all layers
  /// \param frames number N of frames to average, at least 2 (less counts as 2)
  /// \param minValidFraction share of the markers that must be valid in each frame, else add() returns kTooFew
  ZeroTaker(int markers, int frames, double minValidFraction);

  /// Forgets the frames added so far. Must be called before the first add() after a result other than kTaking.
  void start();

  /// Adds one frame. Returns kTaking until N were seen, then kTaken; or, as soon as it is known, kTooFew (this frame
  /// has too few markers, and is not added), or kMoving or kUnsteady from the tenth frame on, or the N-th if N is
  /// smaller: the next try can then begin with the first still frame. Arrays are by marker of all layers.
  ZeroState add(std::span<const Vector> place_px, std::span<const Centre> centres, std::span<const std::uint8_t> valid);

  /// Returns the number of frames since start(); after kMoving, of those before the markers moved.
  int stillFrames() const { return seen_ - (hasMoved_ ? 1 : 0); }
  /// Returns the number of frames since start().
  int frames() const { return seen_; }
  /// Returns the trend of the markers' mean brightness at the rim, and of their mean contrast, since start().
  const Trend& brightness() const { return brightness_; }
  const Trend& contrast() const { return contrast_; }

  // Valid after kTaken.

  /// Fills in position, amplitude, presence and oddity of a layer's markers. The pose must be sized, hold the shot
  /// noise, and hold earlier positions and amplitudes: a marker that was not seen or has dust on it becomes absent, and
  /// its earlier position is moved as its neighbours are; one that was not seen keeps its amplitude.
  void finish(const Lattice& lattice, RestPose& pose);
  float noise() const;  ///< Returns the standard deviation of a pixel [levels], at least 0.3: that of rounding.
  float light() const;  ///< Returns the mean brightness at the markers' rims [levels].

 private:
  struct Sums {
    Vector origin;        ///< the first place [px]
    Vector sum;           ///< of the later places, relative to the origin and to the motion of the whole picture [px]
    float square = 0.0F;  ///< [px^2]
    float amplitude = 0.0F;
    float variance = 0.0F;  ///< for unit noise
    float level = 0.0F;     ///< of light at the rim
    float misfit = 0.0F;    ///< [levels^2]
    int count = 0;

    float spread2() const;  ///< sample variance of a coordinate [px^2]
  };

  bool moved();

  int frames_;
  double minValidFraction_;
  int seen_ = 0;
  bool hasMoved_ = false;
  Trend brightness_, contrast_;
  std::vector<Sums> sums_;
  std::vector<float> ratios_;
  std::vector<Vector> place_, field_;
  Vector common_;  ///< sum of the whole picture's motion
  float commonSquare_ = 0.0F;
  double misfit_ = 0.0;  ///< sum over frames of the mean misfit [levels^2]
  float noise_ = 0.0F;
};

}  // namespace tractiond::track
