// traction-twin: draws a scenario's frames ahead, serves them through the camera or writes them to a file, and writes
// the true state of each.
#include "twin/output.h"

#include <atomic>
#include <csignal>
#include <cstdio>

namespace {

using namespace twin;
using tractiond::Error;

std::atomic<bool> isStopping = false;
static_assert(std::atomic<bool>::is_always_lock_free);

tl::expected<void, Error> run(const Options& options) {
  const auto path = findScenario(options.scenario);
  if (!path) return tl::unexpected(path.error());
  auto scenario = loadScenario(path->string(), options.gel);
  if (!scenario) {
    const tractiond::FileError& error = scenario.error();
    return tl::unexpected(Error{error.unreadable ? EX_NOINPUT : EX_CONFIG, error.what, error.where});
  }
  scenario->format = options.format.value_or(scenario->format);
  scenario->rate_hz = options.rate_hz.value_or(scenario->rate_hz);

  auto truth = TruthWriter::open(options.truth, options.truthMarkers);
  if (!truth) return tl::unexpected(truth.error());
  if (scenario->hand) {
    if (!options.images.empty() || !options.served.empty()) {
      return tl::unexpected(
          Error{EX_USAGE, "a scenario with a gripper has two cameras: --images and --serve have one"});
    }
    HandFilm film(*scenario, options.seed, options.cache);
    return serveHand(options, *scenario, film, *truth, isStopping);
  }
  std::unique_ptr<Film> film;
  if (options.served.empty()) {
    film = std::make_unique<GelFilm>(*scenario, options.seed, options.cache);
  } else {
    const sensor::Camera& camera = scenario->sensor.camera;
    auto raw =
        RawFilm::open(options.served, scenario->format, traitsOf(scenario->format).size(camera.width, camera.height));
    if (!raw) return tl::unexpected(raw.error());
    film = *std::move(raw);
  }
  return options.images.empty() ? serve(options, *scenario, *film, *truth, isStopping)
                                : writePictures(options, *scenario, *film, *truth, isStopping);
}

}  // namespace

int main(int argc, char** argv) {
  struct sigaction action {};
  action.sa_handler = [](int) { isStopping = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe is reported as an error by write()

  const auto options = parseCommandLine(argc, argv);
  if (!options) return options.error();
  const auto done = run(*options);
  if (done) return EX_OK;
  std::fprintf(stderr, "traction-twin: %s\n", done.error().message().c_str());
  return done.error().exitCode;
}
