#include "client/cli/commands.h"
#include "client/cli/notes.h"
#include "client/show/output.h"
#include "client/show/page.h"
#include "client/show/scene.h"
#include "client/show/terminal.h"
#include "proto/traction/v1/endpoints.h"
#include "traction/subscriber.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace traction::client {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kStep = 100ms;
constexpr auto kAnswer = 500ms;  ///< until a traction-touch that runs is connected

/// A traction-touch that this process has started. Its log goes to standard error.
class OwnTouch {
 public:
  /// It ends with this process, too.
  /// \throws Error kNoAnswer
  OwnTouch(const std::string& instance, const std::filesystem::path& runtime) {
    const std::string program = programBeside("traction-touch");
    child_ = fork();
    if (child_ < 0) throw Error(ErrorCode::kNoAnswer, "no process can be started for traction-touch");
    if (child_ > 0) return;
    // Only what is safe while other threads of the parent may hold locks.
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    dup2(STDERR_FILENO, STDOUT_FILENO);
    execlp(program.c_str(), program.c_str(), "--instance", instance.c_str(), "--runtime", runtime.c_str(), nullptr);
    constexpr std::string_view kMissing = "tractionctl: traction-touch cannot be started; is it installed?\n";
    if (write(STDERR_FILENO, kMissing.data(), kMissing.size()) < 0) _exit(EX_OSERR);
    _exit(EX_UNAVAILABLE);
  }
  ~OwnTouch() {
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
  }
  OwnTouch(const OwnTouch&) = delete;
  OwnTouch& operator=(const OwnTouch&) = delete;

 private:
  pid_t child_ = -1;
};

/// Returns one line about a contact: its id, what it does, its age, and what is known of it.
std::string lineOf(const TrackedContact& contact) {
  constexpr std::array kWords = {"?", "begins", "lasts", "absent", "unknown", "ends"};
  std::string line = "contact " + std::to_string(contact.id);
  line.resize(std::max<std::size_t>(line.size(), 12), ' ');
  line += format(" %6.1f s  ", age_s(contact));
  line += kWords.at(static_cast<std::size_t>(contact.phase));
  constexpr std::array kCauses = {
      "", ": lifted", ": merged with another", ": not seen; it may last", ": another zero", ": stopped; it may last"};
  if (contact.phase == ContactPhase::kEnd) line += kCauses.at(static_cast<std::size_t>(contact.endCause));
  line.resize(std::max<std::size_t>(line.size(), 30), ' ');
  line += format("  at %+6.2f %+6.2f mm", 1e3 * contact.position_m[0], 1e3 * contact.position_m[1]);
  if (isSeen(contact)) {
    const Vector3& force = contact.force_N;
    line += format("  shear %.3f N  normal %+.3f N (deviation %.3f)", std::hypot(force[0], force[1]), force[2],
                   contact.forceDeviation_N[2]);
    line += format("  radius %.1f mm  speed %.1f mm/s", 1e3 * contact.radius_m,
                   1e3 * std::hypot(contact.velocity_m_s[0], contact.velocity_m_s[1]));
    line += format("  torque %+.2f mN m", 1e3 * contact.moment_Nm[2]) + "  stick ratio " + stickRatio(contact);
  }
  if (contact.slip && contact.slip->state != SlipState::kUnknown) {
    constexpr std::array kStates = {"", "sticks", "about to slip", "slips"};
    constexpr std::array kModels = {"", " by the spread of its shear", "", " by its slide"};
    const auto& [estimate, low, high] = contact.slip->friction;
    line += std::string(", ") + kStates.at(static_cast<std::size_t>(contact.slip->state));
    line += format(", friction %.2f (%.2f to %.2f)", estimate, low, high);
    line += kModels.at(static_cast<std::size_t>(contact.slip->model));
  } else if (contact.slip) {
    line += format(", friction %.2f or more", contact.slip->friction.low);
  }
  if (contact.doubted) line += "  doubted";
  return line;
}

