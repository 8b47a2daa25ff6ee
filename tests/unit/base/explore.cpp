#include "tests/unit/base/explore.h"

#include <ucontext.h>

#include <algorithm>
#include <csetjmp>
#include <map>
#include <set>

namespace tractiond::explore {

namespace {

constexpr int kNobody = -1;  // the test's own thread, before and after the two

bool acquires(std::memory_order order) {
  return order == std::memory_order_acquire || order == std::memory_order_acq_rel;
}
bool releases(std::memory_order order) {
  return order == std::memory_order_release || order == std::memory_order_acq_rel;
}

Site siteOf(const std::source_location& where) {
  return {where.file_name(), where.line(), where.column()};
}

}  // namespace

// What a thread is about to do.
struct Operation {
  const Location* location = nullptr;
  bool writes = false;
  std::array<std::uint64_t, 3> signature{};  // kind and location, operands: what must not depend on a late load
};

static bool dependent(const Operation& a, const Operation& b) {
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

Execution* Execution::current = nullptr;

namespace {

// A stack of each thread's own, to begin on. From then on setjmp() is enough, which makes no system calls.
ucontext_t& stackOf(int thread) {
  static std::array<std::vector<char>, 2> stacks{std::vector<char>(64 * 1024), std::vector<char>(64 * 1024)};
  static std::array<ucontext_t, 2> contexts = [] {
    std::array<ucontext_t, 2> all{};
    for (std::size_t t = 0; t < 2; ++t) {
      getcontext(&all[t]);
      all[t].uc_stack.ss_sp = stacks[t].data();
      all[t].uc_stack.ss_size = stacks[t].size();
    }
    return all;
  }();
  return contexts[static_cast<std::size_t>(thread)];
}

}  // namespace

void Execution::enter() {
  Execution& execution = *current;
  (execution.self_ == 0) ? execution.trial_->first() : execution.trial_->second();
  Thread& me = execution.me();
  if (me.owed) {
    me.state = State::kOwing;
    execution.goOn();
  }
  me.state = State::kEnded;
  execution.goOn();
}

// True: it came to its end.
bool Execution::run(const std::function<Trial&()>& make) {
  trial_ = &make();
  starting_ = true;
  for (std::size_t t = 0; t < 2; ++t) threads_[t].clock[t] = 1;
  for (int t = 0; t < 2 && violation.empty(); ++t) switchTo(t);  // each to its first operation
  starting_ = false;
  if (violation.empty()) {
    const int first = next();
    if (first != kNobody) switchTo(first);
  }
  self_ = kNobody;
  if (complete_ && violation.empty()) trial_->after();
  search_.report.depth = std::max(search_.report.depth, operations_);
  return complete_;
}

// From the test's own thread, or from one of the two to the other, or back (kNobody).
void Execution::switchTo(int thread) {
  if (_setjmp(self_ == kNobody ? main_ : me().place) != 0) return;
  self_ = thread;
  if (thread == kNobody) _longjmp(main_, 1);
  if (me().begun) _longjmp(me().place, 1);
  me().begun = true;
  makecontext(&stackOf(thread), &Execution::enter, 0);
  setcontext(&stackOf(thread));
}

void Execution::abandon() {
  switchTo(kNobody);
  std::abort();  // nobody comes back
}

void Execution::violate(const char* law) {
  if (violation.empty()) violation = std::string(law) + history_;
  if (self_ != kNobody) abandon();
}

std::size_t Execution::choose(std::size_t count) {
  if (count == 1) return 0;
  if (position_ == search_.path.size()) search_.path.push_back({0, count, {}});
  const Choice& choice = search_.path[position_++];
  if (choice.count != count) std::abort();  // the test does not repeat itself
  return choice.taken;
}

void Execution::goOn() {
  if (starting_) {
    switchTo(kNobody);
    return;
  }
  const int chosen = next();
  if (chosen != self_) switchTo(chosen);
}

// Which of the two goes next; kNobody: the execution is over.
int Execution::next() {
  // What was held up goes on to its next operation first, so that both are known.
  for (int t = 0; t < 2; ++t) {
    if (threads_[static_cast<std::size_t>(t)].state == State::kAwake) return t;
  }
  const auto ready = [&](int t) { return threads_[static_cast<std::size_t>(t)].state == State::kReady; };
  if (!ready(0) && !ready(1)) {
    const bool owes = threads_[0].state == State::kOwing || threads_[1].state == State::kOwing;
    if (owes) return kNobody;  // the store that was guessed is never made: no execution
    for (int t = 0; t < 2; ++t) {
      Thread& thread = threads_[static_cast<std::size_t>(t)];
      if (thread.state != State::kWaiting) continue;
      if (thread.stuck) {
        if (threads_[static_cast<std::size_t>(1 - t)].state == State::kWaiting &&
            !threads_[static_cast<std::size_t>(1 - t)].stuck) {
          continue;
        }
        violation = "a thread waits for ever" + history_;
        return kNobody;
      }
      thread.visible = thread.stuck = true;
      thread.state = State::kAwake;
      return t;
    }
    complete_ = true;
    return kNobody;
  }
  const int favourite = self_ != kNobody && ready(self_) ? self_ : ready(0) ? 0 : 1;
  const int rival = 1 - favourite;
  Thread& mine = threads_[static_cast<std::size_t>(favourite)];
  Thread& others = threads_[static_cast<std::size_t>(rival)];
  if (!ready(rival)) {
    if (mine.spins >= kSpins) mine.visible = true;
    return mine.asleep ? kNobody : favourite;
  }
  if (mine.asleep && others.asleep) return kNobody;
  if (mine.asleep) return rival;
  if (mine.spins >= kSpins) return others.asleep ? kNobody : rival;
  if (others.asleep) return favourite;
  if (choose(2) == 0) return favourite;
  mine.asleep = true;
  return rival;
}

// Before each operation: returns when it is to be done.
void Execution::point(const Operation& operation) {
  Thread& self = me();
  self.next = operation;
  if (self.noted != kNowhere) {
    search_.path[self.noted].next = operation.signature;
    self.noted = kNowhere;
  }
  if (self.owed) {
    // The one operation that overtakes the late load.
    if (self.owedOperations++ == 0) {
      const Choice& choice = search_.path[position_ - 1];
      if (!operation.writes || operation.location == self.owed || choice.next != operation.signature) abandon();
    } else {
      self.state = State::kOwing;
      goOn();
    }
  }
  self.state = State::kReady;
  goOn();
  begin(operation);
}

void Execution::begin(const Operation& operation) {
  Thread& self = me();
  if (++operations_ > kDepth) {
    cut = !self.owed && !other().owed;
    abandon();
  }
  ++clock(self_)[static_cast<std::size_t>(self_)];
  if (dependent(operation, other().next)) other().asleep = false;
  ++self.spins;
}

std::memory_order Execution::orderOf(std::memory_order order, const std::source_location& where) {
  if (order == std::memory_order_relaxed) return order;
  const Site site = siteOf(where);
  auto& ordered = search_.report.ordered;
  if (std::find(ordered.begin(), ordered.end(), site) == ordered.end()) ordered.push_back(site);
  return site == search_.weakened ? std::memory_order_relaxed : order;
}

void Execution::note(const char* what, const Location& location, std::uint64_t bits,
                     const std::source_location& where) {
  if (!recording_) return;
  const std::string file = where.file_name();
  history_ += std::string("\n  ") + (self_ == 0 ? "first: " : "second: ") + what + " #" + std::to_string(location.id_) +
              " = " + std::to_string(bits) + "  " + file.substr(file.rfind('/') + 1) + ':' +
              std::to_string(where.line());
}

// The oldest store of a location that this thread may read.
std::size_t Execution::oldest(Location& location) {
  const auto mine = static_cast<std::size_t>(self_), others = 1 - mine;
  const Clock& known = clock(self_);
  std::size_t from = location.oldest_[mine];
  for (std::size_t i = location.stores_.size(); i-- > from + 1;) {
    const auto& store = location.stores_[i];
    if (store.time > known[static_cast<std::size_t>(store.thread)]) continue;
    from = i;
    break;
  }
  for (const auto& read : location.reads_[others]) {
    if (read.time <= known[others]) from = std::max(from, read.store);
  }
  if (me().visible) from = location.stores_.size() - 1;
  if (from != location.oldest_[mine]) {
    location.oldest_[mine] = from;
    location.rereads_[mine] = 0;
  }
  return from;
}

void Execution::read(Location& location, std::size_t store, std::memory_order order) {
  const auto mine = static_cast<std::size_t>(self_);
  if (store != location.oldest_[mine]) {
    location.oldest_[mine] = store;
    location.rereads_[mine] = 0;
  }
  if (store + 1 < location.stores_.size() && ++location.rereads_[mine] > kRereads) {
    location.oldest_[mine] = store + 1;
    location.rereads_[mine] = 0;
  }
  location.reads_[mine].push_back({clock(self_)[mine], store});
  if (acquires(order)) {
    for (std::size_t t = 0; t < 2; ++t) {
      clock(self_)[t] = std::max(clock(self_)[t], location.stores_[store].released[t]);
    }
  }
}

void Execution::append(Location& location, std::uint64_t bits, const Clock& released) {
  Thread& self = me();
  Thread& rival = other();
  const auto mine = static_cast<std::size_t>(self_);
  location.stores_.push_back({bits, self_, clock(self_)[mine], released});
  location.oldest_[mine] = location.stores_.size() - 1;
  location.rereads_[mine] = 0;
  if (!search_.late) search_.values[{location.id_, self_}].insert(bits);
  ++self.writes;
  self.spins = rival.spins = 0;
  self.visible = rival.visible = self.stuck = rival.stuck = false;
  if (rival.state == State::kWaiting) {
    rival.state = State::kAwake;
    rival.seen = self.writes;
  }
  if (rival.owed == &location && rival.owedBits == bits) {
    // The late load happens before this store: it cannot read it, nor a later one.
    if (rival.owedTime <= clock(self_)[1 - mine]) abandon();
    location.oldest_[1 - mine] = location.stores_.size() - 1;
    location.reads_[1 - mine].push_back({rival.owedTime, location.stores_.size() - 1});
    rival.owed = nullptr;
    if (rival.state == State::kOwing) rival.state = State::kAwake;
  }
}

std::uint64_t Execution::load(Location& location, std::memory_order order, const std::source_location& where) {
  if (self_ == kNobody) return location.stores_.back().bits;
  order = orderOf(order, where);
  point({&location, false, {1, location.id_, 0}});
  const std::size_t from = oldest(location);
  const std::size_t present = location.stores_.size() - from;
  // Values that the other thread may still store, for a load that is late.
  std::vector<std::uint64_t> later;
  if (search_.late && order == std::memory_order_relaxed && !me().owed && other().state != State::kEnded) {
    for (const std::uint64_t bits : search_.values[{location.id_, 1 - self_}]) {
      if (bits != location.stores_.back().bits) later.push_back(bits);
    }
  }
  const std::size_t chosen = choose(present + later.size());
  if (chosen < present) {
    if (!later.empty()) me().noted = position_ - 1;
    const std::size_t store = location.stores_.size() - 1 - chosen;  // the newest first
    const std::uint64_t bits = location.stores_[store].bits;
    read(location, store, order);
    note(chosen == 0 ? "load" : "load of an old", location, bits, where);
    return bits;
  }
  Thread& self = me();
  self.owed = &location;
  self.owedBits = later[chosen - present];
  self.owedTime = clock(self_)[static_cast<std::size_t>(self_)];
  self.owedOperations = 0;
  note("late load", location, self.owedBits, where);
  return self.owedBits;
}

void Execution::store(Location& location, std::uint64_t desired, std::memory_order order,
                      const std::source_location& where) {
  if (self_ == kNobody) {
    location.stores_.back().bits = desired;
    return;
  }
  order = orderOf(order, where);
  point({&location, true, {2, location.id_, desired}});
  note("store", location, desired, where);
  append(location, desired, releases(order) ? clock(self_) : Clock{});
}

bool Execution::exchange(Location& location, std::uint64_t& expected, std::uint64_t desired, std::memory_order success,
                         std::memory_order failure, bool weak, const std::source_location& where) {
  if (self_ == kNobody) {
    if (location.stores_.back().bits != expected) {
      expected = location.stores_.back().bits;
      return false;
    }
    location.stores_.back().bits = desired;
    return true;
  }
  success = orderOf(success, where);
  failure = orderOf(failure, where);
  point({&location, true, {3 + (expected << 2), location.id_, desired}});
  const std::size_t from = oldest(location);
  const std::size_t newest = location.stores_.size() - 1;
  std::vector<std::size_t> failures;
  for (std::size_t i = from; i <= newest; ++i) {
    if (location.stores_[i].bits != expected) failures.push_back(i);
  }
  const bool may = location.stores_[newest].bits == expected;
  const bool forNothing = may && weak && spurious_ > 0;
  std::size_t chosen = choose((may ? 1U : 0U) + failures.size() + (forNothing ? 1U : 0U));
  if (may && chosen == 0) {
    const Clock inherited = location.stores_[newest].released;  // the release sequence goes on
    read(location, newest, success);
    Clock released = inherited;
    if (releases(success)) {
      for (std::size_t t = 0; t < 2; ++t) released[t] = std::max(released[t], clock(self_)[t]);
    }
    note("exchange", location, desired, where);
    append(location, desired, released);
    return true;
  }
  chosen -= may ? 1 : 0;
  const bool spurious = chosen == failures.size();
  if (spurious) --spurious_;
  const std::size_t store = spurious ? newest : failures[chosen];
  expected = location.stores_[store].bits;
  read(location, store, failure);
  note(spurious ? "exchange fails without a reason" : "exchange fails", location, expected, where);
  return false;
}

std::uint32_t Execution::plainAccess() {
  if (me().owed && me().owedOperations > 0) {
    me().state = State::kOwing;
    goOn();
  } else if (me().owed) {
    abandon();  // the load may be needed here
  }
  return ++clock(self_)[static_cast<std::size_t>(self_)];
}

void Execution::wait() {
  if (self_ == kNobody) return;
  Thread& self = me();
  if (self.owed) {
    if (self.owedOperations == 0) abandon();
    self.state = State::kOwing;
    goOn();
  }
  if (other().writes != self.seen) {
    self.seen = other().writes;
    return;
  }
  self.state = State::kWaiting;
  goOn();
  self.state = State::kAwake;
}

Report exploreAnew(const std::function<Trial&()>& make, const Site& weakened) {
  Search search;
  search.weakened = weakened;
  // The first round learns which values are stored, the second lets loads be late.
  for (const bool late : {false, true}) {
    search.late = late;
    search.path.clear();
    search.report.executions = search.report.cut = 0;
    do {
      Execution execution(search);
      const bool complete = execution.run(make);
      if (complete) ++search.report.executions;
      if (execution.cut) ++search.report.cut;
      if (!execution.violation.empty()) {
        Execution again(search, true);
        again.run(make);
        search.report.violation = again.violation;
        return search.report;
      }
      while (!search.path.empty() && search.path.back().taken + 1 == search.path.back().count) search.path.pop_back();
      if (!search.path.empty()) ++search.path.back().taken;
    } while (!search.path.empty());
  }
  return search.report;
}

void require(bool holds, const char* law) {
  if (!holds) Execution::current->violate(law);
}

void wait() {
  Execution::current->wait();
}

Location::Location(std::uint64_t initial)
    : id_(Execution::current->newLocation())
    , stores_{{initial, 0, 0, {}}} {}

std::uint64_t Location::load(std::memory_order order, const std::source_location& where) {
  return Execution::current->load(*this, order, where);
}
void Location::store(std::uint64_t desired, std::memory_order order, const std::source_location& where) {
  Execution::current->store(*this, desired, order, where);
}
bool Location::exchange(std::uint64_t& expected, std::uint64_t desired, std::memory_order success,
                        std::memory_order failure, bool weak, const std::source_location& where) {
  return Execution::current->exchange(*this, expected, desired, success, failure, weak, where);
}

void Accesses::read() const {
  Execution* const execution = Execution::current;
  if (!execution || execution->self() == kNobody) return;
  const auto mine = static_cast<std::size_t>(execution->self());
  reads_[mine] = execution->plainAccess();
  if (writes_[1 - mine] > execution->clock(execution->self())[1 - mine]) execution->violate("a data race");
}

void Accesses::written() {
  Execution* const execution = Execution::current;
  if (!execution || execution->self() == kNobody) return;
  const auto mine = static_cast<std::size_t>(execution->self());
  writes_[mine] = execution->plainAccess();
  const std::uint32_t known = execution->clock(execution->self())[1 - mine];
  if (writes_[1 - mine] > known || reads_[1 - mine] > known) execution->violate("a data race");
}

}  // namespace tractiond::explore
