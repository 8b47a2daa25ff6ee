// State of an instance at one time, collected from its messages.
#pragma once

#include "traction/subscriber.h"

#include <array>
#include <deque>
#include <string>
#include <vector>

namespace traction::client {

/// Not thread-safe. Times are CLOCK_MONOTONIC [ns] and passed in, as Header::arrived_ns of the messages.
class Scene {
 public:
  /// Adds a message. The first one of a new start of the daemon discards field, description and status of the one
  /// before.
  void add(Message message);
  /// States whether a publisher is connected, even if it has sent nothing yet; false before the first call.
  void setConnected(bool isConnected, std::int64_t now_ns);

  /// Why there is no current field. `what` stays the same as long as the reason does.
  struct Trouble {
    std::string what;      ///< "the camera is lost"; empty: there is a current field
    double since_s = 0.0;  ///< duration; if there has been a field, its age
  };
  /// Returns why there is no current field; an empty `what` if there is one, valid or not. A field is current for three
  /// times the usual time between two, but for 0.4 s at least and 3 s at most.
  /// \param now_ns CLOCK_MONOTONIC, as in the functions below
  Trouble trouble(std::int64_t now_ns) const;
  /// Returns what trouble() has returned as a sentence: "the camera is lost, no field for 12.3 s". Its `what` must not
  /// be empty.
  std::string sentence(const Trouble& trouble) const;

  /// Returns the contacts of traction-touch that have begun and not ended, by increasing id; nothing if it does not
  /// run: no message of it came in the last second.
  std::optional<std::vector<TrackedContact>> touching(std::int64_t now_ns) const;

  std::optional<Field> field;
  std::optional<Description> description;
  std::optional<Status> status;
  std::optional<Status> statusBefore;  ///< the status before, of the same start of the daemon
  std::uint64_t fields = 0;            ///< number received
  std::uint64_t lost = 0;              ///< lost on the way, by Subscriber::lost()
  std::int64_t lastArrival_ns = 0;
  std::int64_t restarted_ns = 0;                 ///< when a restart of the daemon was noticed; 0: never
  bool connected() const { return connected_; }  ///< Returns what setConnected() was given last.

  /// Returns whether the status is out of date: there is none, no publisher is connected, it is older than 1.45 s, or
  /// fields that arrived when it was sent have stopped.
  bool isStatusOld(std::int64_t now_ns) const;

  /// Returns the flags of the fields of the last two seconds, combined by bitwise or.
  std::uint32_t recentFlags(std::int64_t now_ns) const;

  /// Returns the rate of the fields of the last two seconds [1/s]; 0 if there are fewer than two.
  double rate_hz(std::int64_t now_ns) const;

  struct Latency {
    double p50_ms, p99_ms;  ///< median and 99th percentile
  };
  /// Returns the latency of the fields of the last two seconds, from their arrival from the camera driver until
  /// received here. Returns nothing if there are none, if no description states that the daemon runs on this host, or
  /// if they are a recording that is sent again.
  std::optional<Latency> latency(std::int64_t now_ns) const;

  /// Returns magnitudes of the resultant [N], one per quarter second in which a field came, newest last, at most 240; 0
  /// for a field that is not valid. Valid until the next add().
  const std::deque<double>& history() const { return history_; }

 private:
  struct Arrival {
    std::int64_t at_ns, latency_ns;
    std::uint32_t flags;
  };
  bool isOld(std::int64_t now_ns) const;
  std::string reason(std::int64_t now_ns) const;

  bool connected_ = false, wasConnected_ = false;
  bool heard_ = false;  ///< a message came since the last loss of the connection
  std::int64_t connectionChanged_ns_ = 0;
  Id boot_{};
  std::int64_t fieldArrival_ns_ = 0, statusArrival_ns_ = 0;  ///< of this start of the daemon; 0: none
  std::optional<Contacts> contacts_;                         ///< of traction-touch
  std::deque<Arrival> arrivals_;
  std::deque<double> history_;
  std::int64_t sampled_ns_ = 0;
};

/// Returns the Euclidean norm, in the unit of the vector.
double length(const Vector3& vector);

/// Returns the standard deviations of the components, of noise and systematic part together.
Vector3 deviationsOf(const Covariance& covariance);

/// Returns the nodes' positions in the gel frame [m], in the order of Field::force_N; none if its grid has
/// more than a million.
std::vector<Vector3> nodePositions_m(const Description& description);

/// Returns the age of a contact when it was last seen [s].
double age_s(const TrackedContact& contact);
/// Returns whether force and velocity of a contact are known.
bool isSeen(const TrackedContact& contact);
/// Returns the stick ratio of a contact as text: "0.62", or "unknown".
std::string stickRatio(const TrackedContact& contact);

struct FlagText {
  Flag flag;
  const char* name;   ///< as in JSON
  const char* words;  ///< for people
};
/// Most important first.
inline constexpr std::array<FlagText, 12> kFlagTexts = {{
    {kDoubtedOrigin, "doubted_origin", "perhaps not the camera's picture: its packets came twice"},
    {kZeroUnverified, "zero_unverified", "zero not verified"},
    {kGelUnverified, "gel_unverified", "too few markers to verify the gel file"},
    {kFewMarkers, "few_markers", "too few markers"},
    {kReacquiring, "reacquiring", "markers labelled anew"},
    {kTorn, "torn", "picture torn"},
    {kUnexplained, "unexplained", "no forces explain this picture"},
    {kGelMismatch, "gel_mismatch", "not the gel of the gel file: see tractionctl status"},
    {kNotSolved, "not_solved", "not solved in time"},
    {kOutOfRange, "out_of_range", "beyond the range of known uncertainty"},
    {kRecovering, "recovering", "the gel recovers from earlier loads or heat"},
    {kDiscontinuity, "discontinuity", "frames were lost before this one"},
}};

/// Returns one text per set flag, most important first; unknown bits have none.
/// \param flags or-ed Flag
std::vector<std::string> words(std::uint32_t flags);

/// Returns a duration, 0 or more, as text: "2.3 s", "12 s", "5 min", "3 h", "4 days".
std::string duration(double seconds);

}  // namespace traction::client
