// Explains to an operator why fields have no forces, and which key of the configuration decides.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/options.h"
#include "daemon/track/tracker.h"

#include <string>

namespace tractiond {

/// Thread-bound.
class InvalidFields {
 public:
  /// Copies what it needs of the options by which the fields were computed.
  InvalidFields(const track::TrackOptions& track, const solve::SolveOptions& solve)
      : minValidFraction_(track.minValidFraction)
      , solve_(solve) {}

  /// Adds a field that is not valid, which need not outlive the call. Allocates nothing.
  void add(const TractionField& field);

  /// Returns the explanation of the newest field that was added since the last call, a sentence without a full stop;
  /// empty if none was. Allocates.
  std::string take();

 private:
  double minValidFraction_;
  solve::SolveOptions solve_;
  bool isNew_ = false;
  unsigned flags_ = 0;
  int found_ = 0, markers_ = 0, isolatedGaps_ = 0;
};

}  // namespace tractiond
