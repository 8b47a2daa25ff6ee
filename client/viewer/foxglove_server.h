// Serves what sensors publish, live, by the Foxglove WebSocket protocol, for Foxglove and Lichtblick. Only publishes.
#pragma once

#include "client/viewer/backlog.h"
#include "client/viewer/foxglove_session.h"
#include "client/viewer/http_listener.h"
#include "client/viewer/refusals.h"
#include "client/viewer/server.h"
#include "client/viewer/source.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>

#include <chrono>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace traction::view {

/// Thread-bound: runs on the context's single thread; sources have their own. Prints origins that it refuses on
/// standard error, each once, at most 16.
class FoxgloveServer {
 public:
  /// Binds and listens; accepts no connection before start(), and connects to no source before a client has come.
  /// \param context must outlive the server, and must no longer run when it is destroyed
  /// \param hostNames names of this host that requests may use besides IP addresses and localhost
  /// \throws ServerError if the address cannot be used
  FoxgloveServer(boost::asio::io_context& context, const FoxgloveOptions& options, std::vector<std::string> hostNames,
                 const std::vector<SourceOptions>& sources);
  /// Disconnects from the sources, and waits for their threads.
  ~FoxgloveServer();
  FoxgloveServer(const FoxgloveServer&) = delete;
  FoxgloveServer& operator=(const FoxgloveServer&) = delete;

  /// Starts accepting clients, and returns at once; they are served while the context runs. Must be called once.
  void start();
  /// Returns the URL that clients connect to, with the port in use: "ws://127.0.0.1:8765".
  std::string url() const { return "ws://" + listener_.authority(); }

 private:
  using Clock = std::chrono::steady_clock;

  /// What one endpoint publishes: usually one sensor. Previews have a source of their own, so that starting it
  /// interrupts nothing else.
  struct Feed {
    explicit Feed(boost::asio::io_context& context)
        : backlog(context) {}

    std::size_t number = 0;
    SourceOptions options;
    std::unique_ptr<foxglove::Converter> converter, previewConverter;
    std::unique_ptr<Source> source, previewSource;
    Backlog backlog;
    Clock::time_point previewsWanted;  ///< when a client was subscribed to a picture last
    std::set<std::string> sensors;     ///< that are advertised, or refused
    std::string error;                 ///< told last; empty: none of late
    Clock::time_point failed;          ///< when there was an error last
  };
  struct ChannelState {
    foxglove::Channel channel;
    Feed* feed = nullptr;
    unsigned kind = 0;
    unsigned subscribers = 0;
    std::map<unsigned, foxglove::Sample> lasting;  ///< by slot
    std::deque<foxglove::Sample> lines;            ///< of a log: the last ones
  };

  std::optional<Response> handle(const Request& request, const std::function<boost::asio::ip::tcp::socket()>& take);
  void reportOrigin(const std::string& origin);
  void open(const Request& request, std::string_view subprotocol, boost::asio::ip::tcp::socket&& socket);
  std::string subscribe(foxglove::Session& session, std::uint32_t channel);
  void unsubscribe(std::uint32_t channel);

  void tick();
  /// Starts and stops the sources and conversions of a feed by what is subscribed to.
  void update(Feed& feed);
  std::unique_ptr<foxglove::Converter> makeConverter(Feed& feed);
  std::unique_ptr<Source> makeSource(Feed& feed, unsigned topics, foxglove::Converter& converter);
  void stop(std::unique_ptr<Source>& source, std::unique_ptr<foxglove::Converter>& converter);
  void deliver(Feed& feed, const foxglove::Sample& sample);
  void advertise(Feed& feed, const std::string& sensor);
  void tellError(Feed& feed, const std::string& what);
  void tellAll(const std::string& text);

  FoxgloveOptions options_;
  std::vector<std::string> hostNames_;
  HttpListener listener_;
  boost::asio::steady_timer timer_;
  std::string session_;  ///< identifies this start of the program
  Refusals refusals_;
  std::list<std::shared_ptr<foxglove::Session>> sessions_;
  Clock::time_point connected_;               ///< when there was a session last
  std::vector<ChannelState> channels_;        ///< by id
  std::map<std::string, std::uint32_t> ids_;  ///< of channels, by topic
  std::vector<std::string> conflicts_;        ///< of sensors' names, for people
  std::vector<std::unique_ptr<Feed>> feeds_;
  boost::asio::thread_pool reaper_{1};  // last: ends sources, whose threads use feeds
};

}  // namespace traction::view
