#include "client/viewer/setup.h"

#include "base/background_thread.h"
#include "base/child.h"
#include "base/whole_file.h"
#include "client/files/failure.h"
#include "client/show/json.h"
#include "client/show/output.h"
#include "client/show/page.h"
#include "client/show/png_file.h"
#include "client/viewer/gel_form.h"
#include "client/viewer/jpeg.h"
#include "client/viewer/look.h"
#include "sensor/gel_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sysexits.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <future>
#include <map>
#include <regex>
#include <utility>

namespace traction::view {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // figures in the order in which they were reported
using namespace std::chrono_literals;

constexpr const char* kState = "setup.json";
constexpr const char* kPlan = "plan.toml";              // the gel as it is described
constexpr const char* kLens = "lens.toml";              // the lens as it was measured
constexpr const char* kPosed = "gel.toml";              // with the camera's pose
constexpr const char* kCalibrated = "calibrated.toml";  // as the daemon has written it
constexpr const char* kRest = "rest.png";
constexpr const char* kMarked = "marked.png";
constexpr std::array kFiles = {kPlan,   kLens,        kPosed,       kCalibrated,  kRest,
                               kMarked, "layer1.svg", "layer2.svg", "layer3.svg", "layer4.svg"};
constexpr const char* kBoards = "board-*.png";  // all pictures of the chessboard

/// What a step is made from, and the file that it makes; the step that made the former must hold, too.
struct Made {
  std::string_view step;
  const char* from;
  const char* file;   ///< null: none
  const char* again;  ///< what the operator is to do
};
constexpr std::array kMade = {Made{"lens", kBoards, kLens, "fit the lens again"},
                              Made{"gel", kLens, kPlan, "keep the gel again"},
                              Made{"pose", kPlan, kPosed, "find the pose again"},
                              Made{"tried", kPosed, nullptr, "let the daemon measure with gel.toml"},
                              Made{"zero", kPosed, nullptr, "take the zero again"},
                              Made{"geometry", kPosed, nullptr, "measure again"},
                              Made{"noise", kPosed, nullptr, "measure again"},
                              Made{"creep", kPosed, nullptr, "measure again"},
                              Made{"recovery", kPosed, nullptr, "measure again"},
                              Made{"weights", kPosed, nullptr, "measure again"},
                              Made{"stiffness", kPosed, nullptr, "measure again"},
                              Made{"finish", kPosed, kCalibrated, "measure again, and write the gel file"},
                              Made{"adopted", kCalibrated, nullptr, "put the calibrated gel in force again"}};

const Made* madeBy(std::string_view step) {
  const auto* const found = std::ranges::find(kMade, step, &Made::step);
  return found == kMade.end() ? nullptr : found;
}

/// Returns what makes a file; null: no step, or several.
const Made* makerOf(std::string_view file) {
  const auto* const found =
      std::ranges::find_if(kMade, [file](const Made& one) { return one.file != nullptr && one.file == file; });
  return found == kMade.end() ? nullptr : found;
}

constexpr std::size_t kMostBoards = 60;
constexpr std::size_t kMostBytes = 64 << 20;  // of a file for the page
constexpr auto kLensPatience = 5min;

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kRefused, why);
}

/// Returns the squares of a board as traction-lens takes them: "10x7".
std::string squaresOf(const Json& request) {
  return std::to_string(std::lround(numberIn(request, "columns", 4, 100))) + "x" +
         std::to_string(std::lround(numberIn(request, "rows", 4, 100)));
}

bool flag(const Json& from, const char* name) {
  const auto found = from.find(name);
  return found != from.end() && found->is_boolean() && found->get<bool>();
}

/// Returns the MIME type of a name that may be one of the folder's files; empty for every other name.
std::string typeOf(std::string_view name) {
  static const std::map<std::string, std::string> kTypes = {
      {"png", "image/png"}, {"svg", "image/svg+xml"}, {"toml", "text/plain; charset=utf-8"}};
  static const std::regex kName("[a-z0-9-]{1,24}\\.(png|svg|toml)");
  std::cmatch match;
  return std::regex_match(name.begin(), name.end(), match, kName) ? kTypes.at(match[1]) : std::string();
}

