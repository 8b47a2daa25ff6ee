#include "client/cli/metrics.h"

#include "client/cli/instances.h"
#include "client/cli/json.h"
#include "client/cli/output.h"
#include "traction/error.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <initializer_list>
#include <iostream>
#include <set>
#include <string_view>
#include <utility>

namespace traction::cli {
namespace {

using Labels = std::initializer_list<std::pair<const char*, std::string>>;

std::string escaped(const std::string& text) {
  std::string result;
  for (const char letter : text) {
    if (letter == '\\' || letter == '"') result += '\\';
    result += letter == '\n' ? ' ' : letter;
  }
  return result;
}

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.17g", value);
  return text.data();
}
std::string number(std::uint64_t value) {
  return std::to_string(value);
}

/// The samples of one metric. A metric without any is not written.
class Family {
 public:
  Family(std::string& text, std::string name, std::string_view type, std::string_view help)
      : text_(text)
      , name_("traction_" + std::move(name))
      , head_("# HELP " + name_ + " " + std::string(help) + "\n# TYPE " + name_ + " " + std::string(type) + "\n") {}

  template <class Number>
  void add(const std::string& instance, Number value, Labels labels = {}, const char* suffix = "") {
    text_ += std::exchange(head_, "") + name_ + suffix + "{instance=\"" + instance + "\"";
    for (const auto& [label, of] : labels) text_ += std::string(",") + label + "=\"" + escaped(of) + "\"";
    text_ += "} " + number(value) + "\n";
  }

 private:
  std::string& text_;
  std::string name_, head_;
};

/// Adds each instance's samples to a family.
using Sampler = std::function<void(Family&, const std::string& instance, const Status&)>;

struct Metric {
  const char *name, *type, *help;
  Sampler sample;
};

void addHistogram(Family& family, const std::string& instance, const char* stage, const Histogram& all) {
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < all.counts.size(); ++i) {
    below += all.counts[i];
    std::array<char, 16> bound{"+Inf"};
    if (i < all.bounds_s.size()) std::snprintf(bound.data(), bound.size(), "%g", all.bounds_s[i]);
    family.add(instance, below, {{"stage", stage}, {"le", bound.data()}}, "_bucket");
  }
  if (all.counts.empty()) return;
  family.add(instance, all.sum_s, {{"stage", stage}}, "_sum");
  family.add(instance, below, {{"stage", stage}}, "_count");
}

void addLayers(Family& family, const std::string& instance, const MarkerStatus& markers,
               std::uint32_t MarkerStatus::Layer::*number) {
  for (std::size_t i = 0; i < markers.layers.size(); ++i) {
    const MarkerStatus::Layer& layer = markers.layers[i];
    family.add(instance, std::uint64_t{layer.*number},
               {{"layer", std::to_string(i)}, {"colour", nameOf(layer.colour)}});
  }
}

