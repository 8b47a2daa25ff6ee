#include "client/cli/scene.h"

#include <algorithm>
#include <cmath>

namespace traction::cli {

namespace {

constexpr std::int64_t kWindow_ns = 2'000'000'000;
constexpr std::int64_t kSample_ns = 250'000'000;
constexpr std::size_t kSamples = 240;

}  // namespace

double length(const Vector3& vector) {
  return std::hypot(vector[0], vector[1], vector[2]);
}

void Scene::add(Message message) {
  lastArrival_ns = std::visit([](const auto& any) { return any.header.arrived_ns; }, message);
  if (auto* newField = std::get_if<Field>(&message)) {
    ++fields;
    arrivals_.push_back({lastArrival_ns, lastArrival_ns - newField->header.received_ns});
    while (lastArrival_ns - arrivals_.front().at_ns > kWindow_ns) arrivals_.pop_front();
    if (lastArrival_ns - sampled_ns_ >= kSample_ns) {
      sampled_ns_ = lastArrival_ns;
      history_.push_back(length(newField->resultant_N));
      if (history_.size() > kSamples) history_.pop_front();
    }
    field = std::move(*newField);
  } else if (auto* newDescription = std::get_if<Description>(&message)) {
    description = std::move(*newDescription);
  } else if (auto* newStatus = std::get_if<Status>(&message)) {
    status = std::move(*newStatus);
  }
}

double Scene::rate_hz(std::int64_t now_ns) const {
  const auto recent = std::find_if(arrivals_.begin(), arrivals_.end(),
                                   [&](const Arrival& arrival) { return now_ns - arrival.at_ns <= kWindow_ns; });
  const auto count = arrivals_.end() - recent;
  if (count < 2) return 0.0;
  // Between arrivals, not over the window: right from the second field on; and it falls when they stay away.
  const double gap_s =
      static_cast<double>(arrivals_.back().at_ns - recent->at_ns) / static_cast<double>(count - 1) * 1e-9;
  const double silence_s = static_cast<double>(now_ns - arrivals_.back().at_ns) * 1e-9;
  return silence_s > 3.0 * gap_s ? static_cast<double>(count) / (kWindow_ns * 1e-9) : 1.0 / gap_s;
}

std::optional<Scene::Latency> Scene::latency(std::int64_t now_ns) const {
  if (!description || !description->sameHost) return std::nullopt;
  std::vector<std::int64_t> recent;
  for (const Arrival& arrival : arrivals_) {
    if (now_ns - arrival.at_ns <= kWindow_ns) recent.push_back(arrival.latency_ns);
  }
  if (recent.empty()) return std::nullopt;
  const auto at = [&](double share) {
    const auto nth = recent.begin() + std::lround(share * static_cast<double>(recent.size() - 1));
    std::nth_element(recent.begin(), nth, recent.end());
    return static_cast<double>(*nth) * 1e-6;
  };
  return Latency{at(0.5), at(0.99)};
}

}  // namespace traction::cli
