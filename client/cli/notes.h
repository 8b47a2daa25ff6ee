// What is told on standard error beside messages that are taken down.
#pragma once

#include "traction/subscriber.h"

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace traction::cli {

const Header& headerOf(const Message& message);

/// Of one subscriber: whether anybody publishes, who comes and goes, and what is lost.
class Notes {
 public:
  using Clock = std::chrono::steady_clock;

  /// \param onSilence what may be the cause where a publisher says nothing \param onLoss what may be that of losses
  Notes(const Subscriber& subscriber, std::string onSilence, std::string onLoss);

  /// In every turn. \throws Error kNoAnswer: for some seconds there was nobody
  void look(bool isConnected, Clock::time_point now);
  void hear(const Message& message, Clock::time_point now);

 private:
  void noteLosses(Clock::time_point now);

  const Subscriber& subscriber_;
  std::string onSilence_, onLoss_;
  bool isConnected_ = false, wasConnected_ = false, heard_ = false;
  bool toldNoGel_ = false;  ///< of this start of the daemon
  std::optional<Id> boot_;
  std::uint64_t sequence_ = 0;
  std::uint64_t told_ = 0;  ///< of the losses
  Clock::time_point start_ = Clock::now(), toldAt_;
};

}  // namespace traction::cli
