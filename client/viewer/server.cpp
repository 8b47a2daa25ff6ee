#include "client/viewer/server.h"

#include "client/files/file_error.h"
#include "client/show/json_writer.h"
#include "client/show/receiver.h"
#include "client/viewer/foxglove_server.h"
#include "client/viewer/http_listener.h"
#include "client/viewer/hub.h"
#include "client/viewer/page.h"
#include "client/viewer/refusals.h"
#include "client/viewer/setup.h"

#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/http.hpp>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <csignal>
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

/// Permits scripts, pictures, styles and connections of this server alone, and no frame around the page.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; media-src blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

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

/// Returns the state of a recording. \param file its name; empty: none is being made
Frame recorderFrame(const std::string& file, const std::string& account, const std::string& error) {
  client::Json json;
  json.open('{').key("file").string(file).key("account").string(account).key("error").string(error).close('}');
  return makeFrame("view/recorder", json.take());
}

class Server {
 public:
  Server(const ServerOptions& options, const std::vector<SourceOptions>& sources)
      : options_(options)
      , listener_(context_, {options.listen, "--listen", options.connections},
                  [this](const Request& request, const auto& take) { return handle(request, take); }) {
    if (options.foxglove) foxglove_.emplace(context_, *options.foxglove, options.names, sources);
    for (const SourceOptions& each : sources) {
      hubs_.push_back(std::make_unique<Hub>(context_));
      Hub& hub = *hubs_.back();
      hub.options = each;
      if (each.control) hub.control.emplace(*each.control);
    }
    if (!options.setup.empty()) {
      std::error_code unknown;
      const auto here = std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path();
      setup_.emplace(options.setup, sources.front().control.value(), here / "traction-lens");
    }
  }

  ~Server() {
    for (const auto& show : shows_) show->stop();           // all before the first is waited for
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
    Response response{http::status::ok, request.version()};
    response.keep_alive(request.keep_alive());
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    response.set("Cross-Origin-Opener-Policy", "same-origin");
    response.set("Referrer-Policy", "no-referrer");
    response.set("Content-Security-Policy", kPolicy);
    response.set(http::field::cache_control, "no-cache");
    const auto refuse = [&](http::status status, const std::string& why) {
      response.result(status);
      response.set(http::field::content_type, "text/plain; charset=utf-8");
      response.body() = why + "\n";
    };
    const auto host = request[http::field::host];
    const auto origin = request[http::field::origin];
    if (!isAllowedHost({host.data(), host.size()}, options_.names)) {
      refusals_.print(unknownHost({host.data(), host.size()}));
      refuse(http::status::misdirected_request, "Unknown host name; traction-view --name HOST allows it.");
    } else if (!origin.empty() && origin != "http://" + std::string(host) && origin != "https://" + std::string(host)) {
      const std::string why = otherOrigin({origin.data(), origin.size()}, {host.data(), host.size()});
      refusals_.print(why);
      refuse(http::status::forbidden, why + ".");
    } else if (request.method() != http::verb::get && request.method() != http::verb::head) {
      refuse(http::status::method_not_allowed, "Only GET and HEAD are supported.");
    } else if (beast::websocket::is_upgrade(request)) {
      const bool unknown = findHub(path) == nullptr && findRecording(path).empty();
      if (!unknown && !isFull()) {
        upgrade(request, take());
        return std::nullopt;
      }
      refuse(unknown ? http::status::not_found : http::status::service_unavailable,
             unknown ? "No such sensor or recording." : "Too many viewers are connected.");
    } else if (path == "/sensors") {
      response.set(http::field::content_type, "application/json");
      response.body() = sensors();
    } else if (path == "/recordings" && hasRecordings()) {
      response.set(http::field::content_type, "application/json");
      response.body() = recordings();
    } else if (setup_ && path.starts_with(kSetupFiles)) {
      SetupFile file = setup_->file(path.substr(kSetupFiles.size()));
      if (file.content.empty()) {
        refuse(http::status::not_found, "Not found.");
      } else {
        response.set(http::field::content_type, file.type);
        response.body() = std::move(file.content);
      }
    } else if (const PageFile* file = findPageFile(path)) {
      response.set(http::field::content_type, boost::string_view(file->type.data(), file->type.size()));
      response.set(http::field::content_encoding, "gzip");
      response.body() = std::string(file->gzip);
    } else {
      refuse(http::status::not_found, "Not found.");
    }
    if (request.method() == http::verb::head) {
      response.content_length(response.body().size());
      response.body().clear();
    } else {
      response.prepare_payload();
    }
    return response;
  }

