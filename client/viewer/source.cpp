#include "client/viewer/source.h"

#include <pthread.h>

namespace traction::view {

using namespace std::chrono_literals;

Source::Source(const SubscriberOptions& options, Deliver deliver)
    : subscriber_(options)
    , deliver_(std::move(deliver))
    , forwarder_(deliver_)
    , thread_([this](const std::stop_token& stop) { listen(stop); }) {}

Source::~Source() = default;

void Source::listen(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "view-source");
  while (!stop.stop_requested()) {
    try {
      if (const auto message = subscriber_.receive(100ms)) forwarder_.pass(*message, subscriber_.raw());
    } catch (const Error& error) {
      // What came and is no message of the protocol is for the reader to see.
      const Raw raw = subscriber_.raw();
      const bool isRead = error.code() == ErrorCode::kMalformed && !raw.bytes.empty();
      deliver_(kErrors, isRead ? makeFrame(raw.topic, raw.bytes) : errorFrame(error));
    }
  }
}

}  // namespace traction::view
