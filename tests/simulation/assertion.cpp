#include "tests/simulation/assertion.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <future>
#include <memory>
#include <string_view>
#include <thread>

namespace tractiond::simulation {
namespace {

using Failure = std::promise<std::optional<std::string>>;

/// Of the work that this thread does; nullptr: it does none.
thread_local Failure* failure = nullptr;  // NOLINT(*-avoid-non-const-global-variables): assert() has no other way to it

}  // namespace

std::optional<std::string> failedAssertionOf(const std::function<void()>& work) {
  auto outcome = std::make_unique<Failure>();
  std::future<std::optional<std::string>> failed = outcome->get_future();
  std::thread thread([&work, mine = outcome.get()] {
    failure = mine;
    work();
    mine->set_value(std::nullopt);
  });
  auto assertion = failed.get();
  if (!assertion) {
    thread.join();
    return std::nullopt;
  }
  thread.detach();
  (void)outcome.release();  // the thread's, which stays
  return assertion;
}

}  // namespace tractiond::simulation

/// Takes the place of the C library's. An exception could not pass through it, as it is declared noexcept.
// NOLINTNEXTLINE(*-reserved-identifier)
extern "C" [[noreturn]] void __assert_fail(const char* assertion, const char* file, unsigned line,
                                           const char* function) noexcept {
  using tractiond::simulation::failure;
  if (failure == nullptr) {
    std::fprintf(stderr, "%s:%u: %s: Assertion `%s' failed.\n", file, line, function, assertion);
    std::abort();
  }
  const std::string_view path = file;
  failure->set_value(fmt::format("{}:{}: {}", path.substr(path.rfind('/') + 1), line, assertion));
  for (;;) pause();
}
