#include "daemon/record/recorder.h"

#include "proto/traction/v1/descriptors.h"
#include "proto/traction/v1/endpoints.h"

#include <google/protobuf/message_lite.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

namespace tractiond {
namespace {

constexpr std::chrono::milliseconds kTurn{20};  ///< by this a chunk may be late
constexpr std::size_t kChunkBytes = std::size_t{16} << 20;

publish::TrackedFrame blankFrame(int markers) {
  publish::TrackedFrame blank;
  blank.inputs.zero.position_px.resize(2 * static_cast<std::size_t>(markers));
  blank.inputs.zero.amplitude.resize(static_cast<std::size_t>(markers));
  blank.inputs.zero.present.resize(static_cast<std::size_t>(markers));
  blank.inputs.zero.oddity.resize(static_cast<std::size_t>(markers));
  return blank;
}

}  // namespace

tl::expected<std::unique_ptr<Recorder>, Error> Recorder::open(const RecordOptions& options,
                                                              const publish::Identity& identity, int markers, int nodes,
                                                              RecordLinks links) {
  auto file = recording::NewFile::create(options.file);
  if (!file) return tl::unexpected(file.error());
  return std::unique_ptr<Recorder>(new Recorder(options, identity, markers, nodes, std::move(links), *std::move(file)));
}

Recorder::Recorder(RecordOptions options, const publish::Identity& identity, int markers, int nodes, RecordLinks links,
                   recording::NewFile file)
    : options_(std::move(options))
    , links_(std::move(links))
    , sensor_(identity.sensor)
    , epoch_ns_(links_.realClock() - links_.monotonicClock())
    , file_(std::move(file))
    , writer_(file_, {.chunkBytes = kChunkBytes, .library = "tractiond"})
    , frames_(WhenFull::kWait, unused_, blankFrame(markers))
    , pending_(blankFrame(markers).inputs)
    , fields_(WhenFull::kWait, unused_, blankField(markers, nodes))
    , wire_(identity)
    , picture_(identity) {}

/// Removes an empty recording.
Recorder::~Recorder() {
  std::error_code ignored;
  if (written("camera") + written("field") == 0) std::filesystem::remove(options_.file, ignored);
}

void Recorder::begin(const publish::Beginning& beginning) {
  const std::lock_guard lock(mutex_);
  beginning_ = publish::encode(beginning);
}

void Recorder::takeFrame(const Frame& frame, const TrackerInputs& inputs, const Id& places) {
  ++number_;
  if (inputs.any()) pending_.add(inputs);
  const std::int64_t now_ns = frame.info.times.received_ns;
  if (options_.rate_Hz > 0.0) {
    if (now_ns < due_ns_) return;
    const auto period_ns = static_cast<std::int64_t>(1e9 / options_.rate_Hz);
    due_ns_ = due_ns_ + period_ns > now_ns
                  ? due_ns_ + period_ns
                  : now_ns + period_ns;  // keeps a fixed pace, unless frames arrive more slowly
  }
  publish::TrackedFrame* const room = frames_.acquire();
  if (room == nullptr) return picturesLost_.add();
  room->copyFrom(frame);
  if (!room->fits) {
    room->makeRoom(frame.size);
    room->copyFrom(frame);
  }
  room->number = number_;
  room->places = places;
  room->inputs.clear();
  room->inputs.add(pending_);
  pending_.clear();
  frames_.push(room);
}

void Recorder::takeField(const TractionField& field) {
  TractionField* const room = fields_.acquire();
  if (room == nullptr) return fieldsLost_.add();
  *room = field;
  fields_.push(room);
}

void Recorder::turn(std::chrono::milliseconds timeout) {
  frames_.wait(std::min(timeout, kTurn));
  drain();
  if (!error_ && writer_.isDue(logNow())) watch(writer_.flush());
  if (!toldLost_ && !error_ && picturesLost_.get() > 0) {
    toldLost_ = true;
    spdlog::warn("warning: the disk, or this machine, is too slow for the recording: pictures are missing in {}",
                 options_.file);
  }
}

void Recorder::drain() {
  {
    const std::lock_guard lock(mutex_);
    if (!beginning_.empty()) write("beginning", "Beginning", 0, nullptr, beginning_);
    beginning_.clear();
  }
  while (publish::TrackedFrame* const one = frames_.take()) {
    if (!error_) write("camera", "Picture", one->number, &one->frame.info, picture_.encode(*one, options_.packed));
    frames_.release(one);
    drainFields();  // if pictures arrive faster than they are written, a field waits for at most one of them
  }
  if (auto description = links_.published.lastDescription(); description != described_) {
    described_ = std::move(description);
    write("description", "Description", 0, nullptr, described_);
  }
  drainFields();
}

void Recorder::drainFields() {
  while (const TractionField* const one = fields_.take()) {
    if (!error_) {
      const FrameInfo& frame = one->markers.info;
      const std::uint32_t gap = gaps_.before(frame);
      publish::Heading heading{.sequence = ++fieldSequence_,
                               .frame = frame,
                               .flags = one->flags | gap,
                               .zero = one->markers.zero,
                               .sent_ns = frame.times.solved_ns,
                               .sentReal_ns = frame.times.receivedReal_ns};
      wire_.fill(*one, heading).SerializeToString(&message_);
      write("field", "Field", fieldSequence_, &frame, message_);
      heading.flags = one->markers.flags | gap;
      wire_.fill(one->markers, heading).SerializeToString(&message_);
      write("markers", "Markers", fieldSequence_, &frame, message_);
    }
    fields_.release(const_cast<TractionField*>(one));
  }
}

/// \param frame that the message describes; null: none
void Recorder::write(const std::string& kind, const char* type, std::uint64_t sequence, const FrameInfo* frame,
                     std::string_view bytes) {
  if (error_) return;
  auto channel = channels_.find(kind);
  if (channel == channels_.end()) {
    const std::uint16_t schema =
        writer_.schema(std::string("traction.v1.") + type, "protobuf", traction::descriptors());
    const bool isOfTheStream = frame != nullptr ? kind != "camera" : kind == "description";
    const std::string topic = isOfTheStream ? traction::topicOf(sensor_, kind) : kind + "/";
    channel = channels_.emplace(kind, writer_.channel(schema, topic, "protobuf", {{"sensor", sensor_}})).first;
  }
  recording::Message message;
  message.channel = channel->second;
  message.sequence = static_cast<std::uint32_t>(sequence);
  message.logTime_ns = message.publishTime_ns = logNow();
  if (frame != nullptr && frame->times.receivedReal_ns > 0) {
    const FrameTimes& times = frame->times;
    const std::int64_t age_ns = times.captured_ns != 0 ? times.received_ns - times.captured_ns : 0;
    message.publishTime_ns = static_cast<std::uint64_t>(times.receivedReal_ns - age_ns);
  }
  message.data = bytes;
  watch(writer_.write(message));
}

void Recorder::watch(const tl::expected<void, Error>& done) {
  if (done || error_) return;
  error_ = done.error();
  error_->what += "; the recording has stopped with " + account();
  spdlog::error("nothing more is recorded: {}", error_->message());
  static_cast<void>(writer_.close());
}

tl::expected<void, Error> Recorder::close() {
  drain();
  if (!error_) watch(writer_.close());
  if (error_) return tl::unexpected(*error_);
  return {};
}

std::uint64_t Recorder::written(const std::string& kind) const {
  const auto channel = channels_.find(kind);
  if (channel == channels_.end()) return 0;
  const auto& counts = writer_.statistics().counts;
  const auto count = counts.find(channel->second);
  return count != counts.end() ? count->second : 0;
}

std::string Recorder::account() const {
  std::string text = fmt::format("{} pictures and {} fields in {}, {:.1f} MB", written("camera"), written("field"),
                                 options_.file, 1e-6 * static_cast<double>(file_.size()));
  if (picturesLost_.get() + fieldsLost_.get() > 0) {
    text += fmt::format("; {} pictures and {} fields are missing, for the disk, or this machine, was too slow",
                        picturesLost_.get(), fieldsLost_.get());
  }
  return text;
}

/// Returns a time that never goes back, even if the time of day is set.
std::uint64_t Recorder::logNow() const {
  return static_cast<std::uint64_t>(epoch_ns_ + links_.monotonicClock());
}

}  // namespace tractiond