const std::vector<Metric>& table() {
  using Name = const std::string&;
  static const std::vector<Metric> metrics = {
      {"info", "gauge", "What runs: always 1",
       [](Family& f, Name i, const Status& s) {
         f.add(i, std::uint64_t{1}, {{"sensor", s.header.sensor}, {"boot", toHex(s.header.boot)}});
       }},
      {"uptime_seconds", "gauge", "Since the start of the daemon",
       [](Family& f, Name i, const Status& s) { f.add(i, s.uptime_s); }},
      {"camera_state", "gauge", "1 for the state that the camera is in",
       [](Family& f, Name i, const Status& s) {
         for (int state = 0; state < 5; ++state) {
           const auto one = static_cast<CameraState>(state);
           f.add(i, std::uint64_t{one == s.camera}, {{"state", nameOf(one)}});
         }
       }},
      {"frames_received_total", "counter", "Frames handed over by the camera driver, good or bad",
       [](Family& f, Name i, const Status& s) { f.add(i, s.ledger.received); }},
      {"frames_published_total", "counter", "Frames whose field was published",
       [](Family& f, Name i, const Status& s) { f.add(i, s.ledger.published); }},
      {"frames_in_flight", "gauge", "Frames between the two at this moment",
       [](Family& f, Name i, const Status& s) { f.add(i, s.ledger.inFlight); }},
      {"frames_lost_total", "counter", "Frames that were received and not published, by cause",
       [](Family& f, Name i, const Status& s) {
         for (const auto& [cause, frames] : lossesOf(s.ledger)) f.add(i, frames, {{"cause", cause}});
       }},
      {"frames_missing_total", "counter", "Frames that never arrived, by gaps in the camera's numbers",
       [](Family& f, Name i, const Status& s) { f.add(i, s.ledger.missing); }},
      {"frames_doubted_total", "counter",
       "Frames that may not be the camera's own: packets came twice, or early, or while others sent in its name",
       [](Family& f, Name i, const Status& s) { f.add(i, s.ledger.doubted); }},
      {"fields_invalid_total", "counter", "Published fields without forces",
       [](Family& f, Name i, const Status& s) { f.add(i, s.ledger.invalid); }},
      {"camera_reconnects_total", "counter", "How often the camera was lost and opened again",
       [](Family& f, Name i, const Status& s) { f.add(i, s.ledger.reconnects); }},
      {"packets_total", "counter", "Of the camera's packets: sent again, missing, or refused by the kernel",
       [](Family& f, Name i, const Status& s) {
         if (!s.cameraLink) return;
         f.add(i, s.cameraLink->packetsResent, {{"fate", "resent"}});
         f.add(i, s.cameraLink->packetsMissing, {{"fate", "missing"}});
         f.add(i, s.cameraLink->packetsRefused, {{"fate", "refused"}});
       }},
      {"camera_temperature_celsius", "gauge", "As the camera says",
       [](Family& f, Name i, const Status& s) {
         if (s.cameraLink && s.cameraLink->temperature_C) f.add(i, *s.cameraLink->temperature_C);
       }},
      {"ptp_offset_seconds", "gauge", "Of the camera's clock from its master's, as the camera says",
       [](Family& f, Name i, const Status& s) {
         if (s.cameraLink && s.cameraLink->ptpOffset_s) f.add(i, *s.cameraLink->ptpOffset_s);
       }},
      {"stage_turns_total", "counter", "Turns of each stage's loop: one that stands still hangs",
       [](Family& f, Name i, const Status& s) {
         constexpr std::array kLoops = {"capture", "track", "solve", "publish", "control"};
         for (std::size_t k = 0; k < kLoops.size(); ++k) f.add(i, s.turns[k], {{"stage", kLoops[k]}});
       }},
      {"latency_seconds", "histogram", "Of each stage, and of all from the driver to the network",
       [](Family& f, Name i, const Status& s) {
         addHistogram(f, i, "track", s.track.sinceStart);
         addHistogram(f, i, "solve", s.solve.sinceStart);
         addHistogram(f, i, "send", s.send.sinceStart);
         addHistogram(f, i, "total", s.total.sinceStart);
       }},
      {"markers_expected", "gauge", "Markers of the gel file",
       [](Family& f, Name i, const Status& s) { addLayers(f, i, s.markers, &MarkerStatus::Layer::expected); }},
      {"markers_found", "gauge", "Markers in the newest frame",
       [](Family& f, Name i, const Status& s) { addLayers(f, i, s.markers, &MarkerStatus::Layer::found); }},
      {"gel_contradictions", "gauge", "Numbers of the gel file that the rest picture contradicts: forces are not valid",
       [](Family& f, Name i, const Status& s) {
         const auto& all = s.markers.findings;
         f.add(i, static_cast<std::uint64_t>(
                      std::count_if(all.begin(), all.end(), [](const auto& one) { return one.contradicts; })));
       }},
      {"residual_pixels", "gauge",
       "What the forces of the last second leave unexplained, root mean square over the markers",
       [](Family& f, Name i, const Status& s) { f.add(i, s.residual_px); }},
      {"zero_drift_pixels", "gauge", "Of the untouched picture from the zero",
       [](Family& f, Name i, const Status& s) {
         if (!s.restDrift) return;
         f.add(i, s.restDrift->shiftU_px, {{"of", "shift_u"}});
         f.add(i, s.restDrift->shiftV_px, {{"of", "shift_v"}});
         f.add(i, s.restDrift->rms_px, {{"of", "markers"}});
       }},
      {"memory_bytes", "gauge", "That the daemon holds",
       [](Family& f, Name i, const Status& s) {
         if (s.memory_bytes != 0) f.add(i, s.memory_bytes);
       }},
      {"realtime_priority", "gauge", "Of the threads that a frame passes, as the kernel says; 0: like all others",
       [](Family& f, Name i, const Status& s) {
         for (const auto& thread : s.scheduling.threads)
           f.add(i, std::uint64_t{thread.priority}, {{"thread", thread.name}, {"cpus", thread.cpus}});
       }},
      {"realtime_asked_priority", "gauge", "That the configuration wants; 0: none",
       [](Family& f, Name i, const Status& s) { f.add(i, std::uint64_t{s.scheduling.askedPriority}); }},
      {"locked_memory_bytes", "gauge", "Of the address space, that stay in memory once touched",
       [](Family& f, Name i, const Status& s) { f.add(i, s.scheduling.locked_bytes); }},
      {"log_lines_lost_total", "counter", "Lines of the log that its reader was too slow for",
       [](Family& f, Name i, const Status& s) { f.add(i, s.logLinesLost); }},
  };
  return metrics;
}

/// The request is read to its empty line, else the answer would be cut short by what is left of it.
void skipRequest() {
  constexpr std::size_t kMost = 16'384;
  std::size_t size = 0;
  for (std::string line; size < kMost && std::getline(std::cin, line) && !line.empty() && line != "\r";)
    size += line.size();
}

}  // namespace

std::string metricsText(const std::vector<Measured>& all) {
  std::string text;
  Family up(text, "up", "gauge", "1 where the daemon answers");
  for (const Measured& one : all) up.add(one.instance, std::uint64_t{one.status.has_value()});
  for (const Metric& metric : table()) {
    Family family(text, metric.name, metric.type, metric.help);
    for (const Measured& one : all) {
      if (one.status) metric.sample(family, one.instance, *one.status);
    }
  }
  return text;
}

void metrics(const ControlOptions& options, bool one, bool http) {
  constexpr std::chrono::milliseconds kPatience(1000);
  if (http) skipRequest();
  std::vector<Measured> all;
  for (const std::string& name : one ? std::set<std::string>{options.instance} : instancesHere()) {
    ControlOptions asked = options;
    asked.instance = name;
    if (!one) asked.timeout = kPatience;  // Prometheus waits ten seconds for all
    Measured measured{name, {}};
    try {
      measured.status = Control(asked).status();
    } catch (const Error&) {  // it is down
    }
    all.push_back(std::move(measured));
  }
  std::string text = metricsText(all);
  if (http) {
    text = "HTTP/1.0 200 OK\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\nContent-Length: " +
           std::to_string(text.size()) + "\r\nConnection: close\r\n\r\n" + text;
  }
  if (std::fwrite(text.data(), 1, text.size(), stdout) == 0) expectReader();
  flushOutput();
}

}  // namespace traction::cli