/// Returns one line about a hand: what its fingers bear together, or why that is not known.
std::string lineOf(const Grasp& grasp) {
  constexpr std::array kWords = {"not known", "matched",  "not valid", "unmatched", "without a bound of time",
                                 "missing",   "ambiguous"};
  std::string line = "hand " + grasp.header.sensor;
  if (grasp.valid) {
    const auto& [x, y, z] = grasp.force_N;
    const auto [ofX, ofY, ofZ] = deviationsOf(grasp.forceCovariance_N2);
    line += format("  force %+.3f %+.3f %+.3f N", x, y, z);
    line += format(" (deviations %.3f %.3f %.3f)", ofX, ofY, ofZ);
    line += format("  moment %+.2f %+.2f %+.2f mN m", 1e3 * grasp.moment_Nm[0], 1e3 * grasp.moment_Nm[1],
                   1e3 * grasp.moment_Nm[2]);
    return line;
  }
  for (const Finger& finger : grasp.fingers) {
    if (finger.state != FingerState::kMatched)
      line += "  " + finger.instance + ": " + kWords.at(static_cast<std::size_t>(finger.state));
  }
  return line;
}

/// Prints a line for each contact that begins or ends, and one per second for each that lasts. Starts a traction-touch
/// for the instance if none answers within half a second and `options.endpoint` is empty, and ends it. Returns after
/// `seconds`, or on a signal. Reports on standard error what Notes reports.
/// \throws Error kNoAnswer if no publisher is found in the first 3 s, or none can be started
void touch(const SubscriberOptions& options, double seconds) {
  SubscriberOptions wanted = options;
  wanted.topics = kOfTouch;
  rememberSignals();
  std::optional<OwnTouch> own;
  Subscriber subscriber(wanted);
  std::optional<Message> message;
  if (options.endpoint.empty()) {
    const Clock::time_point end = Clock::now() + kAnswer;
    while (!message && !subscriber.isConnected() && Clock::now() < end && !stopRequested())
      message = subscriber.receive(10ms);
    if (!subscriber.isConnected()) {
      const auto runtime =
          runtimeDirectories(options.instance, kTouch).front();  // where this user's clients look first
      own.emplace(options.instance, runtime);
      wanted.endpoint = ipcEndpoints(runtime).stream;
      subscriber = Subscriber(wanted);
    }
  }
  Notes notes(subscriber, "see tractionctl status", "standard output is read too slowly, or this machine is too busy",
              options.endpoint.empty() ? "traction-touch" : "tractiond");
  const Clock::time_point start = Clock::now();
  std::map<std::uint64_t, Clock::time_point> printed;  // id -> when
  std::string reported = "?";                          // why a grasp was not valid
  Clock::time_point reportedAt;
  for (; !stopRequested() && std::chrono::duration<double>(Clock::now() - start).count() < seconds; message.reset()) {
    if (!message) message = subscriber.receive(kStep);
    const Clock::time_point now = Clock::now();
    if (message) notes.hear(*message, now);
    notes.noteConnection(subscriber.isConnected(), now);
    expectReader();
    if (!message) continue;
    if (const auto* grasp = std::get_if<Grasp>(&*message)) {
      std::string state = grasp->valid ? "" : lineOf(*grasp);
      if (state == reported && now - reportedAt < 1s) continue;
      reported = std::move(state);
      reportedAt = now;
      if (!printLine(lineOf(*grasp))) return;
      continue;
    }
    for (const TrackedContact& contact : std::get<Contacts>(*message).contacts) {
      const bool isChange = contact.phase == ContactPhase::kBegin || contact.phase == ContactPhase::kEnd;
      if (!isChange && now - printed[contact.id] < 1s) continue;
      printed[contact.id] = now;
      if (contact.phase == ContactPhase::kEnd) printed.erase(contact.id);
      if (!printLine(lineOf(contact))) return;
    }
  }
}

}  // namespace

void addTouch(Commands& commands) {
  const auto seconds = std::make_shared<double>(kForever);
  addSeconds(commands.add("touch",
                          "Prints contacts as they begin, last and end, each with its id; starts traction-touch if it "
                          "does not run",
                          [seconds](const Target& target) { return touch(target.subscription(), *seconds), EX_OK; }),
             *seconds);
}

}  // namespace traction::client
