// traction-touch: parses the arguments, runs, and returns the exit code.
#include "base/network/socket_file.h"
#include "base/service/log.h"
#include "base/service/own_directory.h"
#include "base/service/service.h"
#include "base/service/time_slice.h"
#include "client/touch/arguments.h"
#include "client/touch/hand_relay.h"
#include "client/touch/publisher.h"
#include "client/touch/relay.h"
#include "client/touch/source.h"
#include "proto/traction/v1/endpoints.h"

#include <spdlog/spdlog.h>

#include <exception>
#include <filesystem>
#include <string>
#include <vector>

namespace traction::contacts {
namespace {

constexpr const char* kName = "traction-touch";

/// Publishes the contacts of a relay.
class Published : public RelayOutput {
 public:
  explicit Published(Publisher& publisher)
      : publisher_(publisher) {}

  void take(const Follower&, const v1::Contacts& contacts, const Field*) override { publisher_.send(contacts); }

 private:
  Publisher& publisher_;
};

/// Runs until a signal comes.
int run(auto&& relay, const Publisher& publisher) {
  for (const std::string& endpoint : publisher.endpoints()) spdlog::info("listening at {}", endpoint);
  runRelay(relay);
  return EX_OK;
}

/// Follows contacts until SIGTERM or SIGINT, and publishes their ends then; or joins fields to grasps. Returns the exit
/// code.
int serve(const Arguments& arguments) {
  tractiond::catchSignals();
  tractiond::shortenTimeSlice(0);  // and ZeroMQ's threads, which start later: a field waits for none that computes
  if (const auto raised = tractiond::raiseDescriptorLimit(); !raised) return failed(kName, raised.error());
  const auto hand = arguments.hand.empty() ? tl::expected<HandFile, tractiond::Error>() : loadHand(arguments.hand);
  if (!hand) return failed(kName, hand.error());
  const std::string& instance = arguments.hand.empty() ? arguments.source.instance : hand->name;
  const auto runtime = std::filesystem::absolute(
      arguments.runtime.empty() ? tractiond::runtimeDirectory(instance, kTouch) : arguments.runtime);
  const auto own = tractiond::OwnDirectory::claim(runtime, "runtime directory", kName);
  if (!own) return failed(kName, own.error());
  std::vector<std::string> endpoints = {ipcEndpoints(runtime).stream};
  if (instance == kDefaultInstance) endpoints.push_back(touchTcpEndpoints().stream);
  const tractiond::Log log(kName, "info");
  const auto publisher = Publisher::open(endpoints);
  if (!publisher) {
    tractiond::Error error = publisher.error();
    if (tractiond::network::isInUse(error))
      error.remedy =
          "is another traction-touch running? Give this one a name with --instance, or in the file of the hand";
    return spdlog::error("{}", error.message()), error.exitCode;
  }
  Published published(**publisher);
  return arguments.hand.empty() ? run(Relay(arguments.source, published), **publisher)
                                : run(HandRelay(*hand, randomId(), **publisher), **publisher);
}

}  // namespace
}  // namespace traction::contacts

int main(int argc, char** argv) try {
  const auto arguments = traction::contacts::parseArguments(argc, argv);
  return arguments ? traction::contacts::serve(*arguments) : arguments.error();
} catch (const std::exception& error) {
  return traction::contacts::failed(traction::contacts::kName, error);
}
