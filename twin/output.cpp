#include "twin/output.h"

#include "twin/gv_camera.h"
#include "twin/scene_time.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <span>
#include <thread>

namespace twin {

using tractiond::Error;

namespace {

using Clock = std::chrono::steady_clock;

/// A picture and its true state.
struct Shot {
  Picture picture;
  Truth truth;
};

/// Waits until the middle of the pause between two frames. A real camera has its own processor, so the drawing of the
/// next picture should not compete with a daemon that processes the one just sent.
void waitForPause(const Stamp& sent, double period_s) {
  const std::chrono::duration<double> half(std::min(period_s / 2, 0.05));
  std::this_thread::sleep_until(Clock::time_point(std::chrono::nanoseconds(sent.monotonic_ns)) +
                                std::chrono::duration_cast<Clock::duration>(half));
}

}  // namespace

tl::expected<void, Error> serve(const Options& options, const Scenario& scenario, Film& film, TruthWriter& truth,
                                const std::atomic<bool>& isStopping) {
  const sensor::Camera& size = scenario.sensor.camera;
  auto camera =
      GvCamera::open({options.address, size.width, size.height, scenario.format, scenario.rate_hz, options.lostRatio});
  if (!camera) return tl::unexpected(camera.error());

  std::uint64_t next = 0;
  SceneTime time;
  const auto shoot = [&](Shot& shot) {
    Picture& picture = shot.picture;
    picture.format = (*camera)->format();
    picture.pixels.resize(traitsOf(picture.format).size(size.width, size.height));
    picture.number = next++;
    picture.time_s = time.next((*camera)->framePeriod_s());
    film.draw(picture, shot.truth);
    (*camera)->queue(picture);
  };
  std::array<Shot, 3> shots;  // one is sent, one is ready, one is drawn
  for (Shot& shot : shots) shoot(shot);

  std::printf("ready %s %dx%d %s %g Hz %s\n", options.address.c_str(), size.width, size.height,
              traitsOf(scenario.format).name.data(), scenario.rate_hz, (*camera)->id().c_str());
  std::fflush(stdout);
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.seconds));
  const auto takeBack = [&](std::chrono::milliseconds timeout) -> Shot* {
    const Picture* picture = (*camera)->takeBack(timeout);
    if (!picture) return nullptr;
    Shot& shot = *std::find_if(shots.begin(), shots.end(), [&](const Shot& s) { return &s.picture == picture; });
    if (picture->stamp) {
      truth.write(shot.truth, *picture->stamp);
      time.wasSent(1e-9 * static_cast<double>(picture->stamp->monotonic_ns), (*camera)->framePeriod_s());
    }
    return &shot;
  };
  constexpr std::chrono::milliseconds kTurn(50), kAtOnce(0);
  while (!isStopping && (options.seconds == 0.0 || Clock::now() < end)) {
    Shot* const shot = takeBack(kTurn);
    if (!shot) continue;
    if (shot->picture.stamp) waitForPause(*shot->picture.stamp, (*camera)->framePeriod_s());
    shoot(*shot);
  }
  std::atomic<bool> isClosed = false;
  std::jthread closing([&] {
    (*camera)->close();
    isClosed = true;
  });
  while (!isClosed) {
    if (Shot* const shot = takeBack(kTurn)) shoot(*shot);
  }
  while (takeBack(kAtOnce)) {
  }
  return {};
}

tl::expected<void, Error> writePictures(const Options& options, const Scenario& scenario, Film& film,
                                        TruthWriter& truth, const std::atomic<bool>& isStopping) {
  // A signal ends open() of a pipe without a reader, and write() to a pipe that is full.
  if (isStopping) return {};
  const bool isStandard = options.images == "-";
  const int file =
      isStandard ? STDOUT_FILENO : open(options.images.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  const auto failed = [&](int exitCode) {
    const std::string where = isStandard ? "standard output" : options.images;
    return tl::unexpected(Error{exitCode, std::string("pictures cannot be written: ") + std::strerror(errno), where});
  };
  Shot shot;
  Picture& picture = shot.picture;
  picture.format = scenario.format;
  if (file < 0 && !isStopping) return failed(EX_CANTCREAT);
  for (; !isStopping; ++picture.number) {
    picture.time_s = static_cast<double>(picture.number) / scenario.rate_hz;
    if (options.seconds != 0.0 && picture.time_s >= options.seconds) break;
    film.draw(picture, shot.truth);
    truth.write(shot.truth, {.cameraFrameId = picture.number + 1, .device_ns = 0, .monotonic_ns = 0});
    for (std::span<const std::uint8_t> left = picture.pixels; !left.empty() && !isStopping;) {
      const ssize_t written = write(file, left.data(), left.size());
      if (written < 0 && errno != EINTR) return failed(EX_IOERR);
      left = left.subspan(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
    }
  }
  return {};
}

}  // namespace twin
