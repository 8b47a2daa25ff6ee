// Serves what sensors publish, live, by the Foxglove WebSocket protocol, for Foxglove and Lichtblick. Only publishes.
#pragma once

#include "client/viewer/foxglove_session.h"
#include "client/viewer/http_listener.h"
#include "client/viewer/hub.h"
#include "client/viewer/server.h"

#include <boost/asio/io_context.hpp>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace traction::view {

/// Thread-bound: runs on the context's single thread. Prints origins that it refuses on standard error.
class FoxgloveServer {
 public:
  /// Has a sensor received, with these topics (or-ed) at least.
  using Need = std::function<void(Hub& hub, unsigned topics)>;

  /// Binds and listens; accepts no connection before start(). Gives each hub its converter.
  /// \param context must outlive the server, and must no longer run when it is destroyed
  /// \param hostNames names of this host that requests may use besides IP addresses and localhost
  /// \param hubs must not move
  /// \throws client::Failure if the address cannot be used
  FoxgloveServer(boost::asio::io_context& context, const FoxgloveOptions& options,
                 const std::vector<std::string>& hostNames, const std::vector<std::unique_ptr<Hub>>& hubs, Need need);
  FoxgloveServer(const FoxgloveServer&) = delete;
  FoxgloveServer& operator=(const FoxgloveServer&) = delete;

  /// Starts accepting clients, and returns at once; they are served while the context runs. Must be called once.
  void start() { listener_.start(); }
  /// Returns the URL that clients connect to, with the port in use: "ws://127.0.0.1:8765".
  std::string url() const { return "ws://" + listener_.authority(); }
  bool hasClients() const { return !sessions_.empty(); }

  /// Reports an error of a hub's endpoint to all clients, unless it is the one that was reported last.
  void tellError(const Hub& hub, const std::string& what);

 private:
  using Clock = std::chrono::steady_clock;

  /// What one endpoint publishes: usually one sensor.
  struct Feed {
    Hub* hub = nullptr;
    std::set<std::string> sensors;  ///< that are advertised, or refused
    std::string error;              ///< sent last; empty: none
    Clock::time_point failed;       ///< when there was an error last
  };
  struct ChannelState {
    foxglove::Channel channel;
    Feed* feed = nullptr;
    unsigned kind = 0;
    unsigned subscribers = 0;
    std::map<unsigned, foxglove::Sample> lasting;  ///< by slot
  };

  std::optional<Response> handle(const Request& request, const std::function<boost::asio::ip::tcp::socket()>& take);
  void open(const Request& request, std::string_view subprotocol, boost::asio::ip::tcp::socket&& socket);
  std::string subscribe(foxglove::Session& session, std::uint32_t channel);
  void unsubscribe(std::uint32_t channel);
  /// Has those kinds converted that are subscribed to.
  void update(const Feed& feed);
  void deliver(Feed& feed, const foxglove::Sample& sample);
  void advertise(Feed& feed, const std::string& sensor);
  void tellAll(const std::string& text);

  FoxgloveOptions options_;
  HttpListener listener_;
  Need need_;
  std::string session_;  ///< identifies this start of the program
  std::list<std::shared_ptr<foxglove::Session>> sessions_;
  std::vector<ChannelState> channels_;        ///< by id
  std::map<std::string, std::uint32_t> ids_;  ///< of channels, by topic
  std::vector<std::string> conflicts_;        ///< of sensors' names, for people
  std::vector<Feed> feeds_;                   ///< does not grow after the constructor
};

}  // namespace traction::view
