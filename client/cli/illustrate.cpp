#include "client/cli/recordings.h"
#include "client/cli/skipped.h"
#include "client/files/failure.h"
#include "client/files/message_header.h"
#include "client/files/recorded_sources.h"
#include "client/show/foxglove.h"
#include "recording/reader.h"
#include "recording/writer.h"

#include <sysexits.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

namespace traction::client {

namespace {

/// Copies the messages, and adds the drawings for Foxglove behind each.
class Illustrated {
 public:
  /// \param sources must outlive the object
  Illustrated(const std::string& path, const std::string& sensor, const Sources& sources)
      : path_(path)
      , sensor_(sensor)
      , sources_(sources)
      , file_(opened(path)) {}
  /// Removes the file unless finish() has ended it.
  ~Illustrated() {
    std::error_code unknown;
    if (!isDone_) std::filesystem::remove(path_, unknown);
  }
  Illustrated(const Illustrated&) = delete;
  Illustrated& operator=(const Illustrated&) = delete;

  void add(const recording::Channel& channel, const recording::Schema* schema, const recording::Message& record) {
    auto copy = record;
    copy.channel = idOf(channel.topic, schema, channel.encoding, channel.metadata);
    orThrow(writer_.write(copy));
    std::optional<Message> message;
    try {
      message = decode(Raw{channel.topic, record.data});
    } catch (const Error& error) {
      skipped_.add(error, record.sequence);
    }
    if (!message || sources_.isSecond(*message)) return;
    const std::string& sensor = headerOf(*message).sensor;
    if (!sensor_.empty() && sensor != sensor_) return;
    auto& drawing = drawings_.try_emplace(sensor, sensor).first->second;
    copy.sequence = 0;  // messages of several topics are drawn in one channel
    for (const foxglove::Drawn& drawn : drawing.draw(*message, record.publishTime_ns)) {
      const recording::Schema theirs{0, std::string(drawn.schema), "protobuf", std::string(foxglove::descriptors())};
      copy.channel =
          idOf("foxglove/" + sensor + "/" + std::string(drawn.topic), &theirs, "protobuf", {{"sensor", sensor}});
      copy.data = drawn.data;
      orThrow(writer_.write(copy));
      ++drawn_;
    }
  }
  void finish() {
    orThrow(writer_.close());
    isDone_ = true;
  }
  std::uint64_t drawn() const { return drawn_; }
  /// Returns the messages that were copied and could not be drawn.
  const Skipped& skipped() const { return skipped_; }

 private:
  static recording::NewFile opened(const std::string& path) {
    std::error_code unknown;
    std::filesystem::remove(path, unknown);
    return orThrow(recording::NewFile::create(path));
  }

  std::uint16_t idOf(const std::string& topic, const recording::Schema* schema, const std::string& encoding,
                     const std::map<std::string, std::string>& metadata) {
    const auto known = channels_.find(topic);
    if (known != channels_.end()) return known->second;
    constexpr std::size_t kMost = 10'000;  // a drawing of each is kept
    if (channels_.size() == kMost) throw Failure(EX_DATAERR, path_ + " would have more than 10,000 topics");
    std::uint16_t& type = schemas_[schema == nullptr ? std::string() : schema->name];
    if (schema != nullptr && type == 0) type = writer_.schema(schema->name, schema->encoding, schema->data);
    return channels_[topic] = writer_.channel(type, topic, encoding, metadata);
  }

  std::string path_, sensor_;
  const Sources& sources_;
  bool isDone_ = false;
  recording::NewFile file_;
  recording::Writer writer_{file_, {.syncChunks = false, .library = "tractionctl"}};
  std::map<std::string, std::uint16_t> schemas_, channels_;
  std::map<std::string, foxglove::Drawing> drawings_;
  std::uint64_t drawn_ = 0;
  Skipped skipped_;
};

}  // namespace

void illustrate(const std::string& from, const std::string& to, const std::string& sensor) {
  const auto reader = orThrow(recording::Reader::open(from));
  std::error_code unknown;
  if (std::filesystem::equivalent(from, to, unknown))
    throw Failure(EX_USAGE, to + " is what is to be exported: another name for what comes of it");
  const Sources sources = sourcesOf(reader);
  Illustrated made(to, sensor, sources);
  const auto extent =
      orThrow(reader.read([&](const recording::Channel& channel, const recording::Schema* schema,
                              const recording::Message& record) { made.add(channel, schema, record); }));
  const std::string trouble = troubleOf(extent, made.skipped(), sources);
  if (made.drawn() == 0) {
    throw Failure(made.skipped().exitCode(), from + " has nothing to draw" + (sensor.empty() ? "" : " of " + sensor) +
                                                 (trouble.empty() ? "" : "; " + trouble));
  }
  made.finish();
  if (!trouble.empty())
    throw Failure(made.skipped().exitCode(), from + ": " + trouble + "; " + to + " has what could be read");
}

}  // namespace traction::client
