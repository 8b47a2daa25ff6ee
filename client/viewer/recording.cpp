#include "client/viewer/recording.h"

#include "client/files/failure.h"
#include "client/show/page.h"

#include <pthread.h>

#include <algorithm>

namespace traction::view {

namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMostFiles = 200;
/// Longest wait for a message; a chunk may end late by this.
constexpr auto kTurn = 20ms;
/// Messages that may wait while the disk is slow.
constexpr int kQueue = 4000;

SubscriberOptions everything(SubscriberOptions options) {
  options.topics = kAllTopics | kPreview | kOfTouch;
  options.queue = kQueue;
  return options;
}

}  // namespace

std::vector<RecordingFile> recordingsIn(const std::filesystem::path& directory) {
  std::vector<RecordingFile> all;
  std::error_code error;
  for (std::filesystem::directory_iterator at(directory, error), end; !error && at != end; at.increment(error)) {
    std::error_code unknown;
    if (at->path().extension() != ".mcap" || !at->is_regular_file(unknown)) continue;
    all.push_back({at->path().filename(), at->file_size(unknown), at->last_write_time(unknown)});
  }
  std::sort(all.begin(), all.end(), [](const auto& one, const auto& other) { return one.written > other.written; });
  all.resize(std::min(all.size(), kMostFiles));
  return all;
}

std::string recordingName(const std::string& sensor) {
  std::string name = sensor;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_'; }, '-');
  return name + client::utc(std::time(nullptr), "-%Y-%m-%dT%H-%M-%S.mcap");
}

Recording::Recording(const SubscriberOptions& options, const std::filesystem::path& file)
    : name_(file.filename())
    , subscriber_(everything(options))
    , tape_(file)
    , thread_([this](const std::stop_token& stop) { run(stop); }) {}

Recording::State Recording::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void Recording::finish() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void Recording::run(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "view-recording");
  const auto tell = [this](std::optional<std::string> error = {}) {
    State now{tape_.account(), std::move(error)};
    const std::lock_guard lock(mutex_);
    state_ = std::move(now);
  };
  try {
    while (!stop.stop_requested()) {
      try {
        if (const auto message = subscriber_.receive(kTurn)) tape_.add(*message, subscriber_.raw());
      } catch (const Error&) {  // malformed messages are left out; the page reports them
      }
      tape_.flushIfDue();
      tell();
    }
    tape_.close();
    tape_.drop();
    tell();
  } catch (const client::Failure& error) {
    tell(error.what());
  }
}

}  // namespace traction::view
