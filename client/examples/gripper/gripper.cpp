// Picks up a thing between two fingers, holds it as lightly as is safe, and puts it down: grip.h decides, this
// connects. usage: gripper LEFT RIGHT COMMANDS OPENING_MM [JERK]   two instances of tractiond, each with its
// traction-touch; a ZeroMQ endpoint (PUSH) that takes "OPENING HEIGHT" in metres, as traction-twin has one; the opening
// at the start; the acceleration of the hand that is to be held [m/s^2]
#include "grip.h"

#include <traction/subscriber.h>
#include <unistd.h>
#include <zmq.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>

namespace {

using namespace std::chrono_literals;

class Side {
 public:
  explicit Side(const std::string& instance) {
    traction::SubscriberOptions options;
    options.instance = instance;
    options.topics = traction::kField | traction::kContacts;
    subscriber_ = traction::Subscriber(options);
  }

  /// Waits for the next frame and its contacts. Returns false if it does not come, is not valid, or is of another zero
  /// or start of the daemon than before the touch: it then says nothing of what is held.
  bool next() {
    const std::uint64_t last = frame_;
    bool waits = false;  // for the contacts of that frame, which come before or after it
    while (const auto message = subscriber_.receive(500ms)) {
      if (const auto* contacts = std::get_if<traction::Contacts>(&*message)) {
        feel(*contacts);
      } else {
        const auto& field = std::get<traction::Field>(*message);
        frame_ = field.header.frameNumber;
        if (!finger_.touches) basis_ = basisOf(field.header);
        if (!field.valid || basisOf(field.header) != basis_)
          return false;  // by another zero, what is held weighs nothing
        waits = !field.contacts.empty();
        if (!waits) finger_ = {};
      }
      if (frame_ != last && (!waits || felt_ == frame_)) return true;
    }
    return false;
  }

  const grip::Finger& finger() const { return finger_; }
  std::uint64_t frame() const { return frame_; }

 private:
  /// Takes the strongest contact. Where nothing is known of them, the last frame's stays: it may be there still.
  void feel(const traction::Contacts& contacts) {
    if (!contacts.valid || basisOf(contacts.header) != basis_) return;
    finger_ = {};
    felt_ = contacts.header.frameNumber;
    for (const traction::TrackedContact& contact : contacts.contacts) {
      const auto& [x, y, z] = contact.force_N;
      if (z <= finger_.normal_N) continue;
      const bool slides = contact.slip && contact.slip->state == traction::SlipState::kSlipping;
      finger_ = {z > kTouch_N, z, -x, -y, slides};
    }
  }

  using Basis = std::pair<traction::Id, traction::Id>;  ///< start of the daemon, and zero
  static Basis basisOf(const traction::Header& header) { return {header.boot, header.zero}; }

  static constexpr double kTouch_N = 0.05;
  traction::Subscriber subscriber_;
  grip::Finger finger_;
  Basis basis_;                         ///< of the last field without a touch
  std::uint64_t frame_ = 0, felt_ = 0;  ///< numbers of the last field, and of the last contacts
};

/// Prints a line: over the last one on a terminal, unless it is another phase; elsewhere only then.
void show(const grip::Grip& gripper, const grip::Finger& finger, bool isNew) {
  constexpr const char* kNames[] = {"close", "probe", "lift", "hold", "lower", "open", "done", "failed"};
  const bool isTerminal = isatty(STDOUT_FILENO) != 0;
  if (!isNew && !isTerminal) return;
  const double shear_N = std::hypot(finger.across_N, finger.up_N), most_N = gripper.friction() * finger.normal_N;
  std::string cone(20, '.');
  const double full = most_N > 0.0 ? std::min(shear_N / most_N, 1.0) : 0.0;
  std::fill_n(cone.begin(), std::lround(20 * full), '#');
  std::printf("%s%-6s normal %.2f N, shear %.2f N of the %.2f N it bears [%s]  friction %.2f, weight %4.0f mN%s",
              isTerminal ? (isNew ? "\n" : "\r") : "", kNames[static_cast<int>(gripper.phase())], finger.normal_N,
              shear_N, most_N, cone.c_str(), gripper.friction(), 1e3 * gripper.weight_N(), isTerminal ? "" : "\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "usage: gripper LEFT RIGHT COMMANDS OPENING_MM [JERK]\n");
    return 64;
  }
  void* const context = zmq_ctx_new();
  void* const commands = zmq_socket(context, ZMQ_PUSH);
  if (zmq_connect(commands, argv[3]) != 0) {
    std::fprintf(stderr, "gripper: cannot connect to %s\n", argv[3]);
    return 69;
  }
  grip::Options options;
  if (argc > 5) options.jerk_m_s2 = std::strtod(argv[5], nullptr);
  grip::Target target{1e-3 * std::strtod(argv[4], nullptr), 0.0};
  grip::Grip gripper(options, target.opening_m);
  Side left(argv[1]), right(argv[2]);

  using Phase = grip::Grip::Phase;
  Phase said = Phase::kDone;
  std::uint64_t last = 0;
  int blind = 0;
  while (gripper.phase() != Phase::kDone && gripper.phase() != Phase::kFailed) {
    // Both are always read. Where either shows nothing the gripper stays as it is.
    const bool seen = left.next(), alsoSeen = right.next();
    if (seen && alsoSeen) {
      const double dt_s = static_cast<double>(last == 0 ? 0 : left.frame() - last) / 60;
      last = left.frame();
      target = gripper.step(left.finger(), right.finger(), std::min(dt_s, 0.05));
      blind = 0;
    } else if (++blind == 20) {
      std::fprintf(
          stderr, "gripper: nothing valid comes from %s, so whether it is held is not known: stopped, and not opened\n",
          argv[seen ? 2 : 1]);
      return 69;
    }
    char text[64];
    const int size = std::snprintf(text, sizeof text, "%.7f %.7f", target.opening_m, std::max(target.height_m, 0.0));
    zmq_send(commands, text, static_cast<std::size_t>(size), 0);
    if (gripper.phase() != said || left.frame() % 12 == 0) show(gripper, left.finger(), gripper.phase() != said);
    said = gripper.phase();
  }
  zmq_close(commands);
  zmq_ctx_term(context);
  return gripper.phase() == Phase::kDone ? 0 : 1;
}
