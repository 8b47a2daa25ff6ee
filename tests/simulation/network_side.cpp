#include "tests/simulation/network_side.h"

#include <fmt/format.h>

#include <cstring>
#include <utility>

namespace tractiond::simulation {
namespace {

using std::chrono_literals::operator""ms;

std::string endpoint(int port) {
  return fmt::format("tcp://127.0.0.1:{}", port);
}

publish::Description describe(const Gel& gel) {
  publish::Description description;
  description.identity.sensor = kSensor;
  const std::int64_t boot = now();  // another one for each life
  std::memcpy(description.identity.boot.data(), &boot, sizeof boot);
  description.sensor = gel.sensor;
  return description;
}

}  // namespace

NetworkSide::NetworkSide(const Gel& gel, const Ledger& ledger, CaptureSide& camera, Subscribers& subscribers,
                         const Starvation& starvation, Journal& journal)
    : camera_(camera)
    , subscribers_(subscribers)
    , starvation_(starvation)
    , journal_(journal)
    , description_(simulation::describe(gel))
    , publisher_(std::move(*publish::Publisher::open(
          {.stream = {endpoint(kStreamPort)}, .latest = {endpoint(kLatestPort)}}, description_, ledger, {})))
    , control_(std::move(*control::ControlServer::open({endpoint(kControlPort)}, *publisher_)))
    , snapshots_(control_.get())
    , statuses_(ledger, journal) {
  subscribers_.begin();
}

NetworkSide::~NetworkSide() {
  subscribers_.die();
}

void NetworkSide::publish(const TractionField& field) {
  statuses_.add(field);
  publisher_->publish(field);
  checkStatus();
  subscribers_.heedPublished(field.markers.info);
}

void NetworkSide::serveSubscribers() {
  publisher_->serve(-1, 0ms);
  checkStatus();
}

void NetworkSide::checkStatus() {
  const std::uint64_t soFar = subscribers_.statuses();
  if (std::exchange(statusesSoFar_, soFar) != soFar) statuses_.check(publisher_->lastStatus());
}

void NetworkSide::control(control::Requests& requests) {
  control_->serve(0ms, requests);
  if (const auto answer = camera_.takeAnswer()) control_->answerCamera(*answer);
  if (const auto step = control_->takeCameraStep()) camera_.ask(*step);
  snapshots_.turn();
  constexpr std::int64_t kHeard_ns = 300 * kMs;
  const std::int64_t changed_ns = subscribers_.previewsChanged_ns();
  journal_.law(publisher_->previewWanted() == subscribers_.wantsPreviews() ||
                   now() - changed_ns <= kHeard_ns + starvation_.since(changed_ns),
               "it is known whether previews are wanted", "");
}

void NetworkSide::describe(const RestPose& pose) {
  description_.zero = pose;
  publisher_->describe(description_);
}

}  // namespace tractiond::simulation
