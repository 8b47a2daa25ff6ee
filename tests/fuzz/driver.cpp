// Feeds a parser with its seeds, with cuts of each (its first bytes), and with random changes of them, which are the
// same in every run unless TRACTION_SEED is set: a test. Given files, feeds those instead, for example what tools/fuzz
// has found.
#include "tests/fuzz/target.h"
#include "tests/support/seed.h"

#include <sysexits.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <random>

namespace {

unsigned long long executions = 0;

bool feed(std::string_view bytes) {
  ++executions;
  return fuzz::feed(bytes);
}

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
bool feedFiles(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (access(path.c_str(), R_OK) != 0) return std::perror(path.c_str()), false;
    feed(fuzz::fileText(path));
  }
  return true;
}

/// Feeds each seed, which the parser must take, and about kCuts of its beginnings.
void feedSeeds(const std::vector<std::string>& seeds) {
  constexpr std::size_t kCuts = 300;
  for (const std::string& one : seeds) {
    fuzz::require(feed(one), "a seed is refused");
    for (std::size_t size = 0; size <= one.size(); size += 1 + one.size() / kCuts) feed({one.data(), size});
  }
}

void feedChanges(const std::vector<std::string>& seeds) {
  constexpr int kChanges = 20'000;
  Mutator mutator(tractiond::test::seed(), seeds);
  for (int i = 0; i < kChanges; ++i) feed(mutator.next());
}

}  // namespace

int main(int argc, char** argv) {
  if (fuzz::begin != nullptr) fuzz::begin(argc, argv);
  const std::vector<std::string> files(argv + 1, argv + argc);
  if (!files.empty()) {
    if (!feedFiles(files)) return EX_NOINPUT;
  } else {
    tractiond::test::seed();  // prints it before anything can fail
    const std::vector<std::string> seeds = fuzz::seeds();
    if (seeds.empty() || std::ranges::any_of(seeds, &std::string::empty)) return std::puts("a seed is missing"), 1;
    feedSeeds(seeds);
    feedChanges(seeds);
  }
  std::printf("%llu executions\n", executions);
  return 0;
}
