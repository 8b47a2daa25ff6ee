#include "tests/simulation/statuses.h"

#include "traction/v1/status.pb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::simulation {

Statuses::Statuses(const Ledger& ledger, Journal& journal)
    : ledger_(ledger)
    , journal_(journal)
    , opened_ns_(now())
    , last_ns_(now()) {}

void Statuses::add(const TractionField& field) {
  const FrameTimes& times = field.markers.info.times;
  const std::array durations_ns = {times.tracked_ns - times.received_ns, times.solved_ns - times.tracked_ns,
                                   now() - times.solved_ns, now() - times.received_ns};
  for (std::size_t i = 0; i < kStages; ++i) durations_ns_[i].push_back(durations_ns[i]);
  residualSquares_px2_ += field.residual_px * field.residual_px;
  frame_ = field.markers.info.frameNumber;
}

void Statuses::expect(const char* name, double said, double is) const {
  journal_.law(std::abs(said - is) <= 1e-9 * (1.0 + std::abs(is)), "a status is true",
               [&] { return fmt::format("{} is {}, not {}", name, is, said); });
}

void Statuses::check(std::string_view bytes) {
  traction::v1::Status status;
  journal_.law(status.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())), "a status is true", "unreadable");
  traction::v1::Ledger account;
  const std::uint64_t ended = ledger_.copyTo(account), received = ledger_.received.get();
  account.set_received(received);
  account.set_in_flight(received - ended);
  journal_.law(status.ledger().SerializeAsString() == account.SerializeAsString(), "a status is true", "its account");
  expect("the time since the start", status.uptime_s(), 1e-9 * static_cast<double>(now() - opened_ns_));
  expect("the last frame", static_cast<double>(status.header().frame_number()), static_cast<double>(frame_));

  const double interval_s = 1e-9 * static_cast<double>(now() - std::exchange(last_ns_, now()));
  const auto frames = static_cast<double>(received - std::exchange(receivedBefore_, received));
  const auto fields = static_cast<double>(durations_ns_[0].size());
  const double squares_px2 = std::exchange(residualSquares_px2_, 0.0);
  auto durations_ns = std::exchange(durations_ns_, {});
  if (std::exchange(sequence_, status.header().sequence()) + 1 != status.header().sequence()) return;
  expect("the rate of frames", status.rates().received_hz() * interval_s, frames);
  expect("the rate of fields", status.rates().published_hz() * interval_s, fields);
  expect("the residual", status.residual_px(), fields > 0.0 ? std::sqrt(squares_px2 / fields) : 0.0);
  const traction::v1::Latencies& latencies = status.latencies();
  const std::array stages = {&latencies.track(), &latencies.solve(), &latencies.send(), &latencies.total()};
  for (std::size_t i = 0; i < kStages; ++i) {
    std::vector<std::int64_t>& all = durations_ns[i];
    std::ranges::sort(all);
    const auto at = [&all](double share) {
      if (all.empty()) return 0.0;
      const auto nth = static_cast<std::size_t>(std::lround(share * static_cast<double>(all.size() - 1)));
      return 1e-9 * static_cast<double>(all[nth]);
    };
    expect("a median latency", stages[i]->p50_s(), at(0.5));
    expect("a latency of one in a hundred", stages[i]->p99_s(), at(0.99));
    expect("the longest latency", stages[i]->max_s(), at(1.0));
  }
}

}  // namespace tractiond::simulation
