// The memory of an execution: which stores a load may read, and which accesses race.
#include "tests/unit/base/execution.h"

#include <algorithm>

namespace tractiond::explore {

namespace {

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
