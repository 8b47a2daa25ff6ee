// The page and its WebSockets. The only room that knows Boost.Beast.
#pragma once

#include "client/viewer/source.h"

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace traction::view {

struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 9880;       ///< 0: any that is free
  std::vector<std::string> names;  ///< of this host, that browsers may call it by beside its addresses and localhost
  bool readOnly = false;           ///< browsers may ask for no zero, and record nothing
  std::string recordings;          ///< directory of those that are shown, and where new ones go; empty: none
  unsigned connections = 256;      ///< at a time; for a new one the oldest is ended that asks for nothing
  unsigned viewers = 64;           ///< WebSockets of these, at a time
};

/// With an exit code of sysexits.h.
class ServerError : public std::runtime_error {
 public:
  ServerError(int exitCode, const std::string& what)
      : std::runtime_error(what)
      , exitCode_(exitCode) {}
  int exitCode() const { return exitCode_; }

 private:
  int exitCode_;
};

bool isLoopback(const std::string& address);

/// Serves until SIGINT or SIGTERM. \throws ServerError, Error
/// \param ready is told the page's address
void serve(const ServerOptions& options, const std::vector<SourceOptions>& sources,
           const std::function<void(const std::string& url)>& ready);

}  // namespace traction::view
