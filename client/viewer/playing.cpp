#include "client/viewer/playing.h"

#include "base/json_writer.h"
#include "client/files/failure.h"
#include "client/files/recorded_sources.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>

namespace traction::view {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Time between two messages with the position.
constexpr auto kReportEvery = 200ms;
/// Time within which a recording has a message of each topic, except the description.
constexpr std::uint64_t kBefore_ns = 1'500'000'000;
constexpr double kLongest_s = 3e7;  // between two messages

/// Returns the sensor's part of a topic, "traction/v1/NAME/"; empty if it is no topic of a sensor.
std::string prefixOf(const std::string& topic) {
  constexpr std::string_view kRoot = "traction/v1/";
  return topic.starts_with(kRoot) ? topic.substr(0, topic.find('/', kRoot.size()) + 1) : std::string();
}

}  // namespace

Playing::Playing(const std::filesystem::path& file, Deliver deliver)
    : reader_(client::orThrow(recording::Reader::open(file)))
    , deliver_(std::move(deliver))
    , forwarder_(deliver_)
    , thread_([this](const std::stop_token& stop) { run(stop); }) {}

Playing::~Playing() {
  stop();
}

void Playing::stop() {
  thread_.request_stop();
  changed_.notify_all();
}

void Playing::play(double from_s, double speed) {
  {
    const std::lock_guard lock(mutex_);
    request_ = Request{from_s, speed};
  }
  changed_.notify_all();
}

void Playing::run(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "view-playing");
  try {
    survey(stop);
    while (!stop.stop_requested()) {
      std::optional<Request> request;
      {
        std::unique_lock lock(mutex_);
        if (!changed_.wait(lock, stop, [this] { return request_.has_value(); })) return;
        request = std::exchange(request_, std::nullopt);
      }
      try {
        show(stop, *request);
      } catch (const Interrupted&) {
      }
    }
  } catch (const Interrupted&) {
  } catch (const std::bad_alloc&) {  // what was read is freed by now
    deliver_(kErrors, makeFrame("error", "refused there is too little memory to play this recording"));
  }
}

bool Playing::isPlayed(const recording::Channel& channel, const recording::Message& message) const {
  return !prefix_.empty() && channel.topic.starts_with(prefix_) && !client::isSecond(sources_, channel, message);
}

/// Reads the whole recording: its sensor, its extent, its descriptions.
void Playing::survey(const std::stop_token& stop) {
  constexpr std::size_t kMostDescribed = 64 << 20;
  sources_ = client::sourcesOf(reader_, stop);
  std::size_t described = 0;
  const auto extent = reader_.read(
      [&](const recording::Channel& channel, const recording::Schema*, const recording::Message& message) {
        if (prefix_.empty()) prefix_ = prefixOf(channel.topic);
        if (!isPlayed(channel, message)) return;
        if (begin_ns_ == 0) begin_ns_ = message.logTime_ns;
        end_ns_ = std::max(end_ns_, message.logTime_ns);
        if (channel.topic != prefix_ + "description/") return;
        if ((described += message.data.size()) <= kMostDescribed) descriptions_[message.logTime_ns] = message.data;
      },
      0, stop);
  if (stop.stop_requested()) throw Interrupted();
  trouble_ = extent ? extent->trouble : extent.error().message();
  if (trouble_.empty()) trouble_ = sources_.trouble();
  if (trouble_.empty() && described > kMostDescribed) trouble_ = "it has more than 64 MiB of descriptions";
  if (prefix_.empty() && trouble_.empty()) trouble_ = "it has no messages of a sensor";
}

void Playing::show(const std::stop_token& stop, const Request& request) {
  const double length_s = 1e-9 * static_cast<double>(end_ns_ - begin_ns_);
  const double from_s = std::clamp(request.from_s, 0.0, length_s);
  const std::uint64_t from_ns = begin_ns_ + static_cast<std::uint64_t>(1e9 * from_s);
  if (const auto after = descriptions_.upper_bound(from_ns); after != descriptions_.begin()) {
    pass(prefix_ + "description/", std::prev(after)->second);
  }
  std::map<std::string, std::string> standing;  // the last message of each topic before that moment
  bool hasArrived = false;
  const auto arrive = [&] {
    for (const auto& [topic, bytes] : standing) pass(topic, bytes);
    hasArrived = true;
    reportTime(from_s, request.speed);
  };
  const Clock::time_point begin = Clock::now();
  Clock::time_point reported = begin;
  const auto extent = reader_.read(
      [&](const recording::Channel& channel, const recording::Schema*, const recording::Message& message) {
        if (!isPlayed(channel, message)) return;
        if (message.logTime_ns <= from_ns) {
          waitUntil(stop, begin);
          if (from_ns - message.logTime_ns < kBefore_ns) standing[channel.topic] = message.data;
          return;
        }
        if (!hasArrived) arrive();
        if (request.speed == 0.0) throw Interrupted();
        const double due_s = 1e-9 * static_cast<double>(message.logTime_ns - from_ns) / request.speed;
        waitUntil(stop, begin + std::chrono::nanoseconds(std::llround(1e9 * std::min(due_s, kLongest_s))));
        pass(channel.topic, message.data);
        if (Clock::now() - reported < kReportEvery) return;
        reported = Clock::now();
        reportTime(1e-9 * static_cast<double>(message.logTime_ns - begin_ns_), request.speed);
      },
      from_ns - std::min(from_ns, kBefore_ns), stop);
  if (!hasArrived) arrive();
  if (!extent) trouble_ = extent.error().message();
  reportTime(length_s, 0.0);
}

void Playing::waitUntil(const std::stop_token& stop, Clock::time_point due) {
  std::unique_lock lock(mutex_);
  const bool isRequested = changed_.wait_until(lock, stop, due, [this] { return request_.has_value(); });
  if (isRequested || stop.stop_requested()) throw Interrupted();
}

void Playing::pass(std::string_view topic, std::string_view bytes) {
  const Raw raw{topic, bytes};
  try {
    if (const auto message = decode(raw)) forwarder_.pass(*message, raw);
  } catch (const Error& error) {
    deliver_(kErrors, errorFrame(error));
  }
}

void Playing::reportTime(double at_s, double speed) {
  JsonWriter json;
  json.open('{').key("begin_s").number(1e-9 * static_cast<double>(begin_ns_));
  json.key("length_s").number(1e-9 * static_cast<double>(end_ns_ - begin_ns_)).key("at_s").number(at_s);
  json.key("speed").number(speed).key("trouble").string(trouble_).close('}');
  deliver_(kTime, makeFrame("view/time", json.take()));
}

}  // namespace traction::view
