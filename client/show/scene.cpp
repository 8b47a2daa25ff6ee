#include "client/show/scene.h"

#include "client/show/health.h"
#include "client/show/page.h"
#include "traction/v1/status.pb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace traction::client {

namespace {

constexpr std::int64_t kWindow_ns = 2'000'000'000;
constexpr std::int64_t kSample_ns = 250'000'000;
constexpr std::size_t kSamples = 240;

/// Limits of the time for which a field is current: three times the usual time between two fields.
constexpr double kShortestPatience_s = 0.4;
constexpr double kLongestPatience_s = 3.0;
constexpr std::int64_t kStatusPatience_ns = 1'450'000'000;
constexpr std::int64_t kTouchPatience_ns = 1'000'000'000;
constexpr std::int64_t kSilence_ns = 2'500'000'000;  ///< a daemon sends its status once a second
constexpr std::int64_t kStart_ns = 5'000'000'000;    ///< without a message on a new connection

const std::string kNoField = "no field comes";

double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

}  // namespace

double length(const Vector3& vector) {
  return std::hypot(vector[0], vector[1], vector[2]);
}

Vector3 deviationsOf(const Covariance& covariance) {
  const auto deviation = [&](std::size_t axis) {
    return std::sqrt(std::max(0.0, covariance.noise.at(4 * axis) + covariance.systematic.at(4 * axis)));
  };
  return {deviation(0), deviation(1), deviation(2)};
}

std::vector<Vector3> nodePositions_m(const Description& description) {
  std::vector<Vector3> places;
  if (description.body) {
    for (const auto& [x, y, z] : description.body->nodePositions_m) places.push_back({x, y, z});
    return places;
  }
  const Grid& grid = description.nodes;
  if (std::uint64_t{grid.rows} * grid.columns > 1'000'000) return places;
  for (std::uint32_t row = 0; row < grid.rows; ++row) {
    for (std::uint32_t column = 0; column < grid.columns; ++column) {
      const Vector2 at = grid.position_m(column, row);
      places.push_back({at[0], at[1], 0.0});
    }
  }
  return places;
}

double age_s(const TrackedContact& contact) {
  return seconds(contact.seen_ns - contact.begun_ns);
}

bool isSeen(const TrackedContact& contact) {
  return contact.phase == ContactPhase::kBegin || contact.phase == ContactPhase::kMove;
}

std::string stickRatio(const TrackedContact& contact) {
  if (!contact.slip || contact.slip->state == SlipState::kUnknown) return "unknown";
  return format("%.2f", contact.slip->stickRatio.estimate);
}

std::vector<std::string> words(std::uint32_t flags) {
  std::vector<std::string> all;
  for (const FlagText& each : kFlagTexts) {
    if ((flags & each.flag) != 0) all.emplace_back(each.words);
  }
  return all;
}

std::string duration(double seconds) {
  const auto whole = [](double number, const char* unit) { return std::to_string(std::lround(number)) + unit; };
  if (seconds < 9.95) {
    const long tenths = std::lround(seconds * 10.0);
    return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " s";
  }
  if (seconds < 120.0) return whole(seconds, " s");
  if (seconds < 7200.0) return whole(seconds / 60.0, " min");
  return seconds < 172'800.0 ? whole(seconds / 3600.0, " h") : whole(seconds / 86'400.0, " days");
}

void Scene::add(Message message) {
  if (auto* newContacts = std::get_if<Contacts>(&message)) {  // of another program: says nothing about the daemon
    contacts_ = std::move(*newContacts);
    return;
  }
  const auto& header = std::visit([](const auto& any) -> const Header& { return any.header; }, message);
  lastArrival_ns = header.arrived_ns;
  heard_ = true;
  if (boot_ != header.boot) {
    if (boot_ != Id{}) {
      restarted_ns = lastArrival_ns;
      field.reset();
      description.reset();
      status.reset();
      statusBefore.reset();
      arrivals_.clear();
      fieldArrival_ns_ = statusArrival_ns_ = 0;
    }
    boot_ = header.boot;
  }
  if (auto* newField = std::get_if<Field>(&message)) {
    ++fields;
    arrivals_.push_back({lastArrival_ns, lastArrival_ns - newField->header.received_ns, newField->header.flags});
    while (arrivals_.size() > 2 && lastArrival_ns - arrivals_.front().at_ns > kWindow_ns) arrivals_.pop_front();
    fieldArrival_ns_ = lastArrival_ns;
    if (lastArrival_ns - sampled_ns_ >= kSample_ns) {
      sampled_ns_ = lastArrival_ns;
      history_.push_back(length(newField->resultant_N));
      if (history_.size() > kSamples) history_.pop_front();
    }
    field = std::move(*newField);
  } else if (auto* newDescription = std::get_if<Description>(&message)) {
    description = std::move(*newDescription);
  } else if (auto* newStatus = std::get_if<Status>(&message)) {
    statusBefore = std::exchange(status, std::move(*newStatus));
    statusArrival_ns_ = lastArrival_ns;
  }
}

