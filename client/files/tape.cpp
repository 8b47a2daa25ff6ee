#include "client/files/tape.h"

#include "base/clock.h"
#include "client/files/failure.h"
#include "client/files/message_header.h"
#include "proto/traction/v1/descriptors.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>

namespace traction::client {

namespace {

/// Returns the name of the message's type in the schemas.
std::string typeOf(const Message& message) {
  constexpr std::array kTypes = {"Field",   "Markers",  "Description", "Status",
                                 "Preview", "Contacts", "Grasp"};  // as in Message
  return std::string("traction.v1.") + kTypes.at(message.index());
}

}  // namespace

Tape::Tape(const std::string& path)
    : path_(path)
    , file_(orThrow(recording::NewFile::create(path)))
    , epoch_ns_(tractiond::realNow() - tractiond::monotonicNow()) {
  check(writer_.flush());
}

template <typename Write>
void Tape::watch(const Write& write) {
  const auto oldest = writer_.oldest_ns();
  const std::uint64_t chunks = writer_.statistics().chunks;
  const auto written = write();
  if (oldest && writer_.statistics().chunks != chunks) longest_ns_ = std::max(longest_ns_, logNow() - *oldest);
  check(written);
}

void Tape::check(const tl::expected<void, recording::Error>& written) {
  if (written) return;
  std::string what = written.error().message() + "; the recording has stopped with " + account();
  if (!writer_.close()) what += ", without its end: tractionctl recover makes one that has it, on another disk";
  drop();
  throw Failure(written.error().exitCode, what);
}

void Tape::add(const Message& message, const Raw& raw) {
  if (raw.topic.empty()) return;
  const Header& header = headerOf(message);
  recording::Message record;
  const auto [channel, isNew] = channels_.try_emplace(std::string(raw.topic));
  if (isNew) {
    const std::string type = typeOf(message);
    if (!schemas_.contains(type)) schemas_[type] = writer_.schema(type, "protobuf", descriptors());
    channel->second = writer_.channel(schemas_[type], raw.topic, "protobuf", {{"sensor", header.sensor}});
  }
  record.channel = channel->second;
  record.sequence = static_cast<std::uint32_t>(header.sequence);
  record.logTime_ns = static_cast<std::uint64_t>(epoch_ns_ + header.arrived_ns);
  record.publishTime_ns = captureTime_ns(message, record.logTime_ns);
  record.data = raw.bytes;
  watch([&] { return writer_.write(record); });
}

void Tape::flushIfDue() {
  if (writer_.isDue(logNow())) watch([&] { return writer_.flush(); });
}

void Tape::close() {
  watch([&] { return writer_.close(); });
}

void Tape::drop() const {
  std::error_code unknown;
  if (isEmpty()) std::filesystem::remove(path_, unknown);
}

std::string Tape::account() const {
  const recording::Statistics& all = writer_.statistics();
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "%llu messages of %.1f s, %.1f MB",
                static_cast<unsigned long long>(all.messages), 1e-9 * static_cast<double>(all.end_ns - all.begin_ns),
                1e-6 * static_cast<double>(file_.size()));
  return text.data();
}

std::uint64_t Tape::logNow() const {
  return static_cast<std::uint64_t>(epoch_ns_ + tractiond::monotonicNow());
}

}  // namespace traction::client
