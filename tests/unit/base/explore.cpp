// The threads of an execution: fibres, the choice of which goes next, and the search through all choices.
#include "tests/unit/base/execution.h"

#include <ucontext.h>

#include <algorithm>
#include <cstdlib>

namespace tractiond::explore {

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

}  // namespace tractiond::explore
