// Serves the viewer's page and its WebSockets, and the Foxglove server beside them.
#pragma once

#include "client/viewer/listen_address.h"
#include "client/viewer/source.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace traction::view {

inline constexpr std::uint16_t kPagePort = 9880;
/// Port that Foxglove and Lichtblick propose for a connection.
inline constexpr std::uint16_t kFoxglovePort = 8765;

struct FoxgloveOptions {
  ListenAddress listen{.port = kFoxglovePort};
  std::vector<std::string> origins;  ///< allowed besides those of Foxglove's and Lichtblick's own apps
};

struct ServerOptions {
  ListenAddress listen{.port = kPagePort};
  std::vector<std::string> names;           ///< of this host, accepted in requests besides IP addresses and localhost
  bool readOnly = false;                    ///< refuses requests for a zero and for recordings
  std::string setup;                        ///< folder of a guided setup of the one sensor; empty: none is offered
  std::string recordings;                   ///< directory of recordings to play and to add to; empty: none
  std::optional<FoxgloveOptions> foxglove;  ///< empty: no Foxglove server
};

/// Serves until SIGINT or SIGTERM, on the calling thread. Recordings that are being made are then finished.
/// \throws client::Failure if an address cannot be used, Error kBadEndpoint if an instance's name is invalid
/// \param sources one per sensor
/// \param ready is called with each URL that is served, when all are, before requests are answered
void serve(const ServerOptions& options, const std::vector<SourceOptions>& sources,
           const std::function<void(const std::string& url)>& ready);

}  // namespace traction::view
