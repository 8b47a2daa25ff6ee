// tractionctl: what a person wants of a running tractiond.

#include "base/network/keys.h"
#include "client/cli/calibrate.h"
#include "client/cli/camera.h"
#include "client/cli/commands.h"
#include "client/cli/keys.h"
#include "client/cli/metrics.h"
#include "client/cli/output.h"
#include "client/cli/parsing.h"
#include "client/cli/recording_commands.h"
#include "client/cli/recordings.h"
#include "client/cli/top.h"
#include "client/doctor/checks.h"
#include "client/src/printable.h"
#include "manual/describe.h"
#include "proto/traction/v1/endpoints.h"

#include <CLI/CLI.hpp>
#include <sysexits.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace traction;
using cli::integer;
using cli::namesOf;
using cli::number;

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  done
  64  the command line is wrong
  65  a recording is cut off or damaged (what is whole of it is read), or is none, or is another sensor's
  66  status: tractiond runs, but no field can come: its camera is lost or not there yet, or there is no gel.
      A file cannot be read
  69  no tractiond is there
  73  a file cannot be created; of a recording also: there is one already
  74  standard output or a file cannot be written: a full disk, a pipe that nobody reads
  75  tractiond could not do it
  76  tractiond speaks another version of the protocol, or a recording is of a newer one
  77  a gateway does not let this key do that, or there is no permission to change keys
  78  a file of keys is wrong)";

int exitCodeOf(ErrorCode code) {
  switch (code) {
  case ErrorCode::kBadEndpoint:
    return EX_USAGE;
  case ErrorCode::kNoAnswer:
    return EX_UNAVAILABLE;
  case ErrorCode::kVersion:
  case ErrorCode::kMalformed:
    return EX_PROTOCOL;
  case ErrorCode::kRefused:
    return EX_TEMPFAIL;
  case ErrorCode::kBadKeys:
    return EX_CONFIG;
  case ErrorCode::kNotAllowed:
    return EX_NOPERM;
  }
  return EX_SOFTWARE;
}

int fail(int exitCode, const std::string& what) {
  constexpr std::size_t kLongest = 2000;  // what was asked may be anybody
  std::cerr << "tractionctl: " << printable(std::string_view(what).substr(0, kLongest)) << '\n';
  return exitCode;
}

/// tractionctl camera [list|get|set|run|white|temperature]
class CameraCommand {
 public:
  explicit CameraCommand(CLI::App& app)
      : camera_(*app.add_subcommand("camera", "Looks at the camera's features and changes them while it runs; alone: "
                                              "what is configured or was changed, and how warm it is")) {
    camera_.require_subcommand(0, 1);
    camera_.add_flag("--json", json_, "as JSON");
    camera_.footer("A change lasts until the camera is opened again. What is to stay belongs into [camera] of the "
                   "configuration.");
    list_->add_option("part", part_, "of their names, in capitals or not; without: all");
    list_->add_option("--category", categories_, "only those in it, AnalogControl say; may be given again")
        ->type_name("NAME");
    get_->add_option("names", words_, "ExposureTime, BalanceRatio[Red]");
    set_->add_option("changes", words_, "ExposureTime=4000, one after another");
    run_->add_option("names", words_, "of commands, one after another");
    for (CLI::App* one : {list_, get_, set_, run_, white_, temperature_}) one->add_flag("--json", json_, "as JSON");
  }

  explicit operator bool() const { return camera_.parsed(); }

  /// An exit code.
  int run(const ControlOptions& control) const {
    if (camera_.get_subcommands().empty()) return cli::cameraSummary(control, json_), EX_OK;
    for (const auto& [command, example] :
         {std::pair{get_, "ExposureTime"}, {set_, "ExposureTime=4000"}, {run_, "UserSetLoad"}}) {
      if (!command->parsed() || !words_.empty()) continue;
      return fail(EX_USAGE, "which? tractionctl camera " + command->get_name() + " " + example + ", say");
    }
    std::vector<CameraStep> steps;
    for (const std::string& word : words_) {
      CameraStep step;
      step.kind = get_->parsed() ? CameraStep::Kind::kRead : CameraStep::Kind::kExecute;
      step.name = word;
      if (set_->parsed()) {
        const auto write = cli::parseWrite(word);
        if (!write) return fail(EX_USAGE, "'" + word + "' is not NAME=VALUE; write " + cli::asWrites(words_) + ", say");
        step = *write;
      }
      steps.push_back(step);
    }
    if (steps.empty()) steps.emplace_back();
    if (list_->parsed()) steps[0].matching = part_;
    if (list_->parsed()) steps[0].categories = categories_;
    if (temperature_->parsed()) steps[0].matching = "temperature";
    if (white_->parsed()) steps[0].kind = CameraStep::Kind::kBalanceWhite;
    return cli::camera(control, steps, json_), EX_OK;
  }

