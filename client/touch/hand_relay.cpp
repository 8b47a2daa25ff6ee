#include "client/touch/hand_relay.h"

#include "base/clock.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>
#include <variant>

namespace traction::contacts {
namespace {

using std::chrono::milliseconds;

/// Longest wait for one finger: so late are the others if it is silent.
constexpr milliseconds kPatience{20};
constexpr int kMostAtOnce = 16;                      ///< fields of one finger that are read before the next one's turn
constexpr std::int64_t kLasting_ns = 1'000'000'000;  ///< a state that lasts this long is logged

const char* wordsFor(v1::FingerState state) {
  constexpr std::array kWords = {"",
                                 "is matched",
                                 "its field is not valid",
                                 "its frames are not captured together with the others'",
                                 "its frames have no bound of their time of capture",
                                 "no frames come; see tractionctl status --instance",
                                 "two daemons have its name, or another finger has its sensor"};
  return kWords.at(static_cast<std::size_t>(state));
}

SubscriberOptions fieldsOf(const std::string& instance) {
  SubscriberOptions options;
  options.instance = instance;
  options.topics = kField;
  options.allSources = true;  // the finger is ambiguous then
  return options;
}

}  // namespace

HandRelay::HandRelay(const HandFile& hand, const Id& boot, Publisher& publisher)
    : publisher_(publisher)
    , grasper_(hand, {.boot = boot})
    , sent_ns_(tractiond::monotonicNow()) {
  for (const HandFile::Finger& each : hand.fingers) {
    fingers_.push_back({each.instance, Subscriber(fieldsOf(each.instance))});
  }
}

void HandRelay::turn() {
  // A set is complete when its last field is here, which is of the finger that was heard longest ago. The others' wait.
  for (std::size_t i = 0; i < fingers_.size(); ++i) {
    for (int count = 0; count < kMostAtOnce && receive(i, milliseconds(0));) ++count;
  }
  const auto longest = std::ranges::min_element(fingers_, {}, &Source::heard_ns);
  receive(static_cast<std::size_t>(longest - fingers_.begin()), kPatience);
  if (tractiond::monotonicNow() - sent_ns_ > grasper_.silence_ns()) send(grasper_.wait());
  tell();
}

/// Returns whether there was a field.
bool HandRelay::receive(std::size_t index, milliseconds patience) {
  Source& finger = fingers_[index];
  try {
    const auto message = finger.subscriber.receive(patience);
    if (!message) return false;
    const auto& field = std::get<Field>(*message);
    finger.heard_ns = field.header.arrived_ns;
    if (const v1::Grasp* grasp = grasper_.take(index, field)) send(*grasp);
    return true;
  } catch (const Error& error) {
    const std::int64_t now_ns = tractiond::monotonicNow();
    if (now_ns - std::exchange(errorTold_ns_, now_ns) > kLasting_ns)
      spdlog::warn("{}: {}", finger.instance, error.what());
    return false;
  }
}

void HandRelay::send(const v1::Grasp& grasp) {
  publisher_.send(grasp);
  sent_ns_ = tractiond::monotonicNow();
  // Of the states, the later one is the cause: where a finger is missing, the others are unmatched.
  const v1::Finger& worst = *std::ranges::max_element(grasp.fingers(), {}, &v1::Finger::state);
  now_ = grasp.valid() ? "all fingers are matched" : worst.instance() + ": " + wordsFor(worst.state());
  if (worst.state() == v1::FINGER_STATE_MISSING) now_ += " " + worst.instance();
}

/// Logs a state that is new and lasts.
void HandRelay::tell() {
  const std::int64_t now_ns = tractiond::monotonicNow();
  if (now_ != news_) newsSince_ns_ = now_ns;
  news_ = now_;
  if (news_ == said_ || now_ns - newsSince_ns_ < kLasting_ns) return;
  said_ = news_;
  spdlog::info("{}", said_);
}

std::string HandRelay::statusLine() const {
  std::uint64_t lost = 0;
  for (const Source& finger : fingers_) lost += finger.subscriber.lost();
  return now_ + (lost == 0 ? "" : ", " + std::to_string(lost) + " fields were lost");
}

}  // namespace traction::contacts
