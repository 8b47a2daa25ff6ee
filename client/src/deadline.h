// Ends of waits, and errors of ZeroMQ as those of this library.
#pragma once

#include "traction/error.h"

#include <zmq.hpp>

#include <algorithm>
#include <chrono>
#include <string>

namespace traction {

/// Returns when a wait of `timeout` that begins now ends; with a negative one now, and at most 31 years from now, as
/// the clock's range is limited.
inline std::chrono::steady_clock::time_point endAfter(std::chrono::milliseconds timeout) {
  constexpr std::chrono::milliseconds kNone{0}, kLongest{1'000'000'000'000};
  return std::chrono::steady_clock::now() + std::clamp(timeout, kNone, kLongest);
}

/// Returns kNoAnswer for an error of ZeroMQ that is not of an endpoint: no descriptors or memory are left.
inline Error noConnection(const std::string& endpoint, const zmq::error_t& error) {
  return {ErrorCode::kNoAnswer, "no connection to " + endpoint + " can be made: " + error.what()};
}

}  // namespace traction
