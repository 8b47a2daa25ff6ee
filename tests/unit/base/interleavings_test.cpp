// Proves the lock-free parts by running all interleavings of two threads (explore.h), and each of their memory orders
// by weakening it: then some interleaving must break a law. Prints how many executions there were. The ring's orders
// are weakened in the ring's own trials.

#include "base/link.h"
#include "base/loan.h"
#include "base/mailbox.h"
#include "tests/support/places.h"
#include "tests/unit/base/explore.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <regex>

namespace tractiond::interleavings_test {
namespace {

using explore::Atomic;
using explore::Plain;
using explore::Report;
using explore::require;
using explore::Site;

struct Item {
  Plain<int> number;
};

// What arrives is in order, and nothing arrives twice.
class Order {
 public:
  void arrives(int number) {
    require(number > last_, "what is taken is newer than what was taken before");
    last_ = number;
    ++count_;
  }
  int count() const { return count_; }
  int last() const { return last_; }

 private:
  int last_ = 0, count_ = 0;
};

// The producer waits for room; all arrives.
template <std::size_t kCapacity, int kItems>
class RingThatIsFull : public explore::Trial {
 public:
  void first() override {
    for (int n = 1; n <= kItems; ++n) {
      Item& item = items_[static_cast<std::size_t>(n - 1)];
      item.number = n;
      while (!ring_.push(&item)) explore::wait();
    }
  }
  void second() override {
    while (taken_.count() < kItems) {
      if (Item* item = ring_.pop()) {
        require(item->number.get() == taken_.last() + 1, "each is taken once, in order");
        taken_.arrives(item->number.get());
        item->number = 0;
      } else {
        explore::wait();
      }
    }
  }
  void after() override { require(!ring_.pop(), "nothing is left"); }

 private:
  std::array<Item, kItems> items_;
  Ring<Item, kCapacity, Atomic> ring_;
  Order taken_;
};

// The producer takes the oldest back when it needs room; the consumer looks now and then.
template <std::size_t kCapacity, int kItems, int kTakes>
class RingWithTwoTakers : public explore::Trial {
 public:
  void first() override {
    for (int n = 1; n <= kItems; ++n) {
      Item& item = items_[static_cast<std::size_t>(n - 1)];
      item.number = n;
      while (!ring_.push(&item)) {
        if (Item* oldest = ring_.pop()) evicted_.arrives(use(*oldest));
      }
    }
  }
  void second() override {
    for (int take = 0; take < kTakes; ++take) {
      if (Item* item = ring_.pop()) taken_.arrives(use(*item));
    }
  }
  void after() override {
    Order left;
    while (Item* item = ring_.pop()) left.arrives(use(*item));
    require(taken_.count() + evicted_.count() + left.count() == kItems, "put in = taken + evicted + left");
    require(left.count() == 0 || left.last() == kItems, "the newest is left");
  }

 private:
  // An item in two hands is a data race here.
  static int use(Item& item) {
    const int number = item.number.get();
    require(number > 0, "each is taken once");
    item.number = 0;
    return number;
  }

  std::array<Item, kItems> items_;
  Ring<Item, kCapacity, Atomic> ring_;
  Order taken_, evicted_;
};

template <int kPuts, int kTakes>
class MailboxUnderway : public explore::Trial {
 public:
  void first() override {
    for (int n = 1; n <= kPuts; ++n) {
      if (box_.put(Item{n})) put_[static_cast<std::size_t>(n)] = true;
    }
  }
  void second() override {
    for (int n = 0; n < kTakes; ++n) take();
  }
  void after() override {
    const auto newest = std::find(put_.rbegin(), put_.rend(), true);
    take();
    require(taken_.last() == std::distance(newest, put_.rend()) - 1, "the newest that was put is there or was taken");
    require(!take(), "what was taken is gone");
  }

 private:
  bool take() {
    Item item;
    if (!box_.take(item)) return false;
    taken_.arrives(item.number.get());
    return true;
  }

  Mailbox<Item, Atomic> box_;
  std::array<bool, kPuts + 1> put_{true};
  Order taken_;
};

template <int kLoans>
class LoanThatComesBack : public explore::Trial {
 public:
  void first() override {
    for (int n = 1; n <= kLoans; ++n) {
      record()->number = n;
      loan_.lend();
      require(record()->number.get() == -n, "what comes back is filled");
    }
  }
  void second() override {
    for (int n = 1; n <= kLoans;) {
      Item* record = loan_.lent();
      if (!record) {
        explore::wait();
        continue;
      }
      require(record->number.get() == n, "what is lent is what the owner made");
      record->number = -n;
      loan_.giveBack();
      ++n;
    }
  }
  void after() override { require(!loan_.lent() && loan_.own(), "the owner has it in the end"); }

 private:
  Item* record() {
    for (;;) {
      if (Item* record = loan_.own()) return record;
      explore::wait();
    }
  }