void Scene::setConnected(bool isConnected, std::int64_t now_ns) {
  if (isConnected != connected_ || connectionChanged_ns_ == 0) connectionChanged_ns_ = now_ns;
  heard_ = heard_ && (isConnected || !connected_);
  connected_ = isConnected;
  wasConnected_ = wasConnected_ || isConnected;
}

std::optional<std::vector<TrackedContact>> Scene::touching(std::int64_t now_ns) const {
  if (!contacts_ || now_ns - contacts_->header.arrived_ns > kTouchPatience_ns) return std::nullopt;
  std::vector<TrackedContact> open = contacts_->contacts;
  std::erase_if(open, [](const TrackedContact& each) { return each.phase == ContactPhase::kEnd; });
  return open;
}

bool Scene::isOld(std::int64_t now_ns) const {
  double usual_s = 0.0;
  if (arrivals_.size() > 1) {
    usual_s = seconds(arrivals_.back().at_ns - arrivals_.front().at_ns) / static_cast<double>(arrivals_.size() - 1);
  }
  return seconds(now_ns - fieldArrival_ns_) > std::clamp(3.0 * usual_s, kShortestPatience_s, kLongestPatience_s);
}

std::string Scene::reason(std::int64_t now_ns) const {
  if (!connected_) return wasConnected_ ? "tractiond is gone" : "looking for tractiond";
  if (!heard_) {
    return now_ns - connectionChanged_ns_ < kStart_ns
               ? "tractiond is starting"
               : "tractiond is there and sends nothing: it is starting, or has no processor time";
  }
  if (now_ns - lastArrival_ns > kSilence_ns) return "tractiond is silent";
  if (!status) return field ? kNoField : "tractiond is starting";
  const v1::Status& reported = *status->message;
  const std::string why = reported.camera_why().empty() ? "" : ": " + reported.camera_why();
  switch (reported.camera()) {
  case v1::CAMERA_STATE_WAITING:
    return "tractiond waits for a camera" + why;
  case v1::CAMERA_STATE_LOST:
    return "the camera is lost" + why;
  case v1::CAMERA_STATE_CONNECTING:
    return "the camera is being set up";
  case v1::CAMERA_STATE_STREAMING:
    break;
  default:
    return "tractiond is starting";
  }
  // A status describes the second before it, in which fields may still have come.
  if (field && statusArrival_ns_ < fieldArrival_ns_ + 1'000'000'000) return kNoField;
  if (isWithoutGel(reported)) return reported.markers().remark();
  if (const std::string silent = whyNoPicture(reported); !silent.empty()) return silent;
  return field ? "no field is made of the frames" : "finding the markers and their rest pose";
}

Scene::Trouble Scene::trouble(std::int64_t now_ns) const {
  if (field && !isOld(now_ns)) return {};
  const std::int64_t start_ns =
      fieldArrival_ns_ != 0 ? fieldArrival_ns_ : std::max(connectionChanged_ns_, restarted_ns);
  std::string what = reason(now_ns);
  if (restarted_ns != 0 && fieldArrival_ns_ == 0 && connected_) what = "tractiond was restarted: " + what;
  return {std::move(what), seconds(now_ns - start_ns)};
}

std::string Scene::sentence(const Trouble& trouble) const {
  if (status && trouble.what == (*status)->markers().remark())
    return trouble.what;  // this state does not end by itself
  if (trouble.what == kNoField) return "no field for " + duration(trouble.since_s);
  if (fieldArrival_ns_ != 0) return trouble.what + ", no field for " + duration(trouble.since_s);
  return trouble.since_s < 2.0 ? trouble.what : trouble.what + ", for " + duration(trouble.since_s);
}

bool Scene::isStatusOld(std::int64_t now_ns) const {
  if (!status || !connected_ || now_ns - statusArrival_ns_ > kStatusPatience_ns) return true;
  return field && isOld(now_ns) && seconds(statusArrival_ns_ - fieldArrival_ns_) < kShortestPatience_s;
}

std::uint32_t Scene::recentFlags(std::int64_t now_ns) const {
  std::uint32_t flags = 0;
  for (const Arrival& arrival : arrivals_) {
    if (now_ns - arrival.at_ns <= kWindow_ns) flags |= arrival.flags;
  }
  return flags;
}

double Scene::rate_hz(std::int64_t now_ns) const {
  const auto recent = std::find_if(arrivals_.begin(), arrivals_.end(),
                                   [&](const Arrival& arrival) { return now_ns - arrival.at_ns <= kWindow_ns; });
  const auto count = arrivals_.end() - recent;
  if (count < 2) return 0.0;
  // Counted between arrivals, not over the window: correct from the second field on, and falls when no more come.
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
  // Fields of a recording that is sent again tell when they were taken, on this host also since its last start.
  constexpr std::int64_t kRecorded_ns = 10'000'000'000;
  if (*std::min_element(recent.begin(), recent.end()) > kRecorded_ns) return std::nullopt;
  const auto at = [&](double share) {
    const auto nth = recent.begin() + std::lround(share * static_cast<double>(recent.size() - 1));
    std::nth_element(recent.begin(), nth, recent.end());
    return static_cast<double>(*nth) * 1e-6;
  };
  return Latency{at(0.5), at(0.99)};
}

}  // namespace traction::client