 private:
  CLI::App& camera_;
  CLI::App* list_ = camera_.add_subcommand("list", "Lists features with their values and ranges");
  CLI::App* get_ = camera_.add_subcommand("get", "Tells all about some features");
  CLI::App* set_ = camera_.add_subcommand("set", "Writes features");
  CLI::App* run_ = camera_.add_subcommand("run", "Has the camera carry out commands, to their end");
  CLI::App* white_ = camera_.add_subcommand("white", "Balances white once: what is seen now is grey");
  CLI::App* temperature_ = camera_.add_subcommand("temperature", "Tells how warm the camera is");
  bool json_ = false;
  std::string part_;
  std::vector<std::string> categories_, words_;
};

/// Through which gateway: --host, --key, --server-key.
class Remote {
 public:
  explicit Remote(CLI::App& app) {
    app.add_option("--host", host_, "of a traction-gateway, HOST or HOST:PORT of its stream, instead of this machine")
        ->type_name("HOST");
    app.add_option("--key", file_, "file of your key; without: ~/.config/traction/key")->type_name("FILE");
    app.add_option("--server-key", serverKey_, "of the gateway, as tractionctl keys tells it on its box")
        ->type_name("KEY");
  }

  const std::filesystem::path& file() const { return file_; }

  /// \param latest the newest field alone is wanted
  void apply(SubscriberOptions& subscription, ControlOptions& control, bool latest) const {
    if (!host_.empty()) {
      std::string host = host_;
      int port = kGatewayPort;
      const std::size_t colon = host_.rfind(':');
      if (colon != std::string::npos && host_.back() != ']') {
        const auto [end, error] = std::from_chars(&host_[colon + 1], &*host_.end(), port);
        if (error != std::errc() || end != &*host_.end() || port < 1 || port > 65533) {
          throw Error(ErrorCode::kBadEndpoint, "'" + host_ + "' is not HOST or HOST:PORT");
        }
        host.resize(colon);
      }
      const auto at = [&](int offset) { return "tcp://" + host + ":" + std::to_string(port + offset); };
      if (subscription.endpoint.empty()) subscription.endpoint = at(latest ? 1 : 0);
      if (control.endpoint.empty()) control.endpoint = at(2);
    }
    if (!host_.empty() || !file_.empty() || !serverKey_.empty()) {
      subscription.keys = control.keys = cli::keysFor(serverKey_, file_);
    }
  }

 private:
  std::string host_, serverKey_;
  std::filesystem::path file_;
};

/// tractionctl keys new|allow|revoke|list
class KeysCommand {
 public:
  explicit KeysCommand(CLI::App& app)
      : keys_(*app.add_subcommand("keys", "Who may come in through a traction-gateway")) {
    keys_.require_subcommand(0, 1);
    for (CLI::App* one : {new_, allow_, revoke_})
      one->add_option("name", name_, "of a person or a program")->required();
    allow_->add_option("key", key_, "its public key, in single quotes")->required();
    allow_->add_flag("--control", control_, "also zero, calibrate, the camera; else it may only read");
    list_->add_flag("--json", json_, "as JSON");
    for (CLI::App* one : {allow_, revoke_, list_}) {
      one->add_option("--directory", directory_, "of the keys")->type_name("DIR")->capture_default_str();
    }
  }

  explicit operator bool() const { return keys_.parsed(); }

  /// An exit code.
  int run(const std::filesystem::path& file) const {
    if (keys_.get_subcommands().empty()) {
      return fail(EX_USAGE, "keys of what? " + namesOf(keys_) + "; see tractionctl keys --help");
    }
    if (new_->parsed()) cli::newKey(name_, file.empty() ? cli::usualKeyFile() : std::filesystem::absolute(file));
    if (allow_->parsed()) cli::allowKey(directory_, name_, key_, control_);
    if (revoke_->parsed()) cli::revokeKey(directory_, name_);
    if (list_->parsed()) cli::listKeys(directory_, json_);
    return EX_OK;
  }

 private:
  CLI::App& keys_;
  CLI::App* new_ = keys_.add_subcommand("new", "Makes a key of your own, and says how the box allows it");
  CLI::App* allow_ = keys_.add_subcommand("allow", "On the box: lets somebody in, and says how he connects");
  CLI::App* revoke_ = keys_.add_subcommand("revoke", "On the box: lets somebody in no more, and ends his connections");
  CLI::App* list_ = keys_.add_subcommand("list", "On the box: its own key, and who may do what");
  std::string name_, key_;
  std::filesystem::path directory_ = tractiond::network::kKeyDirectory;
  bool control_ = false, json_ = false;
};

