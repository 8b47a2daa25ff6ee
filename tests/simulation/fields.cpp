#include "tests/simulation/fields.h"

#include <fmt/format.h>

namespace tractiond::simulation {

Fields::Fields(const Zeros& zeros, const Starvation& starvation, Journal& journal)
    : zeros_(zeros)
    , starvation_(starvation)
    , journal_(journal)
    , disturbedUntil_ns_(now()) {}

void Fields::begin() {
  lastTruth_ = {};
  last_ = {};
}

void Fields::check(const TractionField& field, const Truth& truth) {
  published_ns_ = now();
  checkAge(field.markers.info);
  checkZero(field.markers.zero);
  journal_.result.account.add(field);
  checkAge(truth);
  checkGap(field, truth);
  lastTruth_ = truth;
  checkOrder(field);
}

void Fields::checkAge(const FrameInfo& info) const {
  constexpr std::int64_t kOldest_ns = 400 * kMs;
  const std::int64_t age_ns = now() - info.times.received_ns;
  journal_.law(age_ns <= kOldest_ns + starvation_.since(info.times.received_ns), "no field older than its bound",
               [&] { return fmt::format("{} ms", age_ns / kMs); });
}

void Fields::checkZero(const Id& zero) const {
  const auto& inForce = zeros_.inForce();
  const std::int64_t since_ns = now() - zeros_.describedAt_ns();
  journal_.law(since_ns < kSecond + starvation_.since(zeros_.describedAt_ns()) || inForce == zero,
               "fields rest on the zero that is described",
               [&] { return fmt::format("{}, not {}", nameOf(zero), inForce ? nameOf(*inForce) : "none"); });
}

void Fields::checkAge(const Truth& truth) const {
  journal_.law(truth.number > lastTruth_.number, "no stale picture",
               [&] { return fmt::format("picture {} after {}", truth.number, lastTruth_.number); });
}

/// The camera took pictures in between.
void Fields::checkGap(const TractionField& field, const Truth& truth) const {
  if (lastTruth_.number == 0) return;
  const bool isFlagged = (field.flags & kDiscontinuity) != 0;
  journal_.law(truth.taken <= lastTruth_.taken + 1 || isFlagged, "a gap is flagged", [&] {
    return fmt::format("{} pictures before picture {}", truth.taken - lastTruth_.taken - 1, truth.number);
  });
}

void Fields::checkOrder(const TractionField& field) {
  const FrameInfo& info = field.markers.info;
  const bool follows = last_.frameNumber == 0 || info.frameNumber == last_.frameNumber + 1;
  journal_.law(follows || (field.flags & kDiscontinuity) != 0,
               "a field that does not follow the one before has its flag",
               [&] { return fmt::format("frame {} after {}", info.frameNumber, last_.frameNumber); });
  journal_.law(info.frameNumber > last_.frameNumber && info.times.received_ns >= last_.times.received_ns &&
                   info.times.captured_ns >= last_.times.captured_ns,
               "numbers and times rise", [&] {
                 return fmt::format("frame {} captured {} after {} captured {}", info.frameNumber,
                                    info.times.captured_ns, last_.frameNumber, last_.times.captured_ns);
               });
  last_ = info;
}

bool Fields::isCalm() const {
  constexpr std::int64_t kCalm_ns = 6 * kSecond;
  return now() - disturbedUntil_ns_ >= kCalm_ns;
}

void Fields::checkFlow() const {
  constexpr std::int64_t kFlows_ns = kSecond;
  if (!isCalm()) return;
  journal_.law(now() - published_ns_ <= kFlows_ns, "after faults end fields flow",
               fmt::format("the last field came {} ms ago, the last fault ended {} ms ago",
                           (now() - published_ns_) / kMs, (now() - disturbedUntil_ns_) / kMs));
}

}  // namespace tractiond::simulation
