// Limits on the rates of requests and of log lines.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace tractiond::gateway {

/// Limits requests per second, of all clients together and of each. Not thread-safe.
class RequestLimit {
 public:
  /// \param most requests per second of all clients together
  /// \param mostEach of one client
  RequestLimit(int most, int mostEach)
      : most_(most)
      , mostEach_(mostEach) {}

  /// Counts a request of client `who`, unless it exceeds a limit. The counts begin anew with the first request that
  /// comes a second or more after they began last.
  /// \param now_ns CLOCK_MONOTONIC
  /// \return 0: the request may pass; otherwise the exceeded limit [requests/s], that of the client before that of all
  int beyond(const std::string& who, std::int64_t now_ns) {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    if (now_ns - since_ns_ >= kSecond_ns) {
      since_ns_ = now_ns;
      all_ = 0;
      each_.clear();
    }
    if (each_[who] >= mostEach_) return mostEach_;
    if (all_ >= most_) return most_;
    ++each_[who];
    ++all_;
    return 0;
  }

 private:
  int most_, mostEach_;
  std::int64_t since_ns_ = 0;
  int all_ = 0;
  std::map<std::string, int> each_;
};

/// Limits log lines of one kind to one per 5 s; the next line states how many were left out. Not thread-safe.
class SeldomLine {
 public:
  /// Returns the line to log: `line`, with the number left out since the last one if there are some; empty if none is
  /// due.
  /// \param now_ns CLOCK_MONOTONIC
  std::string next(const std::string& line, std::int64_t now_ns) {
    constexpr std::int64_t kPause_ns = 5'000'000'000;
    if (said_ && now_ns - last_ns_ < kPause_ns) return ++unsaid_, "";
    said_ = true;
    last_ns_ = now_ns;
    const int others = std::exchange(unsaid_, 0);
    return others == 0 ? line : line + " (and " + std::to_string(others) + " like it before)";
  }

 private:
  bool said_ = false;
  std::int64_t last_ns_ = 0;
  int unsaid_ = 0;
};

}  // namespace tractiond::gateway
