#include "client/touch/serve.h"

#include "base/clock.h"
#include "base/network/socket_file.h"
#include "base/service/log.h"
#include "base/service/own_directory.h"
#include "base/service/service.h"
#include "base/service/time_slice.h"
#include "client/touch/follower.h"
#include "client/touch/hand_relay.h"
#include "client/touch/publisher.h"
#include "proto/traction/v1/endpoints.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <random>
#include <string>
#include <variant>
#include <vector>

namespace traction::contacts {
namespace {

using std::chrono::milliseconds;

constexpr const char* kName = "traction-touch";
constexpr std::int64_t kTurn_ns = 100'000'000;       ///< longest time between two turns of the service
constexpr std::int64_t kTell_ns = 1'000'000'000;     ///< between two lines of the log about the same
constexpr std::int64_t kUnheard_ns = 3'000'000'000;  ///< without a field until the log says so

std::string line(const tractiond::Error& error) {
  return tractiond::logLine(kName, spdlog::level::err, error.message());
}

Id randomId() {
  std::random_device device;
  std::uniform_int_distribution<int> byte(0, 255);
  Id id{};
  std::generate(id.begin(), id.end(), [&] { return static_cast<std::uint8_t>(byte(device)); });
  return id;
}

/// Fields in, contacts out: what one turn of the program's only loop does. Thread-bound.
class Relay {
 public:
  Relay(const SubscriberOptions& options, Publisher& publisher)
      : subscriber_(options)
      , publisher_(publisher)
      , follower_({.run = randomId()}) {}

  /// Waits for a field, at most until contacts end without one, and passes its contacts on.
  void turn() {
    std::int64_t patience_ns = kTurn_ns;
    if (follower_.hasContacts()) patience_ns = std::clamp<std::int64_t>(silentAt() - now(), 0, kTurn_ns);
    try {
      const auto patience = std::chrono::ceil<milliseconds>(std::chrono::nanoseconds(patience_ns));
      if (const auto message = subscriber_.receive(patience)) {
        if (const auto* description = std::get_if<Description>(&*message))
          follower_.describe(*description);
        else
          pass(std::get<Field>(*message));
      } else if (follower_.hasContacts() && now() >= silentAt()) {
        publisher_.send(follower_.wait(now()));
      }
    } catch (const Error& error) {
      if (isTimeToTell()) spdlog::warn("{}", error.what());
    }
    tell();
  }

  void endAll() {
    if (follower_.hasContacts()) publisher_.send(follower_.endAll());
  }

  std::string statusLine() const {
    return std::string(isSilent_ ? "no fields come" : "follows contacts") +
           (subscriber_.lost() == 0 ? "" : ", " + std::to_string(subscriber_.lost()) + " fields were lost");
  }

 private:
  static std::int64_t now() { return tractiond::monotonicNow(); }
  std::int64_t silentAt() const { return follower_.arrived_ns() + Follower::kSilence_ns + 1'000'000; }

  void pass(const Field& field) {
    if (!isValidName(field.header.sensor)) throw Error(ErrorCode::kMalformed, "a field has no name of a sensor");
    if (field.header.sensor != sensor_) endAll();  // on the topic on which they began
    sensor_ = field.header.sensor;
    publisher_.send(follower_.take(field, subscriber_.raw().bytes));
  }

  bool isTimeToTell() {
    const std::int64_t now_ns = now();
    if (now_ns - told_ns_ < kTell_ns) return false;
    told_ns_ = now_ns;
    return true;
  }

  /// Logs what has changed.
  void tell() {
    const bool wasSilent = isSilent_;
    isSilent_ = now() - std::max(started_ns_, follower_.arrived_ns()) > kUnheard_ns;
    if (isSilent_ && !wasSilent) spdlog::warn("no fields come from {}; see tractionctl status", subscriber_.endpoint());
    if (!isSilent_ && wasSilent) spdlog::info("fields come again");
    if (subscriber_.lost() != lost_ && isTimeToTell()) {
      spdlog::warn("{} fields were lost on the way, {} since the start: this machine is too busy",
                   subscriber_.lost() - lost_, subscriber_.lost());
      lost_ = subscriber_.lost();
    }
  }

  Subscriber subscriber_;
  Publisher& publisher_;
  Follower follower_;
  std::string sensor_;  ///< of the last field
  bool isSilent_ = false;
  std::uint64_t lost_ = 0;  ///< fields that the log has told of
  std::int64_t started_ns_ = now(), told_ns_ = 0;
};

/// Runs until a signal comes.
template <typename AnyRelay>
int run(AnyRelay&& relay, const Publisher& publisher) {
  for (const std::string& endpoint : publisher.endpoints()) spdlog::info("listening at {}", endpoint);
  const tractiond::ServiceHooks hooks{
      .loops = {}, .ended = [] { return false; }, .statusLine = [&] { return relay.statusLine(); }};
  tractiond::ServiceLoop loop(hooks);
  tractiond::admitSignals();
  for (std::int64_t turned_ns = 0;;) {
    relay.turn();
    const std::int64_t now_ns = tractiond::monotonicNow();
    if (now_ns - turned_ns < kTurn_ns / 2) continue;
    turned_ns = now_ns;
    if (!loop.turn()) break;
  }
  relay.endAll();
  spdlog::info("stopped");
  return EX_OK;
}

}  // namespace

int failed(const tractiond::Error& error) {
  std::cerr << line(error) << "\n";
  return error.exitCode;
}

int serve(const Arguments& arguments) {
  tractiond::catchSignals();
  tractiond::shortenTimeSlice(0);  // and ZeroMQ's threads, which start later: a field waits for none that computes
  if (const auto raised = tractiond::raiseDescriptorLimit(); !raised) return failed(raised.error());
  const auto hand = arguments.hand.empty() ? tl::expected<HandFile, tractiond::Error>() : loadHand(arguments.hand);
  if (!hand) return failed(hand.error());
  const std::string& instance = arguments.hand.empty() ? arguments.source.instance : hand->name;
  const auto runtime = std::filesystem::absolute(
      arguments.runtime.empty() ? tractiond::runtimeDirectory(instance, kTouch) : arguments.runtime);
  const auto own = tractiond::OwnDirectory::claim(runtime, "runtime directory", kName);
  if (!own) return failed(own.error());
  std::vector<std::string> endpoints = {ipcEndpoints(runtime).stream};
  if (instance == kDefaultInstance) endpoints.push_back(touchTcpEndpoints().stream);
  const auto log = tractiond::startLog(kName, "info");
  const auto publisher = Publisher::open(endpoints);
  if (!publisher) {
    tractiond::Error error = publisher.error();
    if (tractiond::network::isInUse(error))
      error.remedy =
          "is another traction-touch running? Give this one a name with --instance, or in the file of the hand";
    return log->write(line(error)), error.exitCode;
  }
  return arguments.hand.empty() ? run(Relay(arguments.source, **publisher), **publisher)
                                : run(HandRelay(*hand, randomId(), **publisher), **publisher);
}

}  // namespace traction::contacts
