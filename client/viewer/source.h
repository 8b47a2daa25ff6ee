// One sensor as the viewer's bridge hears it: a thread that passes on what comes.
#pragma once

#include "client/viewer/forwarder.h"
#include "traction/control.h"
#include "traction/subscriber.h"

#include <optional>
#include <string>
#include <thread>

namespace traction::view {

struct SourceOptions {
  std::string name;  ///< for people
  SubscriberOptions subscription;
  std::optional<ControlOptions> control;  ///< none: nobody knows where to ask
};

class Source {
 public:
  /// \param deliver is called on the source's own thread
  /// \throws Error kBadEndpoint, kBadKeys
  Source(const SubscriberOptions& options, Deliver deliver);
  /// Waits for its threads: a tenth of a second, some seconds where a surface is being computed.
  ~Source();
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// From now on kSurface is delivered, too. Thread-safe.
  void wantSurface() { forwarder_.wantSurface(); }

 private:
  void listen(const std::stop_token& stop);

  Subscriber subscriber_;
  Deliver deliver_;
  Forwarder forwarder_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace traction::view
