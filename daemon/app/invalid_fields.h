// Explains to an operator why fields have no forces, and which key of the configuration decides.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/options.h"
#include "daemon/track/tracker.h"

#include <string>

namespace tractiond {

/// Bound to the publishing thread.
class InvalidFields {
 public:
  /// Copies what it needs of the options by which the fields were computed.
  InvalidFields(const track::TrackOptions& track, const solve::SolveOptions& solve)
      : minValidFraction_(track.minValidFraction)
      , solve_(solve) {}

  /// Notes a field that is not valid, in place of the one before; it need not outlive the call. Allocates nothing.
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
