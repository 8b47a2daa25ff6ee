#include "client/cli/notes.h"

#include "base/printable.h"
#include "client/files/message_header.h"

#include <cstdio>
#include <utility>

namespace traction::client {

namespace {

using namespace std::chrono_literals;

constexpr auto kPatience = 3s;      ///< for the connection and a first message
constexpr auto kBetweenNotes = 1s;  ///< between two reports of losses

void say(const std::string& what) {
  std::fprintf(stderr, "tractionctl: %s\n", printable(what).c_str());
}

}  // namespace

Error noPublisher(const std::string& endpoints, const std::string& program) {
  return {ErrorCode::kNoAnswer, "no publisher at " + endpoints + "; is " + program + " running?"};
}

Notes::Notes(const Subscriber& subscriber, std::string onSilence, std::string onLoss, std::string program)
    : subscriber_(subscriber)
    , onSilence_(std::move(onSilence))
    , onLoss_(std::move(onLoss))
    , program_(std::move(program)) {}

void Notes::noteConnection(bool isConnected, Clock::time_point now) {
  const bool late = now - start_ >= kPatience;
  if (!wasConnected_ && !isConnected && late) {
    throw noPublisher(subscriber_.endpoint(), program_);
  }
  if (wasConnected_ && isConnected != isConnected_)
    say(program_ + (isConnected ? " is back" : " is gone; waiting for it"));
  isConnected_ = isConnected;
  wasConnected_ = wasConnected_ || isConnected;
  if (isConnected && late && !heard_) {
    heard_ = true;
    say("connected, but nothing of this topic comes from " + subscriber_.endpoint() + "; " + onSilence_);
  }
  if (subscriber_.secondSource() != second_) say(second_ = subscriber_.secondSource());
  noteLosses(now);
}

void Notes::hear(const Message& message, Clock::time_point now) {
  heard_ = wasConnected_ = isConnected_ = true;
  const Header& header = headerOf(message);
  if (boot_ && *boot_ != header.boot) say("tractiond was started anew");
  if (boot_ != header.boot) saidNoGel_ = false;
  boot_ = header.boot;
  const auto* const description = std::get_if<Description>(&message);
  if (description && !description->hasGel() && !std::exchange(saidNoGel_, true))
    say("no gel: nothing is measured; set sensor.gel_file");
  sequence_ = header.sequence;
  noteLosses(now);
}

void Notes::noteLosses(Clock::time_point now) {
  const std::uint64_t lost = subscriber_.lost();
  if (lost == reported_ || (reported_ != 0 && now - reportedAt_ < kBetweenNotes)) return;
  say(std::to_string(lost - reported_) + " messages lost before number " + std::to_string(sequence_) + ": " + onLoss_);
  reported_ = lost;
  reportedAt_ = now;
}

}  // namespace traction::client
