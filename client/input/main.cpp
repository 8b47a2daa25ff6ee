// traction-input: parses the arguments, runs, and returns the exit code.
#include "base/clock.h"
#include "base/error.h"
#include "base/service/log.h"
#include "base/service/service.h"
#include "base/service/time_slice.h"
#include "client/input/arguments.h"
#include "client/input/outputs.h"
#include "client/input/profile.h"
#include "client/input/teacher.h"
#include "client/touch/relay.h"
#include "client/touch/source.h"

#include <spdlog/spdlog.h>
#include <sysexits.h>

#include <cstdint>
#include <exception>
#include <iostream>
#include <memory>
#include <utility>
#include <vector>

namespace traction::input {
namespace {

constexpr const char* kName = "traction-input";

/// Passes contacts on to all outputs.
class Outputs : public contacts::RelayOutput {
 public:
  Outputs(double turn_rad, std::vector<std::unique_ptr<Output>> outputs)
      : view_(turn_rad)
      , outputs_(std::move(outputs)) {}

  void take(const contacts::Follower& follower, const v1::Contacts&, const Field* field) override {
    const Touches& touches = view_.take(follower.contacts(), field, follower.time_ns(),
                                        field != nullptr ? follower.nodesOf(*field) : nullptr);
    for (const auto& output : outputs_) output->write(touches);
  }
  void turn() override { turn(tractiond::monotonicNow()); }
  void turn(std::int64_t now_ns) {
    for (const auto& output : outputs_) output->turn(now_ns);
  }

 private:
  View view_;
  std::vector<std::unique_ptr<Output>> outputs_;
};

/// Returns the outputs of the profile, or the one that prints strokes.
tl::expected<std::vector<std::unique_ptr<Output>>, tractiond::Error> outputsOf(const Arguments& arguments,
                                                                               const Profile& profile) {
  if (arguments.taught.empty()) return openOutputs(profile);
  std::vector<std::unique_ptr<Output>> outputs;
  outputs.push_back(std::make_unique<Teacher>(arguments.taught, arguments.areDigits, std::cout));
  return outputs;
}

int serve(const Arguments& arguments) {
  const auto profile = arguments.taught.empty() ? loadProfile(arguments.profile) : Profile();
  if (!profile) return contacts::failed(kName, profile.error());
  if (arguments.checks) return EX_OK;
  tractiond::catchSignals();
  tractiond::shortenTimeSlice(0);  // and ZeroMQ's threads, which start later
  const tractiond::Log log(kName, "info");
  auto outputs = outputsOf(arguments, *profile);
  if (!outputs) return spdlog::error("{}", outputs.error().message()), outputs.error().exitCode;
  Outputs all(profile->turn_rad, *std::move(outputs));
  contacts::Relay relay(arguments.source, all);
  contacts::runRelay(relay);
  // No later datagram would tell of the last ends.
  for (const int times : {1, 2}) all.turn(tractiond::monotonicNow() + times * kRepeat_ns);
  return EX_OK;
}

}  // namespace
}  // namespace traction::input

int main(int argc, char** argv) try {
  const auto arguments = traction::input::parseArguments(argc, argv);
  return arguments ? traction::input::serve(*arguments) : arguments.error();
} catch (const std::exception& error) {
  return traction::contacts::failed(traction::input::kName, error);
}
