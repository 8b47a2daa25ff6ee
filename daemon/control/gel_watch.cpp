#include "daemon/control/gel_watch.h"

#include "base/clock.h"
#include "daemon/calibrate/gel_check.h"
#include "daemon/publish/wire_parts.h"
#include "daemon/track/diagnosis.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace tractiond::control {

namespace {

constexpr double kMissing = 0.5;                      // share of a layer's markers: with fewer the picture is examined
constexpr std::int64_t kPatience_ns = 1'000'000'000;  // markers must be missing for so long before an examination
constexpr std::int64_t kBetween_ns = 5'000'000'000;   // time between two examinations
constexpr std::int64_t kBetweenLines_ns = 30'000'000'000;  // time between two log lines of the same kind
constexpr int kZeroWithin = 4;  // multiple of the frames of a zero: a first zero that takes longer is reported

bool isMissing(const MarkerSight& sight) {
  const auto first = sight.layers.begin();
  return sight.layerCount > 0 &&
         (!sight.following || std::any_of(first, first + sight.layerCount,
                                          [](const auto& layer) { return layer.found < kMissing * layer.expected; }));
}

}  // namespace

GelWatch::GelWatch(const sensor::Sensor& sensor, track::Tracker& tracker, Mailbox<traction::v1::MarkerStatus>& status,
                   Replies* replies)
    : sensor_(sensor)
    , tracker_(tracker)
    , status_(status)
    , snapshots_(replies, sensor.layers) {
  tracker.prepare(snapshots_.room());
}

GelReport GelWatch::compare(const RestPose& zero) {
  tracker_.takeSight(sight_);
  const std::vector<track::Lattice> lattices = track::latticesOf(sensor_);
  std::vector<LatticeSeen> seen;
  for (int i = 0; i < sight_.layerCount; ++i) {
    const LatticeSeen& layer = sight_.layers[i].seen;
    if (layer.columns != 0) seen.push_back(track::extentWith(layer, lattices[i], zero.present));
  }
  if (seen.size() != sensor_.layers.size()) seen.clear();
  return calibrate::checkGel(sensor_, zero.position_px, zero.present, seen);
}

void GelWatch::report(const RestPose& zero, const GelReport& report) {
  hasZero_ = true;
  report_ = report;
  tracker_.setGelFits(zero.id, report_.fits());
  tell();  // before the request is answered, as clients ask for the status afterwards
}

void GelWatch::turn() {
  const std::int64_t now_ns = monotonicNow();
  if (foundAt_ns_ == 0) foundAt_ns_ = now_ns;
  const bool fresh = tracker_.takeSight(sight_);
  if (fresh) {
    watchMissing(now_ns);
    watchFirstZero(now_ns);
  }
  if (const Snapshot* const snapshot = snapshots_.take()) {
    if (std::exchange(examinationDue_, false)) examine(*snapshot);
  }
  snapshots_.turn(examinationDue_);
  if (fresh || toTell_) tell();
}

void GelWatch::watchMissing(std::int64_t now_ns) {
  if (!isMissing(sight_)) {
    foundAt_ns_ = now_ns;
    examinedAt_ns_ = 0;
    if (!missing_.empty()) {
      spdlog::info("the markers are found again");
      missing_.clear();
    }
    return;
  }
  if (now_ns - foundAt_ns_ < kPatience_ns) return;
  if (examinedAt_ns_ != 0 && now_ns - examinedAt_ns_ < kBetween_ns) return;
  examinedAt_ns_ = now_ns;
  examinationDue_ = true;
}

void GelWatch::watchFirstZero(std::int64_t now_ns) {
  const MarkerSight::FirstZero& first = sight_.firstZero;
  const int needed = tracker_.zeroFrames();
  noZero_.clear();
  const bool isThere = sight_.layers[0].inZero > 0, isFirstLine = noZeroLoggedAt_ns_ == 0;
  const track::ZeroState state = tracker_.zeroState();
  const bool isUnsteady = state == track::ZeroState::kUnsteady && first.changedOver > 0 && !isThere;
  if (first.frames <= kZeroWithin * needed && !isUnsteady) return;
  if (isThere && !isFirstLine) return;
  const bool isBrightness = std::abs(first.brighter) >= std::abs(first.moreContrast);
  const float change = isBrightness ? first.brighter : first.moreContrast;
  const std::string why =
      isUnsteady ? fmt::format("waiting: {} still {} by {:.0f} % over {} pictures; lamp, exposure and gain must "
                               "be steady, and the exposure whole periods of the mains' light",
                               isBrightness ? "brightness" : "contrast", change > 0.0F ? "rises" : "falls",
                               100.0F * std::abs(change), first.changedOver)
      : state == track::ZeroState::kTooFew || state == track::ZeroState::kTorn
          ? track::describe(state)
          : fmt::format("at most {} pictures in a row were still, and {} are needed: keep the gel untouched and the "
                        "camera still, or lower track.zero_frames",
                        first.mostStill, needed);
  const std::string line =
      fmt::format("{} pictures {} before there was a zero: {}", first.frames, isThere ? "passed" : "have passed", why);
  if (!isThere) noZero_ = line;
  if (!isFirstLine && now_ns - noZeroLoggedAt_ns_ < kBetweenLines_ns) return;
  noZeroLoggedAt_ns_ = now_ns;
  spdlog::warn("warning: {}", line);
}

void GelWatch::examine(const Snapshot& snapshot) {
  const bool first = missing_.empty();
  missing_ = track::diagnose(sensor_, sight_, plainPicture(snapshot.frame));
  const std::int64_t now_ns = monotonicNow();
  if (!first && now_ns - loggedAt_ns_ < kBetweenLines_ns) return;
  loggedAt_ns_ = now_ns;
  spdlog::warn("warning: too few markers are found: {}; tractionctl snapshot --marked shows it", missing_);
}

void GelWatch::tell() {
  constexpr std::size_t kMostFindings = 24;
  traction::v1::MarkerStatus status;
  for (int i = 0; i < sight_.layerCount; ++i) {
    const MarkerSight::Layer& from = sight_.layers[i];
    traction::v1::LayerStatus& to = *status.add_layers();
    to.set_colour(publish::wireColour(sensor_.layers[i].colour));
    to.set_expected(static_cast<std::uint32_t>(from.expected));
    to.set_found(static_cast<std::uint32_t>(from.found));
    to.set_in_zero(static_cast<std::uint32_t>(from.inZero));
    to.set_columns(static_cast<std::uint32_t>(from.seen.columns));
    to.set_rows(static_cast<std::uint32_t>(from.seen.rows));
  }
  std::string remark = missing_.empty() ? noZero_ : missing_;
  if (hasZero_ && !report_.fits()) {
    remark += (remark.empty() ? "" : "; ") + ("the gel file does not fit the picture: " + report_.remark);
  }
  status.set_remark(remark);
  for (std::size_t i = 0; hasZero_ && i < std::min(report_.findings.size(), kMostFindings); ++i) {
    const GelReport::Finding& from = report_.findings[i];
    traction::v1::GelFinding& to = *status.add_findings();
    to.set_name(from.name);
    to.set_expected(from.expected);
    to.set_seen(from.seen);
    to.set_deviation(from.deviation);
    to.set_contradicts(from.contradicts);
  }
  toTell_ = !status_.put(status);
}

void GelWatch::takeFrame(const Frame& frame) {
  Snapshot* const wanted = snapshots_.lent();
  if (!wanted) return;
  wanted->copyFrom(frame);
  if (wanted->fits) tracker_.fill(*wanted);
  snapshots_.giveBack();
}

}  // namespace tractiond::control
