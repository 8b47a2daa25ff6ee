// Feeds a parser with its seeds, with cuts of each (its first bytes), and with random changes of them, which are the
// same in every run unless TRACTION_SEED is set: a test. Given files, feeds those instead, for example what tools/fuzz
// has found.
#include "tests/fuzz/target.h"
#include "tests/support/seed.h"

#include <sysexits.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <optional>
#include <random>

namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kUsage = "usage: NAME_fuzz [--runs N | --seconds N | FILE...]\n"
                               "Feeds the parser with its seeds, with cuts of each, and with random changes of them.\n"
                               "  --runs N     makes N changes; 20000 without\n"
                               "  --seconds N  makes changes for N seconds\n"
                               "  FILE...      feeds these files instead\n"
                               "TRACTION_SEED=N makes other changes.\n";

struct Options {
  std::uint32_t runs = 20'000;
  std::optional<std::uint32_t> seconds;
  std::vector<std::string> files;
};

/// Returns nothing when the arguments are not those of kUsage.
std::optional<Options> parsed(const std::vector<std::string>& arguments) {
  Options options;
  if (arguments.empty()) return options;
  if (std::ranges::none_of(arguments, [](const std::string& one) { return one.empty() || one[0] == '-'; })) {
    options.files = arguments;
    return options;
  }
  if (arguments.size() != 2) return std::nullopt;
  const std::string &name = arguments[0], &text = arguments[1];
  std::uint32_t number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || rest != text.data() + text.size()) return std::nullopt;
  if (name == "--runs")
    options.runs = number;
  else if (name == "--seconds")
    options.seconds = number;
  else
    return std::nullopt;
  return options;
}

/// Counts what it feeds to the parser, and notes what took longest.
class Feeder {
 public:
  bool feed(std::string_view bytes) {
    ++executions_;
    const auto before = Clock::now();
    const bool taken = fuzz::feed(bytes);
    slowest_ = std::max(slowest_, Clock::now() - before);
    return taken;
  }
  void print() const {
    std::printf("%llu executions, the slowest %.1f ms\n", static_cast<unsigned long long>(executions_),
                std::chrono::duration<double, std::milli>(slowest_).count());
  }

 private:
  std::uint64_t executions_ = 0;
  Clock::duration slowest_{};
};

class Mutator {
 public:
  Mutator(std::uint32_t seed, const std::vector<std::string>& seeds)
      : random_(seed)
      , seeds_(seeds) {}

  std::string next() {
    std::string bytes = any();
    for (std::size_t i = 1 + below(6); i > 0; --i) change(bytes);
    return bytes;
  }

 private:
  std::size_t below(std::size_t limit) { return limit == 0 ? 0 : random_() % limit; }
  const std::string& any() { return seeds_[below(seeds_.size())]; }

  void change(std::string& bytes) {
    static constexpr std::array kWords = {"nan", "-inf", "1e400", "-1", "0", "99999999999999999999",
                                          "[[",  "\"",   "\n",    "{"};
    const std::size_t at = below(bytes.size() + 1), length = below(std::min<std::size_t>(bytes.size() - at, 64) + 1);
    switch (below(8)) {
    case 0:
      if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
      break;
    case 1:
      if (at < bytes.size()) bytes[at] = static_cast<char>(random_());
      break;
    case 2:
      bytes.erase(at, length);
      break;
    case 3:
      bytes.insert(at, std::string(bytes, at, length));
      break;
    case 4: {
      const std::string& other = any();
      const std::size_t from = below(other.size() + 1);
      bytes.replace(at, length, other, from, below(other.size() - from + 1));
      break;
    }
    case 5:
      bytes.insert(at, kWords[below(kWords.size())]);
      break;
    case 6:  // a number of four bytes at an end of its range
      for (std::size_t i = at; i < std::min(at + 4, bytes.size()); ++i)
        bytes[i] = static_cast<char>(below(2) ? 0xff : 0);
      break;
    default:
      bytes.resize(at);
    }
    if (bytes.size() > kLongest) bytes.resize(kLongest);
  }

  static constexpr std::size_t kLongest = 1 << 20;
  std::mt19937 random_;
  const std::vector<std::string>& seeds_;
};

/// Returns whether all of them can be read.
bool feedFiles(Feeder& feeder, const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (access(path.c_str(), R_OK) != 0) return std::perror(path.c_str()), false;
    feeder.feed(fuzz::fileText(path));
  }
  return true;
}

/// Feeds each seed, which the parser must take, and about kCuts of its beginnings.
void feedSeeds(Feeder& feeder, const std::vector<std::string>& seeds) {
  constexpr std::size_t kCuts = 300;
  for (const std::string& one : seeds) {
    fuzz::require(feeder.feed(one), "a seed is refused");
    for (std::size_t size = 0; size <= one.size(); size += 1 + one.size() / kCuts) feeder.feed({one.data(), size});
  }
}

void feedChanges(Feeder& feeder, const std::vector<std::string>& seeds, const Options& options) {
  Mutator mutator(tractiond::test::seed(), seeds);
  if (options.seconds) {
    const auto end = Clock::now() + std::chrono::seconds(*options.seconds);
    while (Clock::now() < end) feeder.feed(mutator.next());
  } else {
    for (std::uint32_t i = 0; i < options.runs; ++i) feeder.feed(mutator.next());
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::optional<Options> options = parsed({argv + 1, argv + argc});
  if (!options) return std::fputs(kUsage, stderr), EX_USAGE;
  if (fuzz::begin != nullptr) fuzz::begin(argc, argv);
  Feeder feeder;
  if (!options->files.empty()) {
    if (!feedFiles(feeder, options->files)) return EX_NOINPUT;
  } else {
    tractiond::test::seed();  // prints it before anything can fail
    const std::vector<std::string> seeds = fuzz::seeds();
    if (seeds.empty() || std::ranges::any_of(seeds, &std::string::empty)) return std::puts("a seed is missing"), 1;
    feedSeeds(feeder, seeds);
    feedChanges(feeder, seeds, *options);
  }
  feeder.print();
  return 0;
}
