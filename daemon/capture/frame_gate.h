// Is this buffer a new and whole picture? The driver's "success" does not say so: a camera driver can hand an old,
// recycled buffer out again. See docs/decisions/0003-frame-gate.md.
#pragma once

#include "daemon/capture/camera_info.h"
#include "daemon/records/ledger.h"

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace tractiond::capture {

/// One buffer, as the driver describes it.
struct Arrival {
  bool complete = false;  ///< the driver's status
  PictureShape shape;
  std::uint64_t id = 0;        ///< the camera's frame counter
  std::int64_t device_ns = 0;  ///< the camera's clock
  std::int64_t host_ns = 0;    ///< CLOCK_MONOTONIC when the buffer was taken from the driver; never falls
  std::int64_t raw_ns = 0;     ///< CLOCK_MONOTONIC_RAW at the same moment; 0: the driver has one clock
  std::uint64_t content = 0;   ///< a hash of what is in the picture
  std::uint64_t thrown = 0;    ///< packets that the driver dropped since the last buffer, in frames
  double late = 0.0;           ///< likewise, packets of frames that were no longer awaited, without a resend request
  double twice = 0.0;          ///< likewise, duplicate packets of a frame, without a resend request
  bool repeated = false;       ///< duplicates or late packets that may be answers to our own resend requests
};

enum class Verdict { kNew, kIncomplete, kWrongSize, kWrongFormat, kStale, kImplausible };

struct Judgement {
  Verdict verdict = Verdict::kIncomplete;
  bool outnumbered = false;  ///< recently more packets or pictures came in the camera's name than it sends
  // The rest is valid for kNew alone.
  std::uint64_t frameNumber = 0;  ///< from 1 on; jumps if frames were not used or never arrived, by their ids
  std::uint64_t missing = 0;      ///< frames since the last new one that did not arrive, or not beyond the driver
  bool discontinuity = false;     ///< the frame number jumped, or the ids or the camera's clock began anew
  bool newTimeline = false;       ///< what was learnt about the camera's clock is no longer valid
  bool timed = false;             ///< the camera's clock is reliable; false: it is absent, coarse or wrong
  std::uint64_t step = 1;         ///< of the ids since the last new one; 1 if they began anew
  bool doubted = false;  ///< outnumbered, or it came before the camera can have sent it, or parts of it came twice
};

/// Thread-bound. Allocates nothing.
class FrameGate {
 public:
  struct Options {
    /// USB3 Vision counts from 0. GigE Vision never sends 0: neither its 16-bit counter, which wraps from 65535 to 1,
    /// nor its 64-bit one.
    bool zeroIsAnId = false;
    /// A camera clock that gains more than this on the host's has stepped: a picture cannot arrive before it is taken.
    /// Above the jitter of a camera that stamps by its own operating system, and above a change of exposure time.
    std::int64_t ahead_ns = 50'000'000;
    /// One that falls behind by more has stepped as well, or the host slept. Above any delay of a working host.
    std::int64_t behind_ns = 1'000'000'000;
    /// How late a camera may stamp a frame that stamps by its own operating system: ids may be ahead of the time by
    /// that.
    std::int64_t stampJitter_ns = 8'000'000;
    /// Period of the fastest camera: bounds a gap of ids as long as the frame period is unknown.
    std::int64_t shortestPeriod_ns = 100'000;
    /// For so long pictures are doubted after more came in the camera's name than it sends.
    std::int64_t doubt_ns = 2'000'000'000;
    /// Number of complete pictures that are remembered: more than the driver's buffers, each of which may be delivered
    /// again.
    std::size_t memory = 256;
  };

  FrameGate(const PictureShape& agreed, const Options& options)
      : agreed_(agreed)
      , options_(options)
      , history_(options.memory) {}

  Judgement judge(const Arrival& arrival);

  /// Must be called when the camera was opened again: the next complete new picture begins a new timeline.
  void restart() { reopened_ = true; }

 private:
  /// A sequence of frames that agree with each other.
  struct Track {
    std::uint64_t id = 0;
    std::int64_t device_ns = 0, host_ns = 0;
    std::int64_t offset_ns = 0;  ///< smallest host - device seen, allowed to rise slowly
    std::int64_t period_ns = 0;  ///< shortest seen, allowed to rise slowly; 0: not known
    std::int64_t pace_ns = 0;    ///< mean time of the host between two ids; 0: not known
    int length = 1;
    std::int64_t lag_ns = 0;  ///< mean of host - device above the smallest
    int timed = 0;            ///< frames that both clocks agreed on, up to a hundred
    int distrust = 0;         ///< frames to come before the camera's clock is believed again
  };
  enum class Fit { kNone, kByBothClocks, kByTheHosts };
  struct Seen {
    std::uint64_t id = 0, content = 0;
    std::int64_t device_ns = 0;
  };

  static Track begin(const Arrival& arrival);
  static void extend(Track& track, const Arrival& arrival, Fit fit);
  Fit follows(const Track& track, const Arrival& arrival) const;
  bool isNext(const Track& track, const Arrival& arrival) const;
  void countSurplus(std::int64_t host_ns);
  std::int64_t frameTime() const;
  std::uint64_t largestStep(std::int64_t period_ns, std::int64_t elapsed_ns) const;
  Judgement acceptNext(const Arrival& arrival, Fit fit);
  Judgement acceptCandidate(const Arrival& arrival);
  Judgement accept(const Track& next, std::uint64_t step, bool newTimeline, bool jumped);
  std::uint64_t thrownBefore(const Track& next, std::uint64_t step) const;
  void markArrived(const Arrival& arrival);
  void weigh(std::int64_t host_ns, std::uint64_t step);
  bool isEarly(const Arrival& arrival) const;
  bool seenBefore(const Arrival& arrival) const;

  PictureShape agreed_;
  Options options_;
  std::optional<Track> current_;    ///< ends with the last frame that was used
  std::optional<Track> candidate_;  ///< frames held back that may become the current track
  std::optional<Track> previous_;   ///< what the current track replaced
  std::int64_t heard_ns_ = 0;       ///< host's clock at the last frame of the current track, whole or not
  int heldBack_ = 0;                ///< frames of other tracks since then
  double surplus_ = 0.0;            ///< those that came while the current track went on; fades
  bool reopened_ = false;
  std::uint64_t frameNumber_ = 0;
  std::bitset<32768> arrived_;  ///< [d]: something with the id d after the last new frame arrived, and was not used
  std::uint64_t arrivedUnnamed_ = 0;  ///< incomplete buffers that kept an older id: the packet with theirs was lost
  std::uint64_t thrown_ = 0;          ///< by the driver since the last new frame
  double late_ = 0.0, twice_ = 0.0;   ///< likewise
  bool repeated_ = false;
  double repeatedLately_ = 0.0;     ///< frames
  double broken_ = 0.0;             ///< recent frames that were given up, whose packets may still come
  std::int64_t doubtUntil_ns_ = 0;  ///< host's clock
  std::int64_t provedAt_ns_ = 0;    ///< likewise: until then frames of a track that replaced another are doubted
  std::vector<Seen> history_;       ///< the last whole pictures, a ring
  std::size_t historyCount_ = 0;
};

/// Counts a judgement in the ledger.
void count(const Judgement& judgement, Ledger& ledger);

}  // namespace tractiond::capture
