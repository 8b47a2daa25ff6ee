// The hand as a controller sees it: two cameras to look through, and an endpoint that takes commands.
#include "twin/gv_camera.h"
#include "twin/output.h"

#include <zmq.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace twin {

using tractiond::Error;

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kFarthest_m = 10.0;

struct Command {
  double opening = 0.0, height = 0.0;  ///< [m]
};

std::optional<Command> parse(const std::string& text) {
  Command command;
  char more = 0;
  const auto isPlace = [](double place_m) { return place_m >= 0.0 && place_m <= kFarthest_m; };  // false for NaN
  const bool isWhole = std::sscanf(text.c_str(), "%lf %lf%c", &command.opening, &command.height, &more) == 2;
  if (!isWhole || !isPlace(command.opening) || !isPlace(command.height)) return std::nullopt;
  return command;
}

/// Returns the oldest command that has come; nothing if none comes in time.
std::optional<Command> nextCommand(zmq::socket_t& socket, std::chrono::milliseconds timeout) {
  try {
    zmq::message_t message;
    socket.set(zmq::sockopt::rcvtimeo, static_cast<int>(timeout.count()));
    if (!socket.recv(message)) return std::nullopt;
    const auto command = parse(message.to_string());
    if (!command) {
      std::fputs("traction-twin: a command is two numbers, opening and height in metres, such as 0.042 0.01\n", stderr);
    }
    return command;
  } catch (const zmq::error_t&) {
    return std::nullopt;  // interrupted by a signal: the twin is about to end
  }
}

constexpr std::chrono::milliseconds kWait(50), kNoWait(0);

/// One finger: its camera, and the picture that is drawn, or is with the camera.
struct Finger {
  std::unique_ptr<GvCamera> camera;
  Picture picture;
  Truth truth;
  bool queued = false;
};

/// The fingers, and the time of the next pair of pictures.
class Fingers {
 public:
  Fingers(std::array<Finger, 2> fingers, HandFilm& film, TruthWriter& truth)
      : fingers_(std::move(fingers))
      , film_(film)
      , truth_(truth) {
    shootAll();
  }

  /// Waits for the cameras, kWait each. Returns whether both have sent their pictures.
  bool areSent() {
    for (Finger& finger : fingers_) takeBack(finger, kWait);
    // A client that chose another format gets its picture now.
    bool sent = true;
    for (std::size_t i = 0; i < fingers_.size(); ++i) {
      if (!fingers_[i].queued && !fingers_[i].picture.stamp) shoot(i);
      sent = sent && !fingers_[i].queued;
    }
    return sent;
  }

  /// Moves the hand on by a frame, and draws the next pair.
  void advance() {
    const double frame_s = period_s();
    film_.hand().advance(frame_s);
    time_s_ += frame_s;
    shootAll();
  }

  double period_s() const { return fingers_[0].camera->framePeriod_s(); }

  void close() {
    for (std::size_t i = 0; i < fingers_.size(); ++i) {
      std::atomic<bool> isClosed = false;
      std::jthread closing([&] {
        fingers_[i].camera->close();
        isClosed = true;
      });
      while (!isClosed) {
        takeBack(fingers_[i], kWait);
        if (!fingers_[i].queued) shoot(i);
      }
      takeBack(fingers_[i], kNoWait);
    }
  }

 private:
  void shoot(std::size_t index) {
    Finger& finger = fingers_[index];
    Picture& picture = finger.picture;
    picture.format = finger.camera->format();
    picture.time_s = time_s_;
    film_.draw(static_cast<int>(index), picture, finger.truth);
    ++picture.number;
    finger.camera->queue(picture);
    finger.queued = true;
  }

  void shootAll() {
    for (std::size_t i = 0; i < fingers_.size(); ++i) shoot(i);
  }

  void takeBack(Finger& finger, std::chrono::milliseconds timeout) {
    if (!finger.queued || !finger.camera->takeBack(timeout)) return;
    finger.queued = false;
    if (finger.picture.stamp) truth_.write(finger.truth, *finger.picture.stamp);
  }

  std::array<Finger, 2> fingers_;
  HandFilm& film_;
  TruthWriter& truth_;
  double time_s_ = 0.0;
};

}  // namespace

tl::expected<void, Error> serveHand(const Options& options, const Scenario& scenario, HandFilm& film,
                                    TruthWriter& truth, const std::atomic<bool>& isStopping) {
  zmq::context_t context;
  zmq::socket_t commands(context, zmq::socket_type::pull);
  try {
    commands.bind(options.commands);
  } catch (const zmq::error_t& error) {
    return tl::unexpected(Error{error.num() == EADDRINUSE ? EX_UNAVAILABLE : EX_USAGE,
                                std::string("takes no commands: ") + error.what(), options.commands});
  }
  const sensor::Camera& size = scenario.sensor.camera;
  const std::array<std::string, 2> addresses = {options.address, options.secondAddress};
  std::array<Finger, 2> opened;
  for (std::size_t i = 0; i < opened.size(); ++i) {
    auto camera =
        GvCamera::open({addresses[i], size.width, size.height, scenario.format, scenario.rate_hz, options.lostRatio});
    if (!camera) return tl::unexpected(camera.error());
    opened[i].camera = *std::move(camera);
  }
  Fingers fingers(std::move(opened), film, truth);
  std::printf("ready %s and %s %dx%d %s %g Hz, commands at %s\n", options.address.c_str(),
              options.secondAddress.c_str(), size.width, size.height, traitsOf(scenario.format).name.data(),
              scenario.rate_hz, options.commands.c_str());
  std::fflush(stdout);

  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.seconds));
  const auto isOver = [&] { return isStopping || (options.seconds > 0.0 && Clock::now() >= end); };
  bool commanded = false;
  while (!isOver()) {
    if (!fingers.areSent()) continue;
    const bool waits = options.lockstep && commanded;
    if (!waits) std::this_thread::sleep_for(std::chrono::duration<double>(fingers.period_s() / 2));
    std::optional<Command> command = nextCommand(commands, waits ? kWait : kNoWait);
    while (waits && !command && !isOver()) command = nextCommand(commands, kWait);
    if (!options.lockstep) {
      while (const auto newer = nextCommand(commands, kNoWait)) command = newer;
    }
    if (command) {
      commanded = true;
      film.hand().command(command->opening, command->height);
    }
    fingers.advance();
  }
  fingers.close();
  return {};
}

}  // namespace twin
