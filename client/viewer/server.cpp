#include "client/viewer/server.h"

#include "base/json_writer.h"
#include "base/printable.h"
#include "client/files/failure.h"
#include "client/show/receiver.h"
#include "client/viewer/foxglove_server.h"
#include "client/viewer/http_listener.h"
#include "client/viewer/hub.h"
#include "client/viewer/page.h"
#include "client/viewer/setup.h"

#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/http.hpp>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <csignal>
#include <map>
#include <system_error>

namespace traction::view {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using beast::error_code;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// A source runs on for this long without sessions, for a page that is reloaded.
constexpr auto kLinger = 10s;
/// Questions to one sensor that wait for an answer; further ones are refused.
constexpr int kQuestions = 8;

constexpr std::size_t kMostViewers = 64;  // WebSockets of the page at a time

/// Paths of the setup's files begin with this.
constexpr std::string_view kSetupFiles = "/setup/";

/// Decodes the percent escapes of a URL's path: "a%20b". Keeps malformed escapes as they are.
std::string unescaped(std::string_view path) {
  std::string text;
  for (std::size_t i = 0; i < path.size(); ++i) {
    unsigned char byte = 0;
    const auto* digits = path.data() + i + 1;
    const bool isEscape =
        path[i] == '%' && i + 2 < path.size() && std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
    text += isEscape ? static_cast<char>(byte) : path[i];
    if (isEscape) i += 2;
  }
  return text;
}

/// Returns the state of a recording.
/// \param file its name; empty: none is being made
Frame recorderFrame(const std::string& file, const std::string& account, const std::string& error) {
  JsonWriter json;
  json.open('{').key("file").string(file).key("account").string(account).key("error").string(error).close('}');
  return makeFrame("view/recorder", json.take());
}

class Server {
 public:
  Server(const ServerOptions& options, const std::vector<SourceOptions>& sources)
      : options_(options)
      , listener_(context_, options.listen, "--listen", options.names,
                  [this](const Request& request, const auto& take) { return handle(request, take); }) {
    for (const SourceOptions& each : sources) {
      hubs_.push_back(std::make_unique<Hub>());
      Hub& hub = *hubs_.back();
      hub.options = each;
      if (each.control) hub.control.emplace(*each.control);
      hub.forwarder = std::make_unique<Forwarder>(deliverTo(hub));
    }
    if (options.foxglove) {
      foxglove_.emplace(context_, *options.foxglove, options.names, hubs_,
                        [this](Hub& hub, unsigned topics) { receive(hub, topics); });
    }
    if (!options.setup.empty()) {
      std::error_code unknown;
      const auto here = std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path();
      setup_.emplace(options.setup, sources.front().control.value(), here / "traction-lens");
    }
  }