  void upgrade(const Request& request, tcp::socket&& socket) {
    const std::string_view target(request.target().data(), request.target().size());
    const std::size_t mark = target.find('?');
    const std::string_view query = mark == std::string_view::npos ? std::string_view() : target.substr(mark + 1);
    const std::string_view path = target.substr(0, mark);
    if (Hub* hub = findHub(path)) {
      open(*hub, std::move(socket), request, parseSession(query));
    } else {
      openRecording(findRecording(path), std::move(socket), request, parseSession(query));
    }
  }

  std::string sensors() const {
    const bool records = hasRecordings() && !options_.readOnly;
    client::Json json;
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
    return viewers + shows_.size() + endingShows_ >= options_.viewers;
  }

  bool hasRecordings() const { return !options_.recordings.empty(); }

  std::string recordings() const {
    client::Json json;
    json.open('{').key("recordings").open('[');
    for (const RecordingFile& each : recordingsIn(options_.recordings)) {
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
    auto show = std::make_shared<Show>(context_);
    const std::weak_ptr<Show> seen = show;
    show->session = std::make_shared<Session>(
        std::move(socket), wanted,
        Session::Handlers{
            .ask =
                [](Session& from, const std::string& id, const std::string&) {
                  from.answer(makeFrame("error/" + id, "refused a recording cannot be asked"));
                },
            .play =
                [seen](double from_s, double speed) {
                  const auto still = seen.lock();
                  if (still && still->playing) still->playing->play(from_s, speed);
                },
            .gone = [this](const Session* gone) { asio::post(context_, [this, gone] { endShow(gone); }); }});
    const auto deliver = [seen](unsigned kind, const Frame& frame) {
      const auto still = seen.lock();
      if (still) still->backlog.post([still, kind, frame] { still->session->offer(kind, frame); });
    };
    shows_.push_back(show);
    show->session->start(request);
    try {
      show->playing = std::make_unique<Playing>(file, deliver);
      show->playing->want(wanted.kinds);
    } catch (const client::FileError& error) {
      show->session->offer(kErrors, makeFrame("error", std::string("malformed ") + error.what()));
    } catch (const std::system_error& error) {  // no thread for it; the others go on
      show->session->offer(kErrors,
                           makeFrame("error", std::string("refused no thread can be started for it: ") + error.what()));
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
    hub.used = Clock::now();
    const unsigned previews = (wanted.kinds & (unsigned{kPreview} | kPicture)) != 0 ? unsigned{kPreview} : 0U;
    const unsigned more = previews | (wanted.kinds & kOfTouch);
    const bool wantsMore = (more & ~hub.options.subscription.topics) != 0;
    hub.options.subscription.topics |= more;
    if (!hub.source || wantsMore) start(hub);
    hub.wanted |= wanted.kinds;
    if (hub.source) hub.forwarder->want(hub.wanted);
    for (const auto& [kind, frame] : hub.last) session->offer(kind, frame);
    session->start(request);
  }

  void tick() {
    timer_.expires_after(1s);
    timer_.async_wait([this](error_code) {
      for (const auto& hub : hubs_) {
        if (!hub->sessions.empty()) hub->used = Clock::now();
        tellRecording(*hub);
        if (hub->source && Clock::now() - hub->used > kLinger) {
          hub->source.reset();
          hub->options.subscription.topics = kAllTopics;  // the daemon makes previews only while they are subscribed to
          hub->wanted = 0;
          hub->last.clear();
        }
      }
      tick();
    });
  }

  void endShow(const Session* gone) {
    shows_.remove_if([&](const std::shared_ptr<Show>& each) {
      if (each->session.get() != gone) return false;
      each->stop();
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

  void start(Hub& hub) {
    const auto deliver = [&hub](unsigned kind, const Frame& frame) {
      hub.backlog.post([&hub, kind, frame] { hub.deliver(kind, frame); });
    };
    hub.source.reset();  // waits for the thread that uses the two
    hub.forwarder = std::make_unique<Forwarder>(deliver);
    hub.health = std::make_unique<HealthFeed>(deliver);
    try {
      hub.source = std::make_unique<Source>(
          hub.options.subscription,
          Source::Handlers{
              .pass =
                  [&hub](const Message& message, const Raw& raw) {
                    hub.forwarder->pass(message, raw);
                    hub.health->take(message);
                  },
              .turn = [&hub](bool isConnected) { hub.health->turn(isConnected, client::nanoseconds(Clock::now())); },
              .fail =
                  [deliver](const Error& error, const Raw& raw) {
                    // Forwards a message that this program cannot decode, as the client may be able to.
                    deliver(kErrors, raw.bytes.empty() ? errorFrame(error) : makeFrame(raw.topic, raw.bytes));
                  }});
    } catch (const Error& error) {
      hub.deliver(kErrors, errorFrame(error));
    }
  }

  /// Answers "record" and "stop".
  void askRecorder(Hub& hub, Session& from, const std::string& id, bool begins) {
    const auto refuse = [&](const std::string& why) { from.answer(makeFrame("error/" + id, why)); };
    if (!hasRecordings()) return refuse("refused this viewer has no directory for recordings (--recordings)");
    if (options_.readOnly) return refuse("not_allowed this viewer only reads (--read-only)");
    if (begins == (hub.recording != nullptr)) {
      return refuse(begins ? "refused it is being recorded: " + hub.recording->name()
                           : "refused nothing is being recorded");
    }
    try {
      if (begins) {
        const std::filesystem::path file = std::filesystem::path(options_.recordings) / recordingName(hub.options.name);
        hub.recording = std::make_shared<Recording>(hub.options.subscription, file);
        from.answer(makeFrame("done/" + id, hub.recording->name()));
        return tellRecording(hub);
      }
    } catch (const client::FileError& error) {
      return refuse(std::string("refused ") + error.what());
    } catch (const Error& error) {
      return refuse(std::string(nameOf(error.code())) + ' ' + error.what());
    }
    asio::post(hub.asker,
               [this, &hub, id, ended = std::exchange(hub.recording, nullptr), session = from.weak_from_this()] {
                 const Recording::State last = ended->finish();  // waits for the disk
                 asio::post(context_, [&hub, id, last, name = ended->name(), session] {
                   hub.deliver(kRecorder, recorderFrame("", "", last.error.value_or("")));
                   hub.last.erase(kRecorder);
                   if (const auto still = session.lock())
                     still->answer(makeFrame("done/" + id, name + ": " + last.account));
                 });
               });
  }

  /// Answers a step of a setup on a thread of its own, one at a time: it may take minutes.
  void askSetup(Session& from, const std::string& id, const std::string& request) {
    const auto refuse = [&](const std::string& why) { from.answer(makeFrame("error/" + id, why)); };
    if (!setup_) return refuse("refused this viewer offers no setup (--setup FOLDER)");
    if (request.empty()) return from.answer(makeFrame("done/" + id, setup_->state()));
    if (std::exchange(isSettingUp_, true)) return refuse("refused another step is being carried out; wait for its end");
    asio::post(setter_, [this, id, request, session = from.weak_from_this()] {
      Frame frame;
      try {
        frame = makeFrame("done/" + id, setup_->carryOut(request));
      } catch (const Error& error) {
        frame = makeFrame("error/" + id, std::string(nameOf(error.code())) + ' ' + error.what());
      }
      asio::post(context_, [this, frame, session] {
        isSettingUp_ = false;
        if (const auto still = session.lock()) still->answer(frame);
      });
    });
  }

  /// Answers a question on the sensor's own thread, as an answer may take seconds.
  void ask(Hub& hub, Session& from, const std::string& id, const std::string& word) {
    constexpr std::array<std::pair<std::string_view, Question>, 4> kQuestionNames = {
        {{"status", Question::kStatus},
         {"describe", Question::kDescription},
         {"zero", Question::kZero},
         {"undo", Question::kUndoZero}}};
    const auto* found =
        std::find_if(kQuestionNames.begin(), kQuestionNames.end(), [&](const auto& one) { return one.first == word; });
    if (word == "record" || word == "stop") return askRecorder(hub, from, id, word == "record");
    constexpr std::string_view kSetup = "setup";
    if (word.starts_with(kSetup)) return askSetup(from, id, word.substr(std::min(word.size(), kSetup.size() + 1)));
    const bool changes = word == "zero" || word == "undo";
    const auto refuse = [&](const std::string& why) { from.answer(makeFrame("error/" + id, why)); };
    if (found == kQuestionNames.end()) return refuse("refused there is no such question");
    if (!hub.control) return refuse("no_answer no endpoint for requests is known (traction-view --control)");
    if (changes && options_.readOnly) return refuse("not_allowed this viewer only reads (--read-only)");
    if (hub.questions >= kQuestions) return refuse("refused too many requests are waiting; try again");
    ++hub.questions;
    asio::post(hub.asker, [this, &hub, id, question = found->second, session = from.weak_from_this()] {
      Frame frame;
      try {
        frame = makeFrame("reply/" + id, hub.control->pass(question));
      } catch (const Error& error) {
        frame = makeFrame("error/" + id, std::string(nameOf(error.code())) + ' ' + error.what());
      }
      asio::post(context_, [&hub, frame, session] {
        --hub.questions;
        if (const auto still = session.lock()) still->answer(frame);
      });
    });
  }

  ServerOptions options_;
  Refusals refusals_;
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
