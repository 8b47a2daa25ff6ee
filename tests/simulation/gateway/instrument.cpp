#include "tests/simulation/gateway/instrument.h"

#include "proto/traction/v1/endpoints.h"
#include "traction/v1/control.pb.h"

#include <fmt/format.h>

#include <algorithm>

namespace tractiond::simulation {
namespace {

constexpr std::int64_t kField_ns = 16'666'667, kPreviewEach_ns = 500 * kMs, kToNew_ns = 100 * kMs;

const traction::Endpoints& endpoints() {
  static const traction::Endpoints all = traction::ipcEndpoints(kRuntime);
  return all;
}

}  // namespace

std::string topicOf(Published what) {
  return traction::topicOf("simulation", kPublished.at(static_cast<std::size_t>(what)));
}

Instrument::Instrument(Bus& bus, const Ongoing& ongoing, const gateway::Limits& limits, Journal& journal)
    : bus_(bus)
    , ongoing_(ongoing)
    , limits_(limits)
    , journal_(journal) {
  begin();
}

Instrument::~Instrument() = default;

void Instrument::begin() {
  isThere_ = true;
  changed_ns_ = field_ns_ = status_ns_ = now();
  for (const std::string& endpoint : {endpoints().stream, endpoints().latest, endpoints().control})
    bus_.listen(endpoint, *this);
}

void Instrument::heed(const Happening& one) {
  if (one.event == Event::kUnsubscribed && !latest_.empty()) {
    latest_.clear();
    forgot_ns_ = now();
  }
  if (one.event != Event::kInstrumentGone || !isThere_) return;
  journal_.say("the instrument goes away");
  isThere_ = false;
  changed_ns_ = now();
  for (const std::string& endpoint : {endpoints().stream, endpoints().latest, endpoints().control})
    bus_.stopListening(endpoint);
  topics_.clear();
  latest_.clear();
  answers_.clear();
}

void Instrument::heed(const std::string& endpoint, std::span<const std::string_view> parts) {
  if (endpoint != endpoints().control) {
    auto& topics = endpoint == endpoints().latest ? latest_ : topics_;
    const std::string topic(parts[0].substr(1));
    if (parts[0].starts_with('\1')) {
      topics.insert(topic);
      if (endpoint == endpoints().stream && description_ns_ == kNever) description_ns_ = now() + kToNew_ns;
    } else if (const auto one = topics.find(topic); one != topics.end()) {
      topics.erase(one);
    }
    return;
  }
  traction::v1::Request request;
  const bool isRead = parts.size() == 3 && parts[1].empty() &&
                      request.ParseFromArray(parts[2].data(), static_cast<int>(parts[2].size()));
  journal_.law(isRead, "the instrument understands what is forwarded",
               [&] { return fmt::format("{} parts", parts.size()); });
  ++requests_;
  // The client writes into its request which key and address it has.
  const std::string claimed = request.camera().read().name(), who = claimed.substr(0, claimed.find('#'));
  journal_.law(request.on_behalf_of() == who, "a forwarded request names its client",
               [&] { return request.on_behalf_of() + ", not " + who; });
  const std::string name = who.substr(0, who.rfind('"') + 1);
  for (const auto& [whose, most] :
       {std::pair{name, limits_.requestsPerSecondEach}, {std::string(), limits_.requestsPerSecond}}) {
    auto& asked = asked_ns_[whose];
    asked.push_back(now());
    while (asked.front() <= now() - kSecond) asked.pop_front();
    // The gateway counts from the first request of a second on: a second between may have those of two.
    journal_.law(std::cmp_less_equal(asked.size(), 2 * most), "the rate of requests stays within the limits",
                 [&] { return fmt::format("{} in a second, of {}", asked.size(), whose.empty() ? "all" : whose); });
  }
  const std::int64_t slow_ns =
      ongoing_.lasts(Event::kInstrumentSlow) ? ongoing_.amountOf(Event::kInstrumentSlow) * kMs : kMs;
  traction::v1::Reply reply;
  reply.set_version(1);
  reply.set_error(claimed);
  answers_.push_back({now() + slow_ns, std::string(parts[0]), reply.SerializeAsString()});
}

void Instrument::lose(const std::string& endpoint) {
  if (endpoint == endpoints().control) {
    answers_.clear();
    asked_ns_.clear();  // another gateway counts anew
  }
  if (endpoint == endpoints().stream) topics_.clear();
  if (endpoint == endpoints().latest) latest_.clear();
}

void Instrument::publish(Published what) {
  const std::string number = std::to_string(++numbers_[static_cast<std::size_t>(what)]);
  const std::string topic = topicOf(what), body = "\x09" + number;
  bus_.sendFrom(endpoints().stream, std::array{topic, body, std::string()});
  if (what == Published::kField && !latest_.empty()) bus_.sendFrom(endpoints().latest, std::array{body});
}

void Instrument::turn() {
  if (!isThere_ && !ongoing_.lasts(Event::kInstrumentGone)) {
    journal_.say("the instrument is back");
    begin();
  }
  if (!isThere_) return;
  for (; field_ns_ <= now(); field_ns_ += kField_ns) publish(Published::kField);
  for (; status_ns_ <= now(); status_ns_ += kSecond) publish(Published::kStatus);
  if (description_ns_ <= now()) {
    description_ns_ = kNever;
    publish(Published::kDescription);
  }
  if (wantsPreviews() && preview_ns_ <= now()) {
    preview_ns_ = now() + kPreviewEach_ns;
    publish(Published::kPreview);
  }
  std::ranges::stable_sort(answers_, {}, &Answer::at_ns);
  for (; !answers_.empty() && answers_.front().at_ns <= now(); answers_.pop_front())
    bus_.sendFrom(endpoints().control, std::array{answers_.front().route, std::string(), answers_.front().text});
}

std::int64_t Instrument::next_ns() const {
  if (!isThere_) return ongoing_.until_ns(Event::kInstrumentGone);
  std::int64_t next = std::min({field_ns_, status_ns_, description_ns_});
  if (wantsPreviews()) next = std::min(next, preview_ns_);
  for (const Answer& one : answers_) next = std::min(next, one.at_ns);
  return next;
}

}  // namespace tractiond::simulation
