// Decides whether a buffer is a new and whole picture. The driver's "success" does not state that: a camera driver can
// hand an old, recycled buffer out again. See docs/decisions/0003-frame-gate.md.
#pragma once

#include "daemon/capture/camera_info.h"
#include "daemon/records/ledger.h"

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace tractiond::capture {

/// What the driver reports of one buffer.
struct Arrival {
  bool complete = false;       ///< the driver's status: all of the picture has arrived
  PictureShape shape;          ///< as the driver reports it for this buffer
  std::uint64_t id = 0;        ///< the camera's frame counter
  std::int64_t device_ns = 0;  ///< the camera's time stamp; any value
  std::int64_t host_ns = 0;    ///< CLOCK_MONOTONIC when the buffer was taken from the driver; never falls
  std::int64_t raw_ns = 0;     ///< CLOCK_MONOTONIC_RAW at the same moment; 0: the driver has one clock
  std::uint64_t content = 0;   ///< hash of a sample of the picture
  /// Hash of all of a picture whose `content` is that of the buffer before; 0: it differs, or may repeat.
  std::uint64_t whole = 0;
  std::uint64_t thrown = 0;  ///< packets that the driver has discarded since the buffer before, in frames' worth
  bool duplicated = false;   ///< since the buffer before, packets arrived twice within one frame
};

/// kNew: a new and whole picture, the only one that is used. kIncomplete, kWrongSize, kWrongFormat: not whole, or not
/// of the agreed shape, whatever its id. kStale: it was seen before, is older than the last new one, or has no id.
/// kImplausible: its id or time does not continue the camera's. kRepeated: they do, but the picture equals the four
/// before it to the byte, which noise does not: a frozen source.
enum class Verdict { kNew, kIncomplete, kWrongSize, kWrongFormat, kStale, kImplausible, kRepeated };

struct Judgement {
  Verdict verdict = Verdict::kIncomplete;
  // The rest is valid for kNew and kRepeated only.
  std::uint64_t frameNumber = 0;  ///< from 1; jumps where ids show that frames were rejected or never arrived
  std::uint64_t missing = 0;      ///< frames since the last new one that never arrived, or only at the driver
  bool discontinuity = false;     ///< the frame number jumped, or the ids or the camera's clock start afresh
  bool newTimeline = false;       ///< what was learnt of the camera's clock no longer holds
  bool timed = false;             ///< the camera's time stamp is usable; false: it is absent, or its clock jumped
  std::uint64_t step = 1;         ///< increase of the id since the last new one; 1 where the ids start afresh
  bool doubted = false;           ///< packets arrived twice, not all of which need be the camera's: kDoubtedOrigin
};

/// Thread-bound. Allocates only in the constructor.
class FrameGate {
 public:
  struct Options {
    /// USB3 Vision counts from 0. GigE Vision never sends 0: neither its 16-bit counter, which wraps from 65535 to 1,
    /// nor its 64-bit one.
    bool zeroIsAnId = false;
    /// Number of whole pictures that are remembered: more than the driver has buffers, each of which may come again.
    std::size_t memory = 256;
  };

  /// \param agreed shape that a picture must have, else it is kWrongSize or kWrongFormat
  /// \param options `memory` at least 1
  FrameGate(const PictureShape& agreed, const Options& options)
      : agreed_(agreed)
      , options_(options)
      , history_(options.memory) {}

  /// Judges the next buffer; must be called for every buffer in the order of arrival. Of the whole pictures of the
  /// agreed shape that were not seen before, the first is new, and so is each whose id and time continue the last new
  /// one. Others are held back as kStale or kImplausible, until three in a row continue each other and none that
  /// continues the last new one has come meanwhile: the third is new, on a new timeline. Of new ones that equal each
  /// other (Arrival::whole), the fifth and all later ones are kRepeated.
  Judgement judge(const Arrival& arrival);

  /// Notes that the camera was opened again: the next whole picture of the agreed shape that was not seen before is new
  /// and begins a new timeline.
  void restart() {
    reopened_ = true;
    heldBack_ = 0;
  }

 private:
  /// A sequence of frames that agree with each other.
  struct Track {
    std::uint64_t id = 0;
    std::int64_t device_ns = 0, host_ns = 0;
    std::int64_t offset_ns = 0;  ///< smallest host - device seen, allowed to rise slowly
    std::int64_t period_ns = 0;  ///< shortest seen, allowed to rise slowly; 0: not known
    std::int64_t pace_ns = 0;    ///< mean time of the host between two ids; 0: not known
    int paces = 0;               ///< number of times in the mean
    int length = 1;
    int distrust = 0;  ///< frames to come before the camera's clock is believed again
  };
  enum class Fit { kNone, kByBothClocks, kByTheHosts };
  struct Seen {
    std::uint64_t id = 0, content = 0;
    std::int64_t device_ns = 0;
  };

  static Track begin(const Arrival& arrival);
  static void extend(Track& track, const Arrival& arrival, Fit fit);
  static Fit follows(const Track& track, const Arrival& arrival);
  static bool isNext(const Track& track, const Arrival& arrival);
  static std::int64_t frameTime(const Track& track);
  static std::int64_t longestMean(const Track& track);
  static std::int64_t elapsed(const Track& from, const Track& to);
  Judgement judgeOrder(const Arrival& arrival);
  Judgement acceptNext(const Arrival& arrival, Fit fit);
  Judgement acceptCandidate(const Arrival& arrival);
  Judgement accept(const Track& next, std::uint64_t step, bool newTimeline, bool jumped);
  std::uint64_t thrownBefore(const Track& next, std::uint64_t step, bool newTimeline) const;
  void markArrived(const Arrival& arrival);
  bool seenBefore(const Arrival& arrival) const;

  PictureShape agreed_;
  Options options_;
  std::optional<Track> current_;    ///< ends with the last frame that was used
  std::optional<Track> candidate_;  ///< frames held back that may become the current track
  std::int64_t heard_ns_ = 0;       ///< host's clock at the last frame of the current track, whole or not
  int heldBack_ = 0;                ///< frames of other tracks since then
  bool reopened_ = false;
  std::uint64_t frameNumber_ = 0;
  std::bitset<32768> arrived_;  ///< [d]: something with the id d after the last new frame arrived, and was not used
  std::uint64_t arrivedUnnamed_ = 0;  ///< incomplete buffers that kept an older id: the packet with theirs was lost
  std::uint64_t thrown_ = 0;          ///< by the driver since the last new frame
  bool duplicated_ = false;           ///< likewise
  std::vector<Seen> history_;         ///< the last whole pictures, a ring
  std::size_t historyCount_ = 0;
  std::uint64_t whole_ = 0;  ///< of the last picture in order; 0: it differed from the one before
  int equal_ = 0;            ///< pictures in order that equal each other, with the last one
  bool isRepeated_ = false;  ///< the last picture in order was
};

/// Counts one judgement in the ledger: as received, and by its verdict; for one in order also Judgement::missing, for a
/// new one `doubted`.
void count(const Judgement& judgement, Ledger& ledger);

}  // namespace tractiond::capture