/// An exit code of its own. \param instance empty: all of this machine
int runDoctor(const std::string& instance, bool json) {
  std::error_code unknown;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", unknown).replace_filename("tractiond");
  const doctor::Box box;
  const auto findings =
      doctor::examine(box, std::filesystem::exists(own, unknown) ? own.string() : "tractiond", instance);
  std::string text = json ? doctor::reportJson(findings) : doctor::reportText(findings);
  if (text.back() == '\n') text.pop_back();
  cli::printLine(text);
  return doctor::exitCodeOf(findings);
}

}  // namespace

int main(int argc, char** argv) try {
  cli::rememberOutputErrors();
  SubscriberOptions subscription;
  ControlOptions control;
  std::string instance = subscription.instance;
  double seconds = cli::kForever;
  long count = -1;
  bool json = false;
  std::string topic = "field";

  CLI::App app("Watches and commands a running tractiond.", "tractionctl");
  app.set_version_flag("--version", "tractionctl " TRACTION_VERSION);
  app.require_subcommand(0, 1);  // asked for below: a wrong word is named first
  app.fallthrough();
  app.footer(kExitCodes);
  manual::describable(app);
  app.add_option("--instance", instance, "of tractiond on this machine")->type_name("INSTANCE")->capture_default_str();
  app.add_option("--connect", subscription.endpoint, "ZeroMQ endpoint of the stream, instead of the instance's")
      ->type_name("ENDPOINT");
  app.add_option("--control", control.endpoint, "ZeroMQ endpoint for requests, instead of the instance's")
      ->type_name("ENDPOINT");

  auto* watch = app.add_subcommand("watch", "Shows the forces live; one line a second where there is no terminal");
  watch->add_option("--seconds", seconds, "to run; without: until q or Ctrl-C")
      ->type_name("SECONDS")
      ->check(number(0.0, "a time of 0 s or more, as in 2.5"));
  cli::TopCommand topping;
  auto* top = app.add_subcommand("top", "Shows live how instruments do: rates, latencies, where every frame went; one "
                                        "line a second where there is no terminal");
  top->add_option("endpoints", topping.endpoints,
                  "ZeroMQ endpoints of streams, or instances of this machine; without: all of them")
      ->type_name("ENDPOINT");
  top->add_flag("--once", topping.once, "print all numbers once, and end");
  top->add_option("--seconds", topping.seconds, "to run; without: until q or Ctrl-C")
      ->type_name("SECONDS")
      ->check(number(0.0, "a time of 0 s or more, as in 2.5"));
  auto* echo = app.add_subcommand("echo", "Prints messages as JSON, one a line");
  const std::map<std::string, unsigned> names = {
      {"field", kField},   {"markers", kMarkers}, {"description", kDescription},
      {"status", kStatus}, {"preview", kPreview}, {"all", kAllTopics}};
  echo->add_option("--topic", topic, "of the messages; all: but previews, whose pixels are printed as base64")
      ->check(CLI::IsMember(&names))
      ->capture_default_str();
  echo->add_option("--count", count, "of messages; without: until Ctrl-C")
      ->type_name("NUMBER")
      ->check(integer("a number of messages, as in 100"));
  bool latest = false;
  echo->add_flag("--latest", latest,
                 "the newest field alone, from the endpoint 'latest': what is read late is replaced");
  auto* status = app.add_subcommand("status", "Tells how the daemon does, and where every frame went");
  status->add_flag("--json", json, "as JSON");
  bool http = false;
  auto* metrics = app.add_subcommand("metrics", "Prints how the daemons of this machine do, as Prometheus reads it; "
                                                "with --instance or --control one alone");
  metrics->add_flag("--http", http, "as the answer to the HTTP request on standard input (traction-metrics.socket)");
  std::string picturePath;
  bool marked = false;
  auto* snapshot = app.add_subcommand("snapshot", "Writes what the camera sees now as a PNG file");
  snapshot->add_option("file", picturePath, "to write; an old one is replaced")->type_name("FILE")->required();
  snapshot->add_flag(
      "--marked", marked,
      "with rings in their colour around the markers found, crosses where they are lost, small dots where "
      "the gel file has them, squares around whatever else looks like one");
  auto* describe = app.add_subcommand("describe", "Prints the sensor's description as JSON");
  describe->add_flag("--json", json, "as it is anyway");
  auto* zero = app.add_subcommand("zero", "Takes what the camera sees now as the unloaded gel");
  cli::ZeroCommand zeroing;
  auto* anyway = zero->add_flag("--anyway", zeroing.anyway, "also if something seems to touch the gel");
  zero->add_flag("--undo", zeroing.undo, "restores the previous zero instead")->excludes(anyway);
  zero->add_flag("--json", zeroing.json, "as JSON");
  cli::CalibrateOptions calibration;
  std::string weights;
  auto* calibrate = app.add_subcommand(
      "calibrate", "Measures the camera's place, the noise and the gel's stiffness, and writes a gel file");
  calibrate->add_option("steps", calibration.steps, "of geometry, noise, weights, finish; without: all, in this order")
      ->check(CLI::IsMember({"geometry", "noise", "weights", "finish"}));
  calibrate->add_option("--weights", weights, "to be put on one after another: 100gf,200gf,500gf")->type_name("LIST");
  calibrate->add_option("--seconds", calibration.seconds, "to look for the noise, and to wait for each weight")
      ->type_name("SECONDS")
      ->check(number(1e-9, "a time above 0 s, as in 30"));
  calibrate->add_option("--name", calibration.name, "of the gel: the file's name begins with it")
      ->type_name("NAME")
      ->check([](const std::string& text) {
        return isValidName(text) ? "" : "'" + text + "' is no name for a gel: 1 to 24 of A-Z a-z 0-9 _ - are";
      });
  calibrate->add_flag("--keep-zero", calibration.keepZero, "geometry from the zero in force, instead of a new one");
  calibrate->add_flag("--anyway", calibration.anyway, "also if something seems to touch the gel");
  calibrate->add_flag("--yes", calibration.yes, "do not wait for Enter");
  calibrate->add_flag("--json", calibration.json, "one line of JSON a step");
  const std::vector<std::string> words = cli::wordsOf(argc, argv);
  const CameraCommand camera(app);
  const Remote remote(app);
  const KeysCommand keys(app);
  const cli::RecordingCommands recordings(app);
  auto* doctor =
      app.add_subcommand("doctor", "Looks at this machine, and says what is wrong with it and what mends it");
  doctor->add_flag("--json", json, "as JSON");
  doctor->footer("Ends with 0 where nothing is wrong with what can be seen, 1 after warnings, 2 where something fails. "
                 "Needs no root; what it may not read it calls not known.");
  auto* trigger = app.add_subcommand("trigger", "Triggers one picture, where the camera's trigger is set to software");

  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // which it wants in reverse
    if (app.get_subcommands().empty()) return fail(EX_USAGE, "a command is needed; see tractionctl --help");
    subscription.instance = control.instance = instance;
    if (keys) return keys.run(remote.file());
    if (doctor->parsed()) return runDoctor(app.count("--instance") != 0 ? instance : "", json);
    remote.apply(subscription, control, latest);
    recordings.run(subscription);
    if (watch->parsed()) cli::watch(subscription, seconds);
    if (top->parsed()) cli::top(subscription, topping, app.count("--instance") != 0 || !subscription.endpoint.empty());
    if (latest) {
      if (topic != "field") return fail(EX_USAGE, "--latest has fields alone, not --topic " + topic);
      subscription.mode = Mode::kLatest;
    }
    if (echo->parsed()) cli::echo(subscription, names.at(topic), count);
    if (status->parsed()) cli::status(control, json);
    if (metrics->parsed()) cli::metrics(control, app.count("--instance") != 0 || !control.endpoint.empty(), http);
    if (snapshot->parsed()) cli::snapshot(control, picturePath, marked);
    if (describe->parsed()) cli::describe(control);
    if (zero->parsed()) cli::zero(control, zeroing);
    if (trigger->parsed()) cli::trigger(control);
    if (camera) {
      if (const int code = camera.run(control); code != EX_OK) return code;
    }
    if (calibrate->parsed()) {
      const auto& steps = calibration.steps;
      if (const auto parsed = cli::parseWeights(weights)) {
        calibration.weights_N = *parsed;
      } else if (!weights.empty() || steps.empty() || std::ranges::find(steps, "weights") != steps.end()) {
        return fail(EX_USAGE, (weights.empty() ? "which weights? " : "'" + weights + "' is no list of weights; ") +
                                  std::string("--weights 100gf,200gf,500gf, say; units are gf, g, kgf, mN and N"));
      }
      cli::calibrate(control, calibration);
    }
    cli::flushOutput();
    return EX_OK;
  } catch (const CLI::Success& done) {  // help, version
    std::ostringstream text;
    app.exit(done, text, text);
    cli::printLine(text.str().substr(0, text.str().find_last_not_of('\n') + 1));
    return EX_OK;
  } catch (const CLI::ParseError& error) {
    return fail(EX_USAGE, cli::sentence(error, app, words));
  } catch (const cli::KeyError& error) {
    return fail(error.exitCode(), error.what());
  } catch (const cli::RecordingError& error) {
    return fail(error.exitCode(), error.what());
  } catch (const cli::NoField& error) {
    return fail(EX_NOINPUT, error.what());
  } catch (const Error& error) {
    return fail(exitCodeOf(error.code()), error.what());
  }
} catch (const cli::OutputError& error) {
  return fail(EX_IOERR, error.what());
} catch (const std::exception& error) {
  return fail(EX_SOFTWARE, error.what());
}
