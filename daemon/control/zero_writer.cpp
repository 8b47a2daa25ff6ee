#include "daemon/control/zero_writer.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

namespace tractiond::control {
namespace {

/// Time until the next try to write the zero in force.
constexpr std::int64_t kTryAgain_ns = 10'000'000'000;

}  // namespace

const char* const ZeroWriter::kNotWritten = "it was not written to the disk within a minute";

void ZeroWriter::writeRequested(const RestPose& zero, const RestPose* before, std::int64_t until_ns) {
  start(State::kRequested, zero, before, until_ns);
}

void ZeroWriter::writeInForce(const RestPose& zero, const RestPose* before) {
  start(State::kInForce, zero, before, clock_() + kWithin_ns);
  turn();
}

void ZeroWriter::start(State state, const RestPose& zero, const RestPose* before, std::int64_t until_ns) {
  done_ = host_.keep(zero, before);
  until_ns_ = until_ns;
  state_ = state;
}

std::optional<ZeroWriter::Written> ZeroWriter::turn() {
  if (!isBusy()) return std::nullopt;
  if (done_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    if (state_ != State::kRequested || !isStuck()) return std::nullopt;
    state_ = State::kRefused;
    return tl::unexpected(Error{.what = kNotWritten});
  }
  Written written = done_.get();
  const State ended = std::exchange(state_, State::kIdle);
  dueAt_ns_.reset();
  if (ended == State::kInForce) {
    if (!written) dueAt_ns_ = clock_() + kTryAgain_ns;
    log(written);
    return std::nullopt;
  }
  if (ended == State::kRefused || !written) dueAt_ns_ = clock_();
  return ended == State::kRefused ? std::nullopt : std::optional(std::move(written));
}

void ZeroWriter::log(const Written& written) {
  if (written && std::exchange(isFailureLogged_, false)) spdlog::info("the zero in force has been written to the disk");
  if (!written && !std::exchange(isFailureLogged_, true)) {
    spdlog::error("the zero in force could not be written, which is tried again every 10 s: {}",
                  written.error().message());
  }
}

}  // namespace tractiond::control