std::string hashOfBytes(std::string_view bytes) {
  return client::format("%016llx", static_cast<unsigned long long>(XXH3_64bits(bytes.data(), bytes.size())));
}

/// Returns whether two gel files are of one gel: they differ in what a calibration measures at most.
bool isSameGel(const std::string& one, const std::string& other) {
  auto first = sensor::parseGel(one, "one"), second = sensor::parseGel(other, "other");
  if (!first || !second) return false;
  for (sensor::Sensor* each : {&*first, &*second}) {
    const sensor::Sensor like = *each;
    *each = sensor::Sensor();
    each->gel = like.gel;
    each->gel.youngsModulus = 1e5;
    each->layers = like.layers;
    each->nodes = like.nodes;
  }
  return sensor::gelText(*first) == sensor::gelText(*second);
}

Json numbersOf(const Look& look) {
  return {{"histogram", look.histogram}, {"clipped", look.clipped}, {"bright", look.bright},
          {"sharpness", look.sharpness}, {"markers", look.markers}, {"diameter_px", look.diameter_px},
          {"pitch_px", look.pitch_px}};
}

}  // namespace

Setup::Setup(fs::path folder, const ControlOptions& control, fs::path lens)
    : folder_(std::move(folder))
    , lens_(std::move(lens))
    , control_(control) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw client::Failure(EX_CANTCREAT, folder_.string() + " cannot be made: " + error.message());
  lock_.emplace(open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (flock(lock_->get(), LOCK_EX | LOCK_NB) != 0)
    throw client::Failure(EX_TEMPFAIL,
                          folder_.string() + " is in use by another setup: end that, or name another folder");
  if (!has(kState)) {
    for (const char* name : kFiles) {
      if (has(name))
        throw client::Failure(EX_CANTCREAT,
                              path(name) + " is not of a setup, which would replace it: name another folder");
    }
    return;
  }
  const auto bytes = tractiond::readWholeFile(folder_ / kState, kMostBytes);
  if (bytes) steps_ = Json::parse(bytes->begin(), bytes->end(), nullptr, false);
  if (!bytes || !steps_.is_object() ||
      !std::ranges::all_of(steps_, [](const Json& each) { return each.is_object(); })) {
    throw client::Failure(
        EX_DATAERR, path(kState) + " is damaged: begin anew in another folder, into which board-*.png may be copied");
  }
}

bool Setup::has(const std::string& name) const {
  std::error_code ignored;
  return fs::is_regular_file(folder_ / name, ignored);
}

void Setup::forget(const std::vector<std::string>& names) const {
  std::error_code ignored;
  for (const std::string& name : names) fs::remove(folder_ / name, ignored);
}

