// What the server keeps of each sensor and of each recording that is played.
#pragma once

#include "client/viewer/forwarder.h"
#include "client/viewer/foxglove_converter.h"
#include "client/viewer/health_feed.h"
#include "client/viewer/playing.h"
#include "client/viewer/recording.h"
#include "client/viewer/session.h"
#include "client/viewer/source.h"

#include <boost/asio/thread_pool.hpp>

#include <chrono>
#include <list>
#include <map>
#include <memory>
#include <optional>

namespace traction::view {

/// One sensor and its sessions. Receives while there are sessions, or clients of Foxglove. Bound to the server's
/// thread.
struct Hub {
  /// Offers a frame to all sessions, and keeps it for new ones, in place of the one before, if its kind is sent rarely.
  /// \param kind one bit of Topics or Kinds
  void deliver(unsigned kind, const Frame& frame) {
    // Sent rarely.
    constexpr unsigned kKept = unsigned{kDescription} | kStatus | kPlaces | kRecorder | kHealth;
    if ((kind & kKept) != 0) last[kind] = frame;
    for (const auto& session : sessions) session->offer(kind, frame);
  }

  SourceOptions options;
  std::optional<Control> control;  ///< empty: no endpoint for requests is known
  std::list<std::shared_ptr<Session>> sessions;
  std::map<unsigned, Frame> last;              ///< newest frame of each kept kind, by kind
  std::chrono::steady_clock::time_point used;  ///< when it had a session last
  int questions = 0;                           ///< requests to the daemon that are not answered yet
  std::unique_ptr<Forwarder> forwarder;
  std::unique_ptr<HealthFeed> health;
  std::unique_ptr<foxglove::Converter> converter;  ///< null: there is no Foxglove server
  std::unique_ptr<Source> source;                  // behind the three, which its thread uses
  std::shared_ptr<Recording> recording;            ///< that is being made; null: none
  boost::asio::thread_pool asker{1};               ///< sends requests, each of which may wait for seconds
};

/// A session that plays a recording. Bound to the server's thread.
struct Show {
  std::shared_ptr<Session> session;
  std::unique_ptr<Playing> playing;  ///< null: the recording cannot be read, or the session has ended
};

}  // namespace traction::view