  ~Server() {
    setter_.stop();
    if (setup_) setup_->cancel();  // its thread is waited for
    for (const auto& show : shows_) {
      if (show->playing) show->playing->stop();  // all before the first is waited for
    }
    for (const auto& show : shows_) show->playing.reset();  // its thread uses the show
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::vector<std::string> urls() const {
    std::vector<std::string> urls = {"http://" + listener_.authority() + (setup_ ? "/#setup" : "/")};
    if (foxglove_) urls.push_back(foxglove_->url());
    return urls;
  }

  void run() {
    asio::signal_set signals(context_, SIGINT, SIGTERM);
    signals.async_wait([this](error_code, int) { context_.stop(); });
    listener_.start();
    if (foxglove_) foxglove_->start();
    tick();
    context_.run();
  }

 private:
  std::optional<Response> handle(const Request& request, const std::function<tcp::socket()>& take) {
    const std::string_view target(request.target().data(), request.target().size());
    const std::string_view path = target.substr(0, target.find('?'));
    const auto refuse = [&](http::status status, const std::string& why) { return refusalOf(request, status, why); };
    const std::string host(headerOf(request, http::field::host)), origin(headerOf(request, http::field::origin));
    if (!origin.empty() && origin != "http://" + host && origin != "https://" + host) {
      const std::string why =
          "refused a request of a page of '" + origin.substr(0, 200) + "' to the host '" + host.substr(0, 200) +
          "' (headers Origin and Host): they must be the same. A proxy must pass on the Host that the browser sent, "
          "with its port (nginx: proxy_set_header Host $http_host)";
      printRefusal(why);
      return refuse(http::status::forbidden, why + ".");
    }
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return refuse(http::status::method_not_allowed, "Only GET and HEAD are supported.");
    if (beast::websocket::is_upgrade(request)) {
      Hub* const hub = findHub(path);
      const std::filesystem::path file = findRecording(path);
      if (hub == nullptr && file.empty()) return refuse(http::status::not_found, "No such sensor or recording.");
      if (isFull()) return refuse(http::status::service_unavailable, "Too many viewers are connected.");
      const SessionOptions wanted = parseSession(target.substr(std::min(path.size() + 1, target.size())));
      hub != nullptr ? open(*hub, take(), request, wanted) : openRecording(file, take(), request, wanted);
      return std::nullopt;
    }
    if (path == "/sensors") return answerWith(request, "application/json", sensors());
    if (path == "/recordings" && hasRecordings()) return answerWith(request, "application/json", recordings());
    if (setup_ && path.starts_with(kSetupFiles)) {
      SetupFile file = setup_->file(path.substr(kSetupFiles.size()));
      if (!file.content.empty()) return answerWith(request, file.type, std::move(file.content));
    } else if (const PageFile* file = findPageFile(path)) {
      Response response = answerWith(request, file->type, std::string(file->gzip));
      response.set(http::field::content_encoding, "gzip");
      return response;
    }
    return refuse(http::status::not_found, "Not found.");
  }

  std::string sensors() const {
    const bool records = hasRecordings() && !options_.readOnly;
    JsonWriter json;
    json.open('{').key("version").string(TRACTION_VERSION).key("recordings").boolean(hasRecordings());
    json.key("flags").open('{');
    for (const client::FlagText& each : client::kFlagTexts) json.key(each.name).string(each.words);
    json.close('}').key("sensors").open('[');
    for (std::size_t i = 0; i < hubs_.size(); ++i) {
      json.open('{').key("name").string(hubs_[i]->options.name);
      json.key("stream").string("/stream/" + std::to_string(i));
      json.key("control").boolean(!options_.readOnly && hubs_[i]->control.has_value());
      json.key("setup").boolean(setup_.has_value());
      json.key("record").boolean(records).close('}');
    }
    return json.close(']').close('}').take() + "\n";
  }

  Hub* findHub(std::string_view path) {
    constexpr std::string_view kStream = "/stream/";
    if (path.substr(0, kStream.size()) != kStream) return nullptr;
    path.remove_prefix(kStream.size());
    std::size_t index = 0;
    const auto [end, bad] = std::from_chars(path.data(), path.data() + path.size(), index);
    return bad == std::errc() && end == path.data() + path.size() && index < hubs_.size() ? hubs_[index].get()
                                                                                          : nullptr;
  }

  bool isFull() const {
    std::size_t viewers = 0;
    for (const auto& hub : hubs_) viewers += hub->sessions.size();
    return viewers + shows_.size() + endingShows_ >= kMostViewers;
  }

  bool hasRecordings() const { return !options_.recordings.empty(); }

  std::string recordings() const {
    JsonWriter json;
    json.open('{').key("recordings").open('[');
    for (const RecordingFile& each : recordingsIn(options_.recordings)) {
      if (printable(each.name) != each.name) continue;  // JSON is UTF-8
      json.open('{').key("name").string(each.name).key("bytes").number(each.bytes).close('}');
    }
    return json.close(']').close('}').take() + "\n";
  }

  /// Returns the file of a path /recording/NAME; empty if it is not one of those listed.
  std::filesystem::path findRecording(std::string_view path) const {
    constexpr std::string_view kRecording = "/recording/";
    if (!hasRecordings() || !path.starts_with(kRecording)) return {};
    const std::string name = unescaped(path.substr(kRecording.size()));
    for (const RecordingFile& each : recordingsIn(options_.recordings)) {
      if (each.name == name) return std::filesystem::path(options_.recordings) / each.name;
    }
    return {};
  }

  void openRecording(const std::filesystem::path& file, tcp::socket&& socket, const Request& request,
                     const SessionOptions& wanted) {
    auto show = std::make_shared<Show>();
    const std::weak_ptr<Show> seen = show;
    show->session = std::make_shared<Session>(
        std::move(socket), wanted,
        Session::Handlers{
            .ask =
                [](Session& from, const std::string& id, const std::string&) {
                  from.answer(errorFrame(Error(ErrorCode::kRefused, "a recording cannot be asked"), id));
                },
            .play =
                [seen](double from_s, double speed) {
                  const auto still = seen.lock();
                  if (still && still->playing) still->playing->play(from_s, speed);
                },
            .gone = [this](const Session* gone) { asio::post(context_, [this, gone] { endShow(gone); }); }});
    const auto deliver = [this, seen](unsigned kind, const Frame& frame) {
      asio::post(context_, [seen, kind, frame] {
        if (const auto still = seen.lock()) still->session->offer(kind, frame);
      });
    };
    shows_.push_back(show);
    show->session->start(request);
    try {
      show->playing = std::make_unique<Playing>(file, deliver);
      show->playing->want(wanted.kinds);
    } catch (const client::Failure& error) {
      show->session->offer(kErrors, errorFrame(Error(ErrorCode::kMalformed, error.what())));
    } catch (const std::system_error& error) {  // no thread for it; the others go on
      show->session->offer(kErrors, errorFrame(Error(ErrorCode::kRefused,
                                                     std::string("no thread can be started for it: ") + error.what())));
    }
  }

  void open(Hub& hub, tcp::socket&& socket, const Request& request, const SessionOptions& wanted) {
    auto session = std::make_shared<Session>(
        std::move(socket), wanted,
        Session::Handlers{.ask = [this, &hub](Session& from, const std::string& id,
                                              const std::string& question) { ask(hub, from, id, question); },
                          .play = [](double, double) {},  // a live stream cannot be wound
                          .gone =
                              [&hub](const Session* gone) {
                                hub.sessions.remove_if(
                                    [&](const std::shared_ptr<Session>& each) { return each.get() == gone; });
                              }});
    hub.sessions.push_back(session);
    const unsigned previews = (wanted.kinds & (unsigned{kPreview} | kPicture)) != 0 ? unsigned{kPreview} : 0U;
    receive(hub, kAllTopics | previews | (wanted.kinds & kOfTouch));
    hub.forwarder->want(wanted.kinds);
    for (const auto& [kind, frame] : hub.last) session->offer(kind, frame);
    session->start(request);
  }

  void tick() {
    timer_.expires_after(1s);
    timer_.async_wait([this](error_code) {
      for (const auto& hub : hubs_) {
        if (!hub->sessions.empty() || (foxglove_ && foxglove_->hasClients())) hub->used = Clock::now();
        tellRecording(*hub);
        if (hub->source && Clock::now() - hub->used > kLinger) {
          hub->source.reset();
          hub->forwarder = std::make_unique<Forwarder>(deliverTo(*hub));  // surface and pictures are wanted no more
          hub->options.subscription.topics = kAllTopics;  // the daemon makes previews only while they are subscribed to
          hub->last.clear();
        }
      }
      tick();
    });
  }

  void endShow(const Session* gone) {
    shows_.remove_if([&](const std::shared_ptr<Show>& each) {
      if (each->session.get() != gone) return false;
      if (!each->playing) return true;
      each->playing->stop();
      // On another thread, as the destructor waits for a surface that is being computed. Counts as a viewer until then.
      ++endingShows_;
      asio::post(reaper_, [this, ended = std::shared_ptr<Playing>(std::move(each->playing))]() mutable {
        ended.reset();
        --endingShows_;
      });
      return true;
    });
  }

  /// Sends the state of the recording to all sessions.
  void tellRecording(Hub& hub) {
    if (!hub.recording) return;
    const Recording::State now = hub.recording->state();
    hub.deliver(kRecorder, recorderFrame(hub.recording->name(), now.account, now.error.value_or("")));
    if (!now.error) return;
    hub.recording.reset();
    hub.last.erase(kRecorder);
  }

  /// Returns what passes frames from the thread of the hub's source.
  Deliver deliverTo(Hub& hub) {
    return [this, &hub](unsigned kind, const Frame& frame) {
      asio::post(context_, [&hub, kind, frame] { hub.deliver(kind, frame); });
    };
  }

  /// Has a hub receive these topics (or-ed) at least, until it has not been used for a while.
  void receive(Hub& hub, unsigned topics) {
    hub.used = Clock::now();
    unsigned& subscribed = hub.options.subscription.topics;
    if (hub.source && (topics & ~subscribed) == 0) return;
    subscribed |= topics;
    hub.source.reset();  // waits for the thread that uses the others
    hub.health = std::make_unique<HealthFeed>(deliverTo(hub));
    try {
      hub.source = std::make_unique<Source>(
          hub.options.subscription,
          Source::Handlers{
              .pass =
                  [&hub](const Message& message, const Raw& raw) {
                    hub.forwarder->pass(message, raw);
                    hub.health->take(message);
                    if (hub.converter) hub.converter->pass(message, raw);
                  },
              .turn = [&hub](bool isConnected) { hub.health->turn(isConnected, client::nanoseconds(Clock::now())); },
              .fail =
                  [this, &hub](const Error& error, const Raw& raw) {
                    // Forwards a message that this program cannot decode, as the client may be able to.
                    const Frame frame = raw.bytes.empty() ? errorFrame(error) : makeFrame(raw.topic, raw.bytes);
                    asio::post(context_, [this, &hub, frame, error] { fail(hub, frame, error); });
                  }});
    } catch (const Error& error) {
      fail(hub, errorFrame(error), error);
    }
  }

  void fail(Hub& hub, const Frame& frame, const Error& error) {
    hub.deliver(kErrors, frame);
    if (foxglove_) foxglove_->tellError(hub, error.what());
  }

  /// Has another thread work, as that may wait; then calls `done`, and answers with the frame that `work` has returned,
  /// or with the Error that it has thrown.
  void answerLater(asio::thread_pool& pool, Session& from, const std::string& id, const std::function<Frame()>& work,
                   const std::function<void()>& done) {
    asio::post(pool, [this, id, work, done, session = from.weak_from_this()] {
      Frame frame;
      try {
        frame = work();
      } catch (const Error& error) {
        frame = errorFrame(error, id);
      }
      asio::post(context_, [done, frame, session] {
        done();
        if (const auto still = session.lock()) still->answer(frame);
      });
    });
  }

  /// Answers "record" and "stop".
  void askRecorder(Hub& hub, Session& from, const std::string& id, bool begins) {
    if (!hasRecordings()) refuse("this viewer has no directory for recordings (--recordings)");
    expectControl();
    if (begins && hub.recording) refuse("it is being recorded: " + hub.recording->name());
    if (!begins && !hub.recording) refuse("nothing is being recorded");
    if (begins) {
      const std::filesystem::path file = std::filesystem::path(options_.recordings) / recordingName(hub.options.name);
      hub.recording = std::make_shared<Recording>(hub.options.subscription, file);
      from.answer(makeFrame("done/" + id, hub.recording->name()));
      return tellRecording(hub);
    }
    const std::shared_ptr<Recording> ended = std::exchange(hub.recording, nullptr);
    answerLater(
        hub.asker, from, id,
        [ended, id] {
          ended->finish();  // waits for the disk
          return makeFrame("done/" + id, ended->name() + ": " + ended->state().account);
        },
        [&hub, ended] {
          hub.deliver(kRecorder, recorderFrame("", "", ended->state().error.value_or("")));
          hub.last.erase(kRecorder);
        });
  }

  /// Answers a step of a setup, one at a time: it may take minutes.
  void askSetup(Session& from, const std::string& id, const std::string& request) {
    if (!setup_) refuse("this viewer offers no setup (--setup FOLDER)");
    if (request.empty()) return from.answer(makeFrame("done/" + id, setup_->state()));
    if (Setup::isCancel(request)) {
      setup_->cancel();
      return from.answer(makeFrame("done/" + id, "{}"));
    }
    if (std::exchange(isSettingUp_, true)) refuse("another step is being carried out; wait for its end");
    answerLater(
        setter_, from, id, [this, id, request] { return makeFrame("done/" + id, setup_->carryOut(request)); },
        [this] { isSettingUp_ = false; });
  }

  /// Passes a question to the daemon.
  void askDaemon(Hub& hub, Session& from, const std::string& id, const std::string& word) {
    static const std::map<std::string_view, Question> kNames = {{"status", Question::kStatus},
                                                                {"describe", Question::kDescription},
                                                                {"zero", Question::kZero},
                                                                {"undo", Question::kUndoZero}};
    const auto found = kNames.find(word);
    if (found == kNames.end()) refuse("there is no such question");
    if (!hub.control) throw Error(ErrorCode::kNoAnswer, "no endpoint for requests is known (traction-view --control)");
    if (word == "zero" || word == "undo") expectControl();
    if (hub.questions >= kQuestions) refuse("too many requests are waiting; try again");
    ++hub.questions;
    answerLater(
        hub.asker, from, id,
        [&hub, id, question = found->second] { return makeFrame("reply/" + id, hub.control->pass(question)); },
        [&hub] { --hub.questions; });
  }

  void ask(Hub& hub, Session& from, const std::string& id, const std::string& word) try {
    constexpr std::string_view kSetup = "setup";
    if (word == "record" || word == "stop") return askRecorder(hub, from, id, word == "record");
    if (word.starts_with(kSetup)) return askSetup(from, id, word.substr(std::min(word.size(), kSetup.size() + 1)));
    askDaemon(hub, from, id, word);
  } catch (const client::Failure& error) {
    from.answer(errorFrame(Error(ErrorCode::kRefused, error.what()), id));
  } catch (const Error& error) {
    from.answer(errorFrame(error, id));
  }

  [[noreturn]] static void refuse(const std::string& why) { throw Error(ErrorCode::kRefused, why); }
  void expectControl() const {
    if (options_.readOnly) throw Error(ErrorCode::kNotAllowed, "this viewer only reads (--read-only)");
  }

  ServerOptions options_;
  asio::io_context context_{1};
  asio::steady_timer timer_{context_};
  HttpListener listener_;
  std::optional<FoxgloveServer> foxglove_;
  std::atomic<std::size_t> endingShows_{0};  ///< whose threads have not ended yet
  asio::thread_pool reaper_{1};
  std::optional<Setup> setup_;  ///< of the only sensor
  bool isSettingUp_ = false;    ///< a step of the setup is being carried out
  asio::thread_pool setter_{1};
  std::list<std::shared_ptr<Show>> shows_;
  std::vector<std::unique_ptr<Hub>> hubs_;  // last, as their threads use the context
};

}  // namespace

void serve(const ServerOptions& options, const std::vector<SourceOptions>& sources,
           const std::function<void(const std::string& url)>& ready) {
  Server server(options, sources);
  for (const std::string& url : server.urls()) ready(url);
  server.run();
}

}  // namespace traction::view
