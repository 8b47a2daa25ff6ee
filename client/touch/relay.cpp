#include "client/touch/relay.h"

#include "proto/traction/v1/endpoints.h"
#include "traction/description.h"

#include <sys/random.h>

#include <algorithm>
#include <chrono>
#include <variant>

namespace traction::contacts {
namespace {

constexpr std::int64_t kTell_ns = 1'000'000'000;     ///< between two lines of the log about the same
constexpr std::int64_t kUnheard_ns = 3'000'000'000;  ///< without a field until the log says so

}  // namespace

Id randomId() {
  Id id{};
  [[maybe_unused]] const int failed = getentropy(id.data(), id.size());  // 16 bytes are always available
  return id;
}

void Relay::turn() {
  std::int64_t patience_ns = kTurn_ns;
  if (follower_.hasContacts()) patience_ns = std::clamp<std::int64_t>(silentAt() - now(), 0, kTurn_ns);
  try {
    const auto patience = std::chrono::ceil<std::chrono::milliseconds>(std::chrono::nanoseconds(patience_ns));
    if (const auto message = subscriber_.receive(patience)) {
      if (const auto* description = std::get_if<Description>(&*message))
        follower_.describe(*description);
      else
        pass(std::get<Field>(*message));
    } else if (follower_.hasContacts() && now() >= silentAt()) {
      waited_ns_ = now();
      output_.take(follower_, follower_.wait(waited_ns_), nullptr);
    }
  } catch (const Error& error) {
    if (isTimeToTell()) spdlog::warn("{}", error.what());
  }
  output_.turn();
  tell();
}

void Relay::endAll() {
  if (follower_.hasContacts()) output_.take(follower_, follower_.endAll(), nullptr);
}

std::string Relay::statusLine() const {
  return std::string(isSilent_ ? "no fields come" : "follows contacts") +
         (subscriber_.lost() == 0 ? "" : ", " + std::to_string(subscriber_.lost()) + " fields were lost");
}

void Relay::pass(const Field& field) {
  if (!isValidName(field.header.sensor)) throw Error(ErrorCode::kMalformed, "a field has no name of a sensor");
  if (field.header.sensor != sensor_) endAll();  // on the topic on which they began
  sensor_ = field.header.sensor;
  output_.take(follower_, follower_.take(field, subscriber_.raw().bytes), &field);
}

bool Relay::isTimeToTell() {
  const std::int64_t now_ns = now();
  if (now_ns - reported_ns_ < kTell_ns) return false;
  reported_ns_ = now_ns;
  return true;
}

void Relay::tell() {
  const bool wasSilent = isSilent_;
  isSilent_ = now() - std::max(started_ns_, follower_.arrived_ns()) > kUnheard_ns;
  if (isSilent_ && !wasSilent) spdlog::warn("no fields come from {}; see tractionctl status", subscriber_.endpoint());
  if (!isSilent_ && wasSilent) spdlog::info("fields come again");
  if (subscriber_.secondSource() != second_) spdlog::warn("{}", second_ = subscriber_.secondSource());
  if (subscriber_.lost() != lost_ && isTimeToTell()) {
    spdlog::warn("{} fields were lost on the way, {} since the start: this machine is too busy",
                 subscriber_.lost() - lost_, subscriber_.lost());
    lost_ = subscriber_.lost();
  }
}

}  // namespace traction::contacts
