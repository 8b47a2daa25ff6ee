#include "client/cli/recordings.h"

#include "base/json_writer.h"
#include "base/printable.h"
#include "client/cli/commands.h"
#include "client/files/failure.h"
#include "client/files/recorded_sources.h"
#include "client/show/output.h"
#include "client/show/page.h"
#include "manual/number.h"
#include "recording/reader.h"

#include <sysexits.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <map>
#include <memory>
#include <system_error>
#include <vector>

namespace traction::client {

namespace {

using Count = unsigned long long;

struct Topic {
  std::string name, type, sensor;
  std::uint64_t messages = 0;
  std::uint64_t lost = 0;      ///< by gaps in the sequence
  std::uint64_t restarts = 0;  ///< number of times that the sequence began again
  std::uint64_t begin_ns = 0, end_ns = 0;
  std::uint32_t sequence = 0;  ///< of the last

  void add(const recording::Message& message) {
    if (message.sequence != 0 && messages != 0) {
      if (message.sequence > sequence) lost += message.sequence - sequence - 1;
      if (message.sequence <= sequence) ++restarts;
    }
    sequence = message.sequence;
    begin_ns = messages == 0 ? message.logTime_ns : std::min(begin_ns, message.logTime_ns);
    end_ns = std::max(end_ns, message.logTime_ns);
    ++messages;
  }
  double rate_hz() const {
    return end_ns == begin_ns ? 0.0
                              : static_cast<double>(messages - 1) / (1e-9 * static_cast<double>(end_ns - begin_ns));
  }
};

struct Contents {
  recording::Extent extent;
  bool isIndexed = false;
  std::uint64_t bytes = 0;
  std::vector<Topic> topics;
  std::uint64_t begin_ns = UINT64_MAX, end_ns = 0;
  std::string secondSource;  ///< sentence about one, whose messages are not counted; empty: none
};

Contents contentsOf(const std::string& file) {
  const recording::Reader reader = orThrow(recording::Reader::open(file));
  Contents contents;
  contents.bytes = reader.file().size();
  const Sources sources = sourcesOf(reader);
  contents.secondSource = sources.trouble();
  std::map<std::uint16_t, Topic> topics;
  contents.extent = orThrow(reader.read(
      [&](const recording::Channel& channel, const recording::Schema* schema, const recording::Message& message) {
        if (isSecond(sources, channel, message)) return;
        Topic& topic = topics[channel.id];
        if (topic.messages == 0) {
          topic.name = channel.topic;
          topic.type = schema != nullptr ? schema->name : "";
          const auto sensor = channel.metadata.find("sensor");
          topic.sensor = sensor != channel.metadata.end() ? sensor->second : "";
        }
        topic.add(message);
      }));
  for (auto& [id, topic] : topics) {
    contents.begin_ns = std::min(contents.begin_ns, topic.begin_ns);
    contents.end_ns = std::max(contents.end_ns, topic.end_ns);
    contents.topics.push_back(std::move(topic));
  }
  if (topics.empty()) contents.begin_ns = 0;
  const auto summary = reader.summary();
  contents.isIndexed = summary && summary->has_value();
  return contents;
}

void printText(const std::string& file, const Contents& contents) {
  std::array<char, 300> line{};
  const auto begin = static_cast<std::time_t>(contents.begin_ns / 1'000'000'000);
  std::snprintf(line.data(), line.size(), "%.1f MB, %.1f s from %s, %s", 1e-6 * static_cast<double>(contents.bytes),
                1e-9 * static_cast<double>(contents.end_ns - contents.begin_ns),
                utc(begin, "%Y-%m-%d %H:%M:%S UTC").c_str(),
                !contents.extent.closed ? "NOT CLOSED"
                : contents.isIndexed    ? "closed"
                                        : "closed, without an index");
  printLine(file + ": " + line.data());
  if (!contents.extent.library.empty()) printLine("written by " + contents.extent.library);
  if (!contents.secondSource.empty()) printLine(contents.secondSource);
  for (const Topic& topic : contents.topics) {
    std::snprintf(line.data(), line.size(), "  %-44s %9llu messages %8.2f Hz %6llu lost", printable(topic.name).c_str(),
                  static_cast<Count>(topic.messages), topic.rate_hz(), static_cast<Count>(topic.lost));
    std::string text = line.data();
    if (topic.restarts != 0) text += ", started anew " + std::to_string(topic.restarts) + " times";
    printLine(text);
  }
}

void printJson(const std::string& file, const Contents& contents) {
  JsonWriter json;
  json.open('{').key("file").string(file).key("bytes").number(contents.bytes);
  json.key("closed").boolean(contents.extent.closed).key("indexed").boolean(contents.isIndexed);
  json.key("trouble").string(contents.extent.trouble).key("second_source").string(contents.secondSource);
  json.key("whole_bytes").number(contents.extent.whole_bytes);
  json.key("chunks").number(contents.extent.chunks).key("damaged_chunks").number(contents.extent.badChunks);
  json.key("library").string(contents.extent.library);
  json.key("begin_ns").number(contents.begin_ns).key("end_ns").number(contents.end_ns).key("topics").open('[');
  for (const Topic& topic : contents.topics) {
    json.open('{').key("topic").string(topic.name).key("type").string(topic.type).key("sensor").string(topic.sensor);
    json.key("messages").number(topic.messages).key("lost").number(topic.lost).key("restarts").number(topic.restarts);
    json.key("begin_ns").number(topic.begin_ns).key("end_ns").number(topic.end_ns);
    json.key("rate_hz").number(topic.rate_hz()).close('}');
  }
  printLine(json.close(']').close('}').take());
}

struct RecordingLine {
  double seconds = kForever, speed = 1.0;
  std::string file, output, sensor, endpoint = "tcp://127.0.0.1:9892";
  bool json = false, pictures = false, contacts = false;
};

}  // namespace

void info(const std::string& file, bool json) {
  const Contents contents = contentsOf(file);
  if (json) {
    printJson(file, contents);
  } else {
    printText(file, contents);
  }
  if (contents.extent.isWhole()) return;
  throw Failure(EX_DATAERR, file + ": " + contents.extent.trouble +
                                (contents.extent.messages == 0
                                     ? "; no message of it can be read"
                                     : "; tractionctl recover makes a whole recording of what can be read"));
}

void recover(const std::string& from, const std::string& to) {
  const recording::Reader reader = orThrow(recording::Reader::open(from));
  auto file = orThrow(recording::NewFile::create(to));
  const auto extent = recording::recover(reader, file);
  if (!extent || extent->messages == 0) {
    std::error_code unknown;
    std::filesystem::remove(to, unknown);
    if (!extent) throw Failure(extent.error().exitCode, extent.error().message());
    throw Failure(EX_DATAERR, from + " has no message that can be read, and nothing was written" +
                                  (extent->isWhole() ? "" : ": " + extent->trouble));
  }
  std::string text = to + ": " + std::to_string(extent->chunks) + " chunks of " + from;
  if (extent->whole_bytes < reader.file().size()) {
    text += ", without its last " + std::to_string(reader.file().size() - extent->whole_bytes) + " bytes";
  }
  printLine(text + (extent->isWhole() ? ", which was whole" : " (" + extent->trouble + ")"));
}

void addRecordings(Commands& commands) {
  const auto options = std::make_shared<RecordingLine>();
  CLI::App& recording =
      commands.add("record", "Records all published messages, and those of traction-touch, into a new MCAP file",
                   [options](const Target& target) {
                     SubscriberOptions all = target.subscription();
                     all.topics |= kOfTouch;
                     if (options->pictures) all.topics |= kPreview;
                     return record(all, options->file, options->seconds), EX_OK;
                   });
  CLI::App& replaying = commands.add(
      "replay", "Publishes a recording again, in its own time, for all subscribers",
      [options](const Target&) { return replay(options->file, options->endpoint, options->speed), EX_OK; });
  CLI::App& informing = commands.add("info", "Prints the contents of a recording, and whether it is complete",
                                     [options](const Target&) { return info(options->file, options->json), EX_OK; });
  CLI::App& recovering =
      commands.add("recover", "Makes a complete recording from one that was cut off or is damaged",
                   [options](const Target&) { return recover(options->file, options->output), EX_OK; });
  CLI::App& exporting = commands.add("export", "Writes the fields of a recording as CSV, or as drawings for Foxglove",
                                     [options](const Target&) {
                                       const auto write = options->contacts ? exportContacts : exportFields;
                                       return write(options->file, options->output, options->sensor), EX_OK;
                                     });

  recording.add_option("file", options->file, "file to write; an existing one is not replaced")
      ->type_name("FILE")
      ->required();
  recording.add_option("--seconds", options->seconds, "duration; without it: until Ctrl-C")
      ->type_name("SECONDS")
      ->check(timeSpan());
  recording.add_flag("--pictures", options->pictures,
                     "records the camera's pictures, too, at the rate and width of the daemon's publish.preview_hz and "
                     "publish.preview_width_px");
  replaying
      .add_option("--bind", options->endpoint,
                  "ZeroMQ endpoint to publish at, for example for tractionctl watch --connect")
      ->type_name("ENDPOINT")
      ->capture_default_str();
  replaying.add_option("--speed", options->speed, "factor by which it is faster than the original")
      ->type_name("FACTOR")
      ->capture_default_str()
      ->check(manual::number(1e-3, 1e6, "a factor from 0.001 to 1e6, as in 0.5"));
  for (CLI::App* one : {&replaying, &informing, &recovering, &exporting})
    one->add_option("file", options->file, "recording")->type_name("FILE")->required();
  informing.add_flag("--json", options->json, "as JSON");
  recovering.add_option("output", options->output, "file to write; an existing one is not replaced")
      ->type_name("FILE")
      ->required();
  exporting.add_option("output", options->output, "file to write: .csv or .mcap; an existing one is replaced")
      ->type_name("FILE")
      ->required();
  exporting.add_flag("--contacts", options->contacts,
                     "as CSV, the contacts that traction-touch makes of the fields, with ids; whether or not it ran");
  exporting.add_option("--sensor", options->sensor, "sensor whose fields are written, if the recording has several")
      ->type_name("NAME");
}

}  // namespace traction::client
