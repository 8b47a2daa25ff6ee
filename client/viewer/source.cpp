#include "client/viewer/source.h"

#include <pthread.h>

#include <utility>

namespace traction::view {

using namespace std::chrono_literals;

Source::Source(const SubscriberOptions& options, Handlers handlers)
    : subscriber_(options)
    , handlers_(std::move(handlers))
    , thread_([this](const std::stop_token& stop) { listen(stop); }) {}

Source::~Source() = default;

void Source::listen(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "view-source");
  while (!stop.stop_requested()) {
    try {
      if (const auto message = subscriber_.receive(100ms)) handlers_.pass(*message, subscriber_.raw());
    } catch (const Error& error) {
      const bool isAboutMessage = error.code() == ErrorCode::kMalformed;
      handlers_.fail(error, isAboutMessage ? subscriber_.raw() : Raw{});
    }
    if (subscriber_.secondSource() != second_) {
      second_ = subscriber_.secondSource();
      handlers_.fail(Error(ErrorCode::kMalformed, second_), {});
    }
    handlers_.turn(subscriber_.isConnected());
  }
}

}  // namespace traction::view
