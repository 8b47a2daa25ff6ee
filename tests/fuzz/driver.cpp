// For the tests: seeds, each cut short, and random changes of them; another seed of the random numbers in each run
// unless TRACTION_SEED repeats one. With files: those, as tools/fuzz left them.
#include "tests/fuzz/target.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>

namespace {

using Clock = std::chrono::steady_clock;

class Mutator {
 public:
  Mutator(unsigned seed, const std::vector<std::string>& seeds)
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

}  // namespace

int main(int argc, char** argv) {
  constexpr auto kTime = std::chrono::seconds(3);
  constexpr int kCuts = 300;
  if (fuzz::begin != nullptr) fuzz::begin(argc, argv);
  for (int i = 1; i < argc; ++i) fuzz::feed(fuzz::fileText(argv[i]));
  if (argc > 1) return 0;

  const char* const given = std::getenv("TRACTION_SEED");
  const unsigned seed = given != nullptr ? static_cast<unsigned>(std::stoul(given)) : std::random_device{}();
  std::printf("seed %u\n", seed);
  std::fflush(stdout);
  const std::vector<std::string> seeds = fuzz::seeds();
  if (seeds.empty() || std::ranges::any_of(seeds, &std::string::empty)) return std::puts("a seed is missing"), 1;
  for (const std::string& one : seeds) {
    fuzz::require(fuzz::feed(one), "a seed is refused");
    for (std::size_t size = 0; size <= one.size(); size += 1 + one.size() / kCuts) fuzz::feed({one.data(), size});
  }
  Mutator mutator(seed, seeds);
  long runs = 0;
  Clock::duration slowest{};
  for (const auto begin = Clock::now(); Clock::now() - begin < kTime; ++runs) {
    const std::string bytes = mutator.next();
    const auto before = Clock::now();
    fuzz::feed(bytes);
    slowest = std::max(slowest, Clock::now() - before);
  }
  std::printf("%ld inputs, the slowest %.1f ms\n", runs, std::chrono::duration<double, std::milli>(slowest).count());
  return 0;
}
