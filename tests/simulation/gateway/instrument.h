// The instrument that a simulated gateway is connected to: a double that publishes numbers and answers requests.
#pragma once

#include "gateway/config.h"
#include "tests/simulation/bus.h"
#include "tests/simulation/journal.h"
#include "tests/simulation/ongoing.h"

#include <array>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace tractiond::simulation {

inline constexpr const char* kRuntime = "/run/simulation";

/// What the instrument publishes, in the order of the topics.
enum class Published : std::size_t { kField, kDescription, kStatus, kPreview };
inline constexpr std::array<const char*, 4> kPublished = {"field", "description", "status", "preview"};
std::string topicOf(Published what);

class Instrument : public Server {
 public:
  /// Begins to listen. All references must outlive it.
  Instrument(Bus& bus, const Ongoing& ongoing, const gateway::Limits& limits, Journal& journal);
  ~Instrument() override;

  /// Laws: a forwarded request names its client; the rate of requests of each key, and of all, stays within the limits.
  void heed(const std::string& endpoint, std::span<const std::string_view> parts) override;
  void lose(const std::string& endpoint) override;
  /// Goes away for a while, or forgets a subscription, as the event says.
  void heed(const Happening& one);
  /// Publishes and answers what is due.
  void turn();
  std::int64_t next_ns() const;

  bool isThere() const { return isThere_; }
  /// Returns since when it is there, or not.
  std::int64_t changed_ns() const { return changed_ns_; }
  /// Returns when it forgot the subscription to latest; a time long ago: never.
  std::int64_t forgot_ns() const { return forgot_ns_; }
  bool wantsPreviews() const { return topics_.contains(topicOf(Published::kPreview)); }
  /// Returns the number of messages of a kind that were published so far.
  std::uint64_t published(Published what) const { return numbers_[static_cast<std::size_t>(what)]; }
  std::uint64_t requests() const { return requests_; }

 private:
  struct Answer {
    std::int64_t at_ns;
    std::string route, text;
  };

  void begin();
  void publish(Published what);

  Bus& bus_;
  const Ongoing& ongoing_;
  const gateway::Limits limits_;
  Journal& journal_;
  bool isThere_ = false;
  std::int64_t changed_ns_ = 0, forgot_ns_ = now() - 100 * kSecond, field_ns_ = 0, status_ns_ = 0,
               description_ns_ = kNever, preview_ns_ = 0;
  std::multiset<std::string> topics_, latest_;  ///< subscriptions at stream, at latest
  std::array<std::uint64_t, kPublished.size()> numbers_{};
  std::deque<Answer> answers_;
  std::map<std::string, std::deque<std::int64_t>> asked_ns_;  ///< of each key; "": of all
  std::uint64_t requests_ = 0;
};

}  // namespace tractiond::simulation