  Loan<Item, Atomic> loan_;
};

// The least that an Event promises: it orders nothing and wakes early.
struct EarlyWake {
  void signal() {}
  void wait(std::chrono::milliseconds /*timeout*/) { explore::wait(); }
};

// kBefore items are on their way when the threads begin. The consumer looks until the end, or kTakes times.
template <WhenFull kWhenFull, int kBefore, int kItems, int kTakes = 1000, std::size_t kSlots = 3>
class LinkUnderway : public explore::Trial {
 public:
  LinkUnderway() {
    for (int n = 1; n <= kBefore; ++n) push(link_.acquire(), n);
  }
  void first() override {
    for (int n = kBefore + 1; n <= kItems; ++n) {
      Item* slot = link_.acquire();
      require(slot || kWhenFull == WhenFull::kWait, "a link that evicts always has a slot");
      for (; !slot; slot = link_.acquire()) link_.waitForRoom({});
      push(slot, n);
    }
    link_.close();
  }
  void second() override {
    for (int take = 0; take < kTakes; ++take) {
      const bool closed = link_.closed();
      if (Item* slot = link_.take()) {
        taken_.arrives(slot->number.get());
        slot->number = -taken_.last();
        link_.release(slot);
      } else if (closed) {
        ended_ = true;
        break;
      } else if (take + 1 < kTakes) {
        link_.wait({});
      }
    }
  }
  void after() override {
    const auto left = static_cast<int>(link_.discard()), evicted = static_cast<int>(evicted_.get());
    require(!ended_ || left == 0, "closed() and then no slot: all has been taken");
    require(taken_.count() + evicted + left == kItems, "put in = taken + evicted + left");
    require(reclaimed_ == kItems, "each slot comes back once");
    require(kWhenFull == WhenFull::kEvictOldest || evicted == 0, "a link that waits evicts nothing");
    require(kWhenFull == WhenFull::kWait || left <= static_cast<int>(kSlots) - 2, "one slot is for each side");
    require(left > 0 || taken_.last() == kItems, "the newest arrives");
  }

 private:
  void push(Item* slot, int number) {
    slot->number = number;
    link_.push(slot);
  }

  Counter evicted_;
  int reclaimed_ = 0;
  bool ended_ = false;
  Order taken_;
  Link<Item, kSlots, Atomic, EarlyWake> link_{kWhenFull, evicted_, {}, [this](Item& slot) {
                                                ++reclaimed_;
                                                slot.number = 0;
                                              }};
};

// How many operations of a header have an order that is stronger than relaxed.
std::ptrdiff_t ordersIn(const std::string& header) {
  std::ifstream file(test::source("base/" + header));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  static const std::regex order("std::memory_order_(acquire|release|acq_rel|seq_cst)");
  return std::distance(std::sregex_iterator(text.begin(), text.end(), order), std::sregex_iterator());
}

// All trials hold; with any single order of `header` weakened one of them does not.
template <typename... Trials>
void prove(const std::string& header) {
  Report all;
  std::vector<Site> sites;
  const auto run = [&](const Report& report) {
    EXPECT_EQ(report.violation, "");
    EXPECT_GT(report.executions, 0U);
    all.executions += report.executions;
    all.cut += report.cut;
    all.depth = std::max(all.depth, report.depth);
    for (const Site& site : report.ordered) {
      if (!std::string(site.file).ends_with("/" + header)) continue;
      if (std::find(sites.begin(), sites.end(), site) == sites.end()) sites.push_back(site);
    }
  };
  (run(explore::explore<Trials>()), ...);
  EXPECT_EQ(std::ssize(sites), ordersIn(header)) << "each operation is met, and has its order written down";
  std::size_t found = 0;
  for (const Site& site : sites) {
    const bool noticed = (!explore::explore<Trials>(site).violation.empty() || ...);
    EXPECT_TRUE(noticed) << header << ":" << site.line << ":" << site.column << " may be relaxed";
    found += noticed ? 1 : 0;
  }
  std::printf("%s: %llu executions of at most %d operations, %llu cut; %zu of %zu weakened orders found\n",
              header.c_str(), static_cast<unsigned long long>(all.executions), all.depth,
              static_cast<unsigned long long>(all.cut), found, sites.size());
}

TEST(Interleavings, OfTheRingHoldAndNeedEachOrder) {
  prove<RingThatIsFull<1, 3>, RingThatIsFull<2, 3>, RingWithTwoTakers<1, 3, 2>, RingWithTwoTakers<2, 3, 2>>("ring.h");
}

TEST(Interleavings, OfTheMailboxHoldAndNeedEachOrder) {
  prove<MailboxUnderway<3, 3>>("mailbox.h");
}

TEST(Interleavings, OfTheLoanHoldAndNeedEachOrder) {
  prove<LoanThatComesBack<2>>("loan.h");
}

TEST(Interleavings, OfTheLinkHoldAndNeedEachOrder) {
  constexpr auto kEvict = WhenFull::kEvictOldest, kWait = WhenFull::kWait;
  prove<LinkUnderway<kEvict, 0, 2>, LinkUnderway<kEvict, 0, 3, 1>, LinkUnderway<kEvict, 1, 2>,
        LinkUnderway<kEvict, 1, 3, 2>, LinkUnderway<kEvict, 2, 4, 1, 4>, LinkUnderway<kWait, 3, 4, 1>,
        LinkUnderway<kWait, 3, 5, 2>>("link.h");
}

}  // namespace
}  // namespace tractiond::interleavings_test
