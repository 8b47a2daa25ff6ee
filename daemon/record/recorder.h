// Records the frames that are tracked and their fields, so that the same fields can be computed again:
// docs/recordings.md.
#pragma once

#include "base/clock.h"
#include "base/error.h"
#include "base/link.h"
#include "daemon/publish/newest_messages.h"
#include "daemon/publish/wire.h"
#include "daemon/publish/wire_recording.h"
#include "daemon/records/field_gaps.h"
#include "daemon/records/traction_field.h"
#include "recording/writer.h"

#include <tl/expected.hpp>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace tractiond {

struct RecordOptions {
  std::string file;      ///< must not exist yet; empty: nothing is recorded
  double rate_Hz = 0.0;  ///< upper limit of recorded pictures; 0: all of them
  bool packed = false;   ///< true: pictures are compressed
};

/// Inputs besides frames and fields, for the recorder's thread.
struct RecordLinks {
  const publish::NewestMessages& published;  ///< the description is written when it changes; outlives the recorder
  std::int64_t (*monotonicClock)() = monotonicNow;  ///< [ns]
  std::int64_t (*realClock)() = realNow;            ///< [ns]; read once, when the recorder is made
};

/// Bound to its thread, except where stated. If the disk is too slow, pictures are lost, and fields if too many wait;
/// account() counts both, and the first loss of pictures is logged. The first error of the file, as when the disk is
/// full, ends the recording, which is logged. No other thread waits.
class Recorder {
 public:
  /// Creates the file. EX_CANTCREAT, also if the file exists.
  /// \param identity part of every message; copied
  /// \param markers, nodes number of markers and nodes of all frames and fields
  static tl::expected<std::unique_ptr<Recorder>, Error>
  open(const RecordOptions& options, const publish::Identity& identity, int markers, int nodes, RecordLinks links);
  /// Removes a file that has neither a picture nor a field. Does not call close(), without which a file has no end.
  ~Recorder();

  /// Records, with the next turn(), what is needed to compute the fields again. Must be called once, before the first
  /// frame. Encodes `beginning` within the call. Any thread.
  void begin(const publish::Beginning& beginning);

  /// Queues a copy of a frame, unless RecordOptions::rate_Hz leaves it out or the queue is full; the inputs are then
  /// recorded with the next one. Must be called for each tracked frame. For the tracking thread, after the frame was
  /// tracked. Allocates in the first frames only.
  /// \param places MarkerField::places
  void takeFrame(const Frame& frame, const TrackerInputs& inputs, const Id& places);

  /// Queues a copy of a field; drops it if the queue is full. For the publishing thread. Allocates nothing.
  void takeField(const TractionField& field);

  /// Sleeps until a frame is queued, at most `timeout` and at most 20 ms; a field does not end the sleep. Then writes
  /// what is queued, and waits for the disk. An error is logged, and returned by close().
  void turn(std::chrono::milliseconds timeout);

  /// Writes the rest and the end of the file. Must be called once, when no thread uses this any more; afterwards only
  /// account() may be called. Returns the first error of the recording, if there was one: what was written before it is
  /// in the file.
  tl::expected<void, Error> close();

  /// Describes for an operator, in a line, how many pictures and fields are in the file (what waits is not), and how
  /// many found the queue full. What an error of the file lost is not counted.
  std::string account() const;

 private:
  /// Frames that may wait for a slow disk: a second at 60 frames/s.
  static constexpr std::size_t kRooms = 64;

  Recorder(RecordOptions options, const publish::Identity& identity, int markers, int nodes, RecordLinks links,
           recording::NewFile file);
  void drain();
  void drainFields();
  void write(const std::string& kind, const char* type, std::uint64_t sequence, const FrameInfo* frame,
             std::string_view bytes);
  void watch(const tl::expected<void, Error>& done);
  std::uint64_t logNow() const;
  /// Messages of that kind which are in the file.
  std::uint64_t written(const std::string& kind) const;

  RecordOptions options_;
  RecordLinks links_;
  std::string sensor_;
  std::int64_t epoch_ns_;
  recording::NewFile file_;
  recording::Writer writer_;
  std::optional<Error> error_;

  std::mutex mutex_;
  std::string beginning_;  ///< guarded by it; until it is written

  // The tracking thread's.
  Counter unused_;  ///< a link that waits evicts nothing
  Counter picturesLost_, fieldsLost_;
  Link<publish::TrackedFrame, kRooms> frames_;
  std::uint64_t number_ = 0;
  TrackerInputs pending_;  ///< of frames that were left out
  std::int64_t due_ns_ = 0;

  Link<TractionField, kRooms> fields_;  ///< the publishing thread's

  publish::Wire wire_;
  publish::PictureMessage picture_;
  std::map<std::string, std::uint16_t> channels_;
  std::uint64_t fieldSequence_ = 0;
  FieldGaps gaps_;  ///< by fields that were lost, too
  bool toldLost_ = false;
  std::string described_, message_;
};

}  // namespace tractiond
