// tools/simulate: stories of chance, or one from a file.
#include "tests/simulation/simulation.h"

#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

namespace {

using namespace tractiond::simulation;

constexpr int kUsage = 64, kData = 65, kNoInput = 66, kBroken = 1;
constexpr std::int64_t kStory_ms = 600'000;

volatile std::sig_atomic_t interrupted = 0;
std::uint64_t running = 0;  ///< seed

bool goesOn() {
  return interrupted == 0;
}

int complain(int code, const std::string& what) {
  std::fprintf(stderr, "simulate: %s\n", what.c_str());
  return code;
}

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int tellBroken(const Story& story, const Broken& broken) {
  std::printf("\nseed %llu breaks a law after %.3f s: %s: %s\n", static_cast<unsigned long long>(story.seed),
              1e-3 * static_cast<double>(broken.at_ms), broken.law.c_str(), broken.what.c_str());
  return kBroken;
}

int runStory(const std::string& path, bool showsLog) {
  std::ifstream file(path);
  if (!file) return complain(kNoInput, path + " cannot be read");
  const auto story = fromText({std::istreambuf_iterator<char>(file), {}});
  if (!story) return complain(kData, path + ": " + story.error());
  Simulation simulation;
  const Result result = simulation.run(*story);
  if (showsLog || result.broken) std::printf("%s%s", result.log.c_str(), result.account.text().c_str());
  if (result.broken) return tellBroken(*story, *result.broken);
  std::printf("%s: no law is broken, %llu fields\n", path.c_str(),
              static_cast<unsigned long long>(result.account.fields()));
  return 0;
}

/// Ends after so many simulated hours, or minutes of real time.
int runSeeds(std::uint64_t seed, std::uint64_t hours, std::uint64_t minutes, bool showsLog) {
  Simulation simulation;
  const auto end_ms = static_cast<std::int64_t>(hours) * 3'600'000;
  const double begin_s = seconds(), end_s = begin_s + 60.0 * static_cast<double>(minutes);
  double told_s = begin_s;
  std::int64_t done_ms = 0;
  std::uint64_t fields = 0, zeros = 0, undone = 0, restarts = 0;
  for (bool isLast = false; !isLast; ++seed) {
    const Story story = draw(seed, kStory_ms);
    running = seed;
    const Result result = simulation.run(story, goesOn);
    done_ms += result.reached_ms;
    fields += result.account.fields();
    zeros += result.zerosTaken;
    undone += result.undone;
    restarts += result.restarts;
    if (showsLog) std::printf("%s", result.log.c_str());
    const double now_s = seconds();
    isLast = done_ms >= end_ms || now_s >= end_s;
    const auto tell = [&] {
      std::printf(
          "seed %llu: %.2f h simulated in %.0f s (%.0f x), %llu fields, %llu zeros, %llu undone, %llu restarts\n",
          static_cast<unsigned long long>(seed), 1e-3 * static_cast<double>(done_ms) / 3600, now_s - begin_s,
          1e-3 * static_cast<double>(done_ms) / (now_s - begin_s), static_cast<unsigned long long>(fields),
          static_cast<unsigned long long>(zeros), static_cast<unsigned long long>(undone),
          static_cast<unsigned long long>(restarts));
      std::fflush(stdout);
    };
    if (result.broken) {
      tell();
      std::printf("its story, for --story:\n\n%s\n%s", toText(story).c_str(), result.log.c_str());
      return tellBroken(story, *result.broken);
    }
    if (interrupted != 0) {
      tell();
      std::printf("interrupted %.3f s into the story; to go on: tools/simulate --seed %llu\n",
                  1e-3 * static_cast<double>(result.reached_ms), static_cast<unsigned long long>(seed));
      return 130;
    }
    if (now_s - told_s > 5.0 || isLast) {
      told_s = now_s;
      tell();
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  constexpr std::uint64_t kMostHours = 1'000'000;
  std::uint64_t seed = 1, hours = 0, minutes = 0;  // 0: not given
  std::string story;
  bool showsLog = false;
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    if (option == "--log") {
      showsLog = true;
      continue;
    }
    const bool known = option == "--seed" || option == "--hours" || option == "--minutes" || option == "--story";
    if (!known) return complain(kUsage, "'" + option + "' is not understood; see tools/simulate --help");
    if (++i == argc) return complain(kUsage, option + " needs a value");
    if (option == "--story") {
      story = argv[i];
      continue;
    }
    const auto number = wholeNumber(argv[i], option);
    if (!number) return complain(kUsage, number.error());
    if (option != "--seed" && (*number == 0 || *number > kMostHours))
      return complain(kUsage, fmt::format("{} is {}, must be 1 to {}", option, *number, kMostHours));
    (option == "--seed" ? seed : option == "--hours" ? hours : minutes) = *number;
  }
  if (hours == 0) hours = minutes == 0 ? 1 : kMostHours;
  if (minutes == 0) minutes = 60 * kMostHours;
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGABRT, [](int) {  // an assertion has failed
    std::fprintf(stderr, "simulate: seed %llu\n", static_cast<unsigned long long>(running));
  });
  return story.empty() ? runSeeds(seed, hours, minutes, showsLog) : runStory(story, showsLog);
}
