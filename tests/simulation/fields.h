// The laws of published fields.
#pragma once

#include "daemon/records/traction_field.h"
#include "tests/simulation/camera.h"
#include "tests/simulation/zeros.h"

namespace tractiond::simulation {

/// Identifies the picture that a frame shows.
struct Truth {
  std::uint64_t number = 0, taken = 0;
};

class Fields {
 public:
  /// All references must outlive it.
  Fields(const Zeros& zeros, const Starvation& starvation, Journal& journal);

  /// Starts anew, as a daemon begins to publish.
  void begin();
  void check(const TractionField& field, const Truth& truth);

  /// Notes that fields may be missing until then.
  void disturb(std::int64_t until_ns) { disturbedUntil_ns_ = std::max(disturbedUntil_ns_, until_ns); }
  /// Returns whether nothing has been in the way of fields for some seconds.
  bool isCalm() const;
  /// Law: fields are published again after the last disturbance. Throws Broken.
  void checkFlow() const;

 private:
  void checkAge(const FrameInfo& info) const;
  void checkOrder(const TractionField& field);
  void checkGap(const TractionField& field, const Truth& truth) const;
  void checkAge(const Truth& truth) const;
  void checkZero(const Id& zero) const;

  const Zeros& zeros_;
  const Starvation& starvation_;
  Journal& journal_;
  std::int64_t disturbedUntil_ns_, published_ns_ = 0;
  // Of the last field in this life.
  Truth lastTruth_;
  FrameInfo last_;
};

}  // namespace tractiond::simulation
