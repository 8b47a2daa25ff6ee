// One execution of the two threads, and the search that it belongs to. For explore.cpp and explore_memory.cpp alone.
#pragma once

#include "tests/unit/base/explore.h"

#include <csetjmp>
#include <map>
#include <set>
#include <utility>

namespace tractiond::explore {

inline constexpr int kNobody = -1;  // the test's own thread, before and after the two

// What a thread is about to do.
struct Operation {
  const Location* location = nullptr;
  bool writes = false;
  std::array<std::uint64_t, 3> signature{};  // kind and location, operands: what must not depend on a late load
};

inline bool dependent(const Operation& a, const Operation& b) {
  return a.location == b.location && (a.writes || b.writes);
}

struct Choice {
  std::size_t taken = 0, count = 0;
  std::array<std::uint64_t, 3> next{};  // for loads that may be late: the operation that follows if they are not
};

// One search: what is kept from one execution to the next.
struct Search {
  Site weakened;
  bool late = false;                                                      // loads may be
  std::vector<Choice> path;                                               // of the execution that runs
  std::map<std::pair<std::size_t, int>, std::set<std::uint64_t>> values;  // ever stored, by location and thread
  Report report;
};

enum class State {
  kReady,    // before an operation
  kAwake,    // may go on to its next operation at once
  kWaiting,  // in wait()
  kOwing,    // has loaded early what the other has not stored yet
  kEnded,
};

class Execution {
 public:
  explicit Execution(Search& search, bool recording = false)
      : search_(search)
      , recording_(recording) {
    current = this;
  }
  ~Execution() { current = nullptr; }
  Execution(const Execution&) = delete;
  Execution& operator=(const Execution&) = delete;

  static Execution* current;

  bool run(const std::function<Trial&()>& make);

  // --- called by what is explored

  std::size_t newLocation() { return locations_++; }
  int self() const { return self_; }
  Clock& clock(int thread) { return threads_[static_cast<std::size_t>(thread)].clock; }

  std::uint64_t load(Location& location, std::memory_order order, const std::source_location& where);
  void store(Location& location, std::uint64_t desired, std::memory_order order, const std::source_location& where);
  bool exchange(Location& location, std::uint64_t& expected, std::uint64_t desired, std::memory_order success,
                std::memory_order failure, bool weak, const std::source_location& where);
  std::uint32_t plainAccess();
  void wait();
  void violate(const char* law);

 private:
  struct Thread {
    std::jmp_buf place;
    bool begun = false;
    Clock clock{};
    State state = State::kAwake;
    Operation next;
    bool asleep = false;  // what begins with its next operation has been explored
    int spins = 0;        // operations since it or the other last wrote
    std::uint64_t writes = 0, seen = 0;
    bool visible = false;  // it reads only the newest
    bool stuck = false;    // it has looked at the newest and found nothing
    // A late load.
    Location* owed = nullptr;
    std::uint64_t owedBits = 0;
    std::uint32_t owedTime = 0;
    int owedOperations = 0;
    // An ordinary load where a late one may be tried: whose next operation is to be noted.
    std::size_t noted = kNowhere;
  };
  static constexpr std::size_t kNowhere = ~std::size_t{0};

  Thread& me() { return threads_[static_cast<std::size_t>(self_)]; }
  Thread& other() { return threads_[static_cast<std::size_t>(1 - self_)]; }

  std::size_t choose(std::size_t count);
  std::memory_order orderOf(std::memory_order order, const std::source_location& where);
  void point(const Operation& operation);
  void goOn();  // gives the processor to whoever goes next
  int next();
  void switchTo(int thread);
  [[noreturn]] void abandon();  // an execution that is no other, or none
  void begin(const Operation& operation);
  void note(const char* what, const Location& location, std::uint64_t bits, const std::source_location& where);

  std::size_t oldest(Location& location);
  void read(Location& location, std::size_t store, std::memory_order order);
  void append(Location& location, std::uint64_t bits, const Clock& released);

  static void enter();

  Search& search_;
  Trial* trial_ = nullptr;
  std::array<Thread, 2> threads_;
  std::jmp_buf main_;
  int self_ = kNobody;
  std::size_t locations_ = 0;
  std::size_t position_ = 0;  // in the path
  int operations_ = 0;
  bool starting_ = false;
  bool complete_ = false;
  int spurious_ = 1;
  const bool recording_;
  std::string history_;  // of an execution that is repeated to be told

 public:
  bool cut = false;
  std::string violation;
};

}  // namespace tractiond::explore
