#include "tests/simulation/fiber.h"

#include "base/clock.h"

#include <algorithm>
#include <utility>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#endif

namespace tractiond::simulation {
namespace {

constexpr std::size_t kStack = 512 * 1024;  // bytes; more than a turn with its laws takes, also with sanitizers

Fiber*& running() {
  static Fiber* one = nullptr;
  return one;
}

// Tell the sanitizer, if there is one, before and after a switch which stack is in use.
void announce([[maybe_unused]] void** fake, [[maybe_unused]] const void* stack, [[maybe_unused]] std::size_t size) {
#ifdef __SANITIZE_ADDRESS__
  __sanitizer_start_switch_fiber(fake, stack, size);
#endif
}
void confirm([[maybe_unused]] void* fake, [[maybe_unused]] const void** left, [[maybe_unused]] std::size_t* size) {
#ifdef __SANITIZE_ADDRESS__
  __sanitizer_finish_switch_fiber(fake, left, size);
#endif
}

}  // namespace

Fiber::Fiber(std::function<void()> turn)
    : turn_(std::move(turn))
    , stack_(new std::byte[kStack]) {
  getcontext(&own_);
  own_.uc_stack.ss_sp = stack_.get();
  own_.uc_stack.ss_size = kStack;
  makecontext(&own_, &Fiber::run, 0);
}

Fiber::~Fiber() {
  try {
    end();
  } catch (...) {  // NOLINT(bugprone-empty-catch): its world is going
  }
}

/// The stack's outermost function, through which no exception can pass.
void Fiber::run() {
  Fiber& self = *running();
  confirm(nullptr, &self.callersStack_, &self.callersSize_);
  for (;;) {
    try {
      self.turn_();
    } catch (...) {
      self.thrown_ = std::current_exception();
    }
    self.isInTurn_ = false;
    self.leave();
  }
}

void Fiber::leave() {
  announce(&ownFake_, callersStack_, callersSize_);
  swapcontext(&own_, &caller_);
  confirm(ownFake_, &callersStack_, &callersSize_);
}

void Fiber::enter() {
  Fiber* const before = std::exchange(running(), this);
  announce(&callersFake_, stack_.get(), kStack);
  swapcontext(&caller_, &own_);
  confirm(callersFake_, nullptr, nullptr);
  running() = before;
}

bool Fiber::go() {
  isInTurn_ = true;
  enter();
  clocks().hurried_ns = 0;
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  return !isInTurn_;
}

void Fiber::end() {
  hurries_ = true;
  if (isInTurn_) go();
}

void Fiber::wait(std::int64_t until_ns, std::function<bool()> isOver) {
  Fiber* const self = running();
  if (self == nullptr || isOver()) return;
  if (!self->hurries_) {
    self->until_ns_ = until_ns;
    self->isOver_ = std::move(isOver);
    self->leave();
    if (!self->hurries_ || self->isOver_()) return;
  }
  clocks().hurried_ns = std::max<std::int64_t>(until_ns - now(), 0);
}

void Fiber::sleep(std::int64_t for_ns) {
  wait(monotonicNow() + for_ns, [] { return false; });
}

}  // namespace tractiond::simulation
