// tools/simulate: stories of chance, or one from a file.
#include "tests/simulation/simulation.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

namespace {

using namespace tractiond::simulation;

constexpr int kUsage = 64, kData = 65, kNoInput = 66, kBroken = 1;
constexpr std::int64_t kStory_ms = 600'000;

unsigned long long running = 0;  ///< seed

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int tellBroken(const Broken& broken) {
  std::printf("\nseed %llu breaks a law after %.3f s: %s: %s\n", running, 1e-3 * static_cast<double>(broken.at_ms),
              broken.law.c_str(), broken.what.c_str());
  return kBroken;
}

int runStory(const std::string& path, bool showsLog) {
  std::ifstream file(path);
  if (!file) {
    std::fprintf(stderr, "simulate: %s cannot be read\n", path.c_str());
    return kNoInput;
  }
  const auto story = fromText({std::istreambuf_iterator<char>(file), {}});
  if (!story) {
    std::fprintf(stderr, "simulate: %s: %s\n", path.c_str(), story.error().c_str());
    return kData;
  }
  running = story->seed;
  Simulation simulation;
  const Result result = simulation.run(*story);
  if (showsLog || result.broken) std::printf("%s%s", result.log.c_str(), result.account.text().c_str());
  if (result.broken) return tellBroken(*result.broken);
  std::printf("%s: no law is broken, %llu fields\n", path.c_str(),
              static_cast<unsigned long long>(result.account.fields()));
  return 0;
}

/// Ends after so many simulated hours, or minutes of real time.
int runSeeds(std::uint64_t seed, double hours, double minutes, bool showsLog) {
  Simulation simulation;
  const double begin_s = seconds();
  double told_s = begin_s, done_h = 0.0;
  unsigned long long fields = 0, zeros = 0, undone = 0, restarts = 0;
  for (bool isLast = false; !isLast; ++seed) {
    const Story story = draw(seed, kStory_ms);
    running = seed;
    const Result result = simulation.run(story);
    done_h += 1e-3 / 3600 * static_cast<double>(result.reached_ms);
    fields += result.account.fields();
    zeros += result.zerosTaken;
    undone += result.undone;
    restarts += result.restarts;
    if (showsLog) std::printf("%s", result.log.c_str());
    const double now_s = seconds();
    isLast = done_h >= hours || now_s >= begin_s + 60.0 * minutes || result.broken;
    if (now_s - told_s > 5.0 || isLast) {
      told_s = now_s;
      std::printf(
          "seed %llu: %.2f h simulated in %.0f s (%.0f x), %llu fields, %llu zeros, %llu undone, %llu restarts\n",
          running, done_h, now_s - begin_s, 3600 * done_h / (now_s - begin_s), fields, zeros, undone, restarts);
      std::fflush(stdout);
    }
    if (!result.broken) continue;
    std::printf("its story, for --story:\n\n%s\n%s", toText(story).c_str(), result.log.c_str());
    return tellBroken(*result.broken);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  constexpr double kMost = 1e6;
  std::uint64_t seed = 1;
  double hours = 0.0, minutes = 0.0;  // 0: not given
  std::string story;
  bool showsLog = false;
  CLI::App app("Runs the instrument's parts in simulated time.", "simulate");
  app.add_option("--seed", seed, "of the first story");
  app.add_option("--hours", hours, "simulated")->check(CLI::Range(0.0, kMost));
  app.add_option("--minutes", minutes, "of real time")->check(CLI::Range(0.0, kMost));
  app.add_option("--story", story, "file");
  app.add_flag("--log", showsLog, "print what happens");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  if (hours == 0.0) hours = minutes == 0.0 ? 1.0 : kMost;
  if (minutes == 0.0) minutes = kMost;
  std::signal(SIGABRT, [](int) { std::fprintf(stderr, "simulate: seed %llu\n", running); });  // an assertion has failed
  return story.empty() ? runSeeds(seed, hours, minutes, showsLog) : runStory(story, showsLog);
}