std::vector<std::string> Setup::boards() const {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename();
    if (name.starts_with("board-") && typeOf(name) == "image/png") names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

void Setup::write(const std::string& name, const std::string& content) const {
  if (const std::error_code error = tractiond::replaceWholeFile(folder_ / name, content)) {
    refuse(path(name) + " cannot be written: " + error.message());
  }
}

/// Returns the hash of a file; empty if there is none. Reads it only if its size or time is another than before: sixty
/// pictures would keep the server's thread.
std::string Setup::fileHash(const std::string& name) const {
  std::error_code error;
  const auto size = fs::file_size(folder_ / name, error);
  const auto time = error ? fs::file_time_type() : fs::last_write_time(folder_ / name, error);
  if (error) return {};
  const std::lock_guard lock(mutex_);
  Hashed& known = hashes_[name];
  if (known.hash.empty() || known.size != size || known.time != time) {
    const auto bytes = tractiond::readWholeFile(folder_ / name, kMostBytes);
    known = {size, time, bytes ? hashOfBytes({bytes->data(), bytes->size()}) : std::string()};
  }
  return known.hash;
}

/// Returns the hash of what a name stands for; empty if there is none.
std::string Setup::hashOf(const std::string& name) const {
  if (name != kBoards) return fileHash(name);
  std::string all;
  for (const std::string& each : boards()) all += each + fileHash(each);
  return all.empty() ? all : hashOfBytes(all);
}

/// Returns why what was kept of a step does not hold any more, and what is to be done; empty: it holds, or none was
/// kept.
std::string Setup::whyStale(std::string_view step) const {
  const Made* const made = madeBy(step);
  const Json was = kept(std::string(step).c_str(), Json());
  if (made == nullptr || was.is_null()) return {};
  if (const Made* const before = makerOf(made->from); before != nullptr && has(made->from)) {
    if (kept(std::string(before->step).c_str(), Json()).is_null())
      return std::string(made->from) + " is not of this setup: " + before->again;
    if (std::string why = whyStale(before->step); !why.empty()) return why;
  }
  if (!was.contains("from")) return "an earlier version kept this: " + std::string(made->again);
  if (was.value("from", Json()) != hashOf(made->from))
    return std::string(made->from) + " has changed since " +
           (made->file != nullptr ? made->file : "this was measured") + (made->file != nullptr ? " was made: " : ": ") +
           made->again;
  if (made->file != nullptr && was.value("made", Json()) != hashOf(made->file))
    return std::string(made->file) + " is not the one that was made here: " + made->again;
  return {};
}

/// Refuses if a step was not carried out, or does not hold.
void Setup::expect(const char* step, const std::string& otherwise) const {
  if (kept(step, Json()).is_null()) refuse(otherwise);
  if (const std::string why = whyStale(step); !why.empty()) refuse(why);
}

bool Setup::isCancel(std::string_view request) {
  const Json asked = Json::parse(request, nullptr, false);
  return asked.is_object() && asked.value("do", Json()) == "cancel";
}

void Setup::cancel() {
  const std::lock_guard lock(mutex_);
  stop_.request_stop();
}

template <typename Question>
auto Setup::ask(Question question) const {
  tractiond::BackgroundThread asker("tr-setup");
  auto answer = asker.start([control = control_, question] { return question(control); });
  const auto stop = stop_.get_token();
  while (answer.wait_for(50ms) != std::future_status::ready) {
    if (stop.stop_requested()) refuse("cancelled; the daemon may go on with it until its end, or until the next step");
  }
  return answer.get();
}

void Setup::keep(const std::string& step, Json result) {
  result["date"] = client::utc(std::time(nullptr), "%Y-%m-%dT%H:%M:%SZ");
  if (const Made* const made = madeBy(step)) {
    result["from"] = hashOf(made->from);
    if (made->file != nullptr) result["made"] = hashOf(made->file);
  }
  const std::lock_guard lock(mutex_);
  steps_[step] = std::move(result);
  write(kState, steps_.dump(1) + "\n");
}

/// Returns what was kept of a step.
Json Setup::kept(const char* step, const Json& otherwise) const {
  const std::lock_guard lock(mutex_);
  return steps_.value(step, otherwise);
}

std::string Setup::state() const {
  Json files = Json::array(), steps, stale = Json::object();
  {
    const std::lock_guard lock(mutex_);
    steps = steps_;
  }
  for (const char* name : kFiles) {
    if (!file(name).content.empty()) files.push_back(name);
  }
  for (const Made& made : kMade) {
    const std::string step(made.step), why = whyStale(made.step);
    if (why.empty()) continue;
    stale[step] = std::move(steps[step]);
    stale[step]["why"] = why;
    steps.erase(step);
  }
  std::error_code ignored;
  return Json{{"folder", fs::absolute(folder_, ignored).string()},
              {"steps", steps},
              {"stale", stale},
              {"boards", boards()},
              {"files", files}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

SetupFile Setup::file(std::string_view name) const {
  if (name == "look.jpg") {
    const std::lock_guard lock(mutex_);
    return {"image/jpeg", look_};
  }
  const std::string type = typeOf(name);
  if (type.empty()) return {};
  if (const Made* const made = makerOf(name); made != nullptr) {
    const std::string step(made->step);
    if (kept(step.c_str(), Json()).is_null() || !whyStale(step).empty()) return {};
  }
  const auto bytes = tractiond::readWholeFile(folder_ / name, kMostBytes);
  return bytes ? SetupFile{type, std::string(bytes->begin(), bytes->end())} : SetupFile{};
}

std::string Setup::carryOut(std::string_view request) {
  using Step = Json (Setup::*)(const Json&);
  static const std::map<std::string, Step> kSteps = {
      {"camera", &Setup::camera}, {"look", &Setup::look},          {"board", &Setup::takeBoard},
      {"lens", &Setup::fitLens},  {"forget", &Setup::removeBoard}, {"gel", &Setup::describeGel},
      {"pose", &Setup::findPose}, {"sheet", &Setup::printSheets},  {"adopt", &Setup::adopt},
      {"zero", &Setup::zero},     {"measure", &Setup::measure}};
  const Json asked = Json::parse(request, nullptr, false);
  if (!asked.is_object()) refuse("this is no request of a setup");
  const auto step = kSteps.find(textIn(asked, "do"));
  if (step == kSteps.end()) refuse("there is no such step of a setup");
  {
    const std::lock_guard lock(mutex_);
    stop_ = std::stop_source();
  }
  try {
    return (this->*step->second)(asked).dump(-1, ' ', false, Json::error_handler_t::replace);
  } catch (const client::OutputError& error) {
    refuse(error.what());
  } catch (const Json::exception&) {  // edited by hand
    refuse(path(kState) + " is damaged: begin anew in another folder, into which board-*.png may be copied");
  }
}

Json Setup::camera(const Json& request) {
  CameraStep step;
  step.name = textIn(request, "name");
  step.value = textIn(request, "value");
  step.matching = textIn(request, "matching");
  step.kind = step.name.empty() ? CameraStep::Kind::kList : CameraStep::Kind::kWrite;
  Json report = Json::parse(client::toJson(ask([step](const Control& control) { return control.camera(step); })));
  if (step.kind == CameraStep::Kind::kList) return report;
  Json settings = kept("settings", Json::object());
  settings[step.name] = step.value;
  keep("settings", settings);
  return report;
}

Json Setup::look(const Json&) {
  const Snapshot snapshot = ask([](const Control& control) { return control.snapshot(); });
  Json result = numbersOf(lookAt(snapshot));
  result["width_px"] = snapshot.width * snapshot.reduced;
  result["height_px"] = snapshot.height * snapshot.reduced;
  result["reduced"] = snapshot.reduced;
  result["pixel_format"] = snapshot.pixelFormat;
  result["grey"] = snapshot.channels == 1;
  const Description description = ask([](const Control& control) { return control.description(); });
  result["vendor"] = description.camera.vendor;
  result["model"] = description.camera.model;
  result["serial"] = description.camera.serial;
  {
    const std::lock_guard lock(mutex_);
    look_ = jpegOf(snapshot.levels, snapshot.width, snapshot.height, snapshot.channels);
  }
  keep("camera", result);
  return result;
}

/// Returns a picture with all of the camera's pixels.
Snapshot Setup::fullPicture() const {
  Snapshot snapshot = ask([](const Control& control) { return control.snapshot(); });
  if (snapshot.reduced > 1) {
    refuse(
        "the picture has more than 16 MB, and would be reduced: set camera.width_px and height_px to a region of the "
        "sensor");
  }
  return snapshot;
}

/// Makes an empty file of a new name, numbered from the largest of `taken`, which may have names of any other kind.
std::string Setup::newBoard(const std::vector<std::string>& taken) const {
  long largest = 0;
  for (const std::string& name : taken) {
    long number = 0;  // stays 0 without digits
    std::from_chars(name.data() + std::string_view("board-").size(), name.data() + name.size(), number);
    largest = std::max(largest, number);
  }
  for (;;) {
    const std::string name = client::format("board-%03ld.png", ++largest);
    if (std::FILE* const file = std::fopen(path(name).c_str(), "wxe")) return std::fclose(file), name;
    if (errno != EEXIST) refuse(path(name) + " cannot be written: " + std::strerror(errno));
  }
}

/// Takes a picture of the board, and keeps it if it shows the board as a whole.
Json Setup::takeBoard(const Json& request) {
  const std::string squares = squaresOf(request);
  const std::vector<std::string> taken = boards();
  if (taken.size() >= kMostBoards) refuse("there are " + std::to_string(kMostBoards) + " pictures: remove some");
  const Snapshot snapshot = fullPicture();
  const std::string name = newBoard(taken);
  Json seen;
  try {
    client::writePng(path(name), snapshot.width, snapshot.height, snapshot.channels, snapshot.levels.data(),
                     snapshot.measuredWith);
    seen = runLens({"board", path(name), "--squares", squares});
  } catch (...) {
    forget({name});
    throw;
  }
  Json outlines = kept("outlines", Json::object()), outline = Json::array();
  for (const Json& figure : seen["figures"]) {
    if (figure["name"].get<std::string>().starts_with("corner")) outline.push_back(figure["value"]);
  }
  outlines[name] = outline;
  keep("outlines", outlines);
  return {{"name", name}, {"boards", boards()}, {"outlines", outlines}};
}

Json Setup::removeBoard(const Json& request) {
  const std::string name = textIn(request, "name");
  const std::vector<std::string> taken = boards();
  if (std::find(taken.begin(), taken.end(), name) == taken.end()) refuse("there is no picture " + name);
  forget({name});
  return {{"boards", boards()}};
}

/// Returns a text with the names of the folder's files alone, without the folder.
std::string Setup::plain(std::string text) const {
  const std::string folder = folder_.string() + "/";
  for (std::size_t at = 0; (at = text.find(folder, at)) != std::string::npos;) text.erase(at, folder.size());
  return text;
}

Json Setup::runLens(std::vector<std::string> arguments) const {
  arguments.emplace_back("--json");
  using How = tractiond::ChildEnd::How;
  const auto end = tractiond::runChild(arguments, {.program = lens_, .patience = kLensPatience}, stop_.get_token());
  if (end.how == How::kNotStarted) refuse(lens_.string() + " cannot be started; is traction-lens installed?");
  if (end.how == How::kStopped) refuse("cancelled");
  if (end.how != How::kExit) refuse("traction-lens did not come to an end");
  Json report = Json::parse(end.output, nullptr, false);
  if (!report.is_object()) refuse("traction-lens failed: " + plain(end.errors));
  for (const char* texts : {"notes", "faults"}) {
    for (Json& text : report[texts]) text = plain(text.get<std::string>());
  }
  const Json all = report["faults"];
  report.erase("faults");
  if (end.code == 0) return report;
  std::string faults;
  for (const Json& fault : all) faults += (faults.empty() ? "" : "\n") + fault.get<std::string>();
  refuse(faults);
}

Json Setup::fitLens(const Json& request) {
  const double across = numberIn(request, "square_mm", 0.1, 1000),
               along = numberIn(request, "square_v_mm", 0.1, 1000, across);
  std::vector<std::string> arguments = {
      "calibrate",   "--force",
      "--output",    path(kLens),
      "--squares",   squaresOf(request),
      "--square-mm", client::format("%.6g", across) + (along == across ? "" : "x" + client::format("%.6g", along))};
  for (const std::string& name : boards()) arguments.push_back(path(name));
  Json result = runLens(arguments);
  result["pictures"] = boards().size();
  result["squares"] = {request["columns"], request["rows"]};
  result["square_mm"] = {across, along};
  keep("lens", result);
  return result;
}

Json Setup::describeGel(const Json& request) {
  const auto form = request.find("form");
  if (form == request.end() || !form->is_object()) refuse("the form is missing");
  sensor::Sensor from;
  const bool isMeasured = has(kLens);
  if (isMeasured) {
    expect("lens", std::string(kLens) + " is not of this setup: remove it, or fit the lens");
    auto lens = sensor::loadGel(path(kLens));
    if (!lens) refuse(lens.error().what);
    from = *std::move(lens);
  }
  const std::string gel = sensor::gelText(sensorOf(*form, from, isMeasured));
  if (const auto sound = sensor::parseGel(gel, "the gel"); !sound) refuse(sound.error().what);
  write(kPlan, "# The gel as it was described in traction-view --setup.\n" + gel);
  keep("gel", {{"form", *form}});
  return {{"lens_measured", isMeasured}};
}

Json Setup::printSheets(const Json&) {
  expect("gel", "describe the gel first");
  runLens({"sheet", "--gel", path(kPlan), "--output-dir", folder_.string()});
  return Json::parse(state())["files"];
}

Json Setup::findPose(const Json& request) {
  expect("gel", "describe the gel first");
  const double accepted_px = numberIn(request, "accept_residual_px", 0.5, 100, 0.5);
  const Snapshot snapshot = fullPicture();
  client::writePng(path(kRest), snapshot.width, snapshot.height, snapshot.channels, snapshot.levels.data(),
                   snapshot.measuredWith);
  forget({kMarked});
  const auto mark = [this](const char* gel) -> Json {
    try {
      return runLens({"mark", path(kRest), "--gel", path(gel), "--output", path(kMarked)});
    } catch (const Error& error) {
      return {{"notes", {error.what()}}};
    }
  };
  const std::string posed = "posed.toml";  // of this try
  std::vector<std::string> arguments = {"pose", path(kRest), "--gel", path(kPlan), "--output", path(posed)};
  if (flag(request, "same_lens")) arguments.emplace_back("--same-lens");
  if (accepted_px > 0.5) arguments.insert(arguments.end(), {"--accept-residual", client::format("%.6g", accepted_px)});
  forget({posed});
  Json result;
  try {
    result = runLens(arguments);
  } catch (const Error& error) {
    return {{"fault", error.what()}, {"marked", mark(kPlan)["notes"]}, {"picture", has(kMarked)}};
  }
  std::error_code error;
  fs::rename(folder_ / posed, folder_ / kPosed, error);
  if (error) refuse(path(kPosed) + " cannot be written: " + error.message());
  result["marked"] = mark(kPosed)["notes"];
  result["picture"] = has(kMarked);
  keep("pose", result);
  return result;
}

/// Puts a gel file in force.
Json Setup::adopt(const Json& request) {
  const char* const name = flag(request, "calibrated") ? kCalibrated : kPosed;
  expect(flag(request, "calibrated") ? "finish" : "pose", std::string("there is no ") + name + " yet");
  ask([text = file(name).content](const Control& control) { return control.adopt(text), 0; });
  keep(flag(request, "calibrated") ? "adopted" : "tried", {{"file", name}});
  return Json::object();
}

Json Setup::zero(const Json& request) {
  expect("tried", "let the daemon measure with gel.toml first");
  const ZeroResult zero =
      ask([anyway = flag(request, "anyway")](const Control& control) { return control.zero({.anyway = anyway}); });
  Json result = {{"present", zero.markersPresent},
                 {"expected", zero.markersExpected},
                 {"noise_levels", zero.noise_levels},
                 {"remark", zero.remark}};
  keep("zero", result);
  return result;
}

Json Setup::measure(const Json& request) {
  using Kind = CalibrationStep::Kind;
  static const std::map<std::string, Kind> kKinds = {{"geometry", Kind::kGeometry}, {"noise", Kind::kNoise},
                                                     {"weight", Kind::kWeight},     {"stiffness", Kind::kStiffness},
                                                     {"creep", Kind::kCreep},       {"recovery", Kind::kRecovery},
                                                     {"finish", Kind::kFinish}};
  const std::string name = textIn(request, "step");
  const auto kind = kKinds.find(name);
  if (kind == kKinds.end()) refuse("there is no step '" + name + "' of a calibration");
  CalibrationStep step;
  step.kind = kind->second;
  step.seconds = numberIn(request, "seconds", 0, 3600, 0.0);
  step.anyway = flag(request, "anyway");
  step.first = flag(request, "first");
  step.name = textIn(request, "name");
  if (step.kind == Kind::kWeight) step.weight_N = client::kGramForce_N * numberIn(request, "gf", 0.1, 1e6);
  expect("tried", "let the daemon measure with gel.toml first");
  const CalibrationReport report = ask([step](const Control& control) { return control.calibrate(step); });
  Json result = Json::parse(client::toJson(name, report));
  if (step.kind == Kind::kFinish) {
    if (!isSameGel(report.gelFile, file(kPosed).content))
      refuse("the daemon has measured another gel than gel.toml: let it measure with that, and measure again");
    write(kCalibrated, report.gelFile);
  }
  if (step.kind == Kind::kWeight) {
    Json weights = step.first ? Json::array() : kept("weights", {{"read", Json::array()}})["read"];
    result["gf"] = step.weight_N / client::kGramForce_N;
    weights.push_back(result);
    keep("weights", {{"read", weights}});
  } else {
    keep(name, result);
  }
  return result;
}

}  // namespace traction::view
