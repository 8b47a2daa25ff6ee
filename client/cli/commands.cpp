#include "client/cli/commands.h"

#include "client/cli/json.h"
#include "client/cli/output.h"
#include "client/src/printable.h"

#include <cstdio>

namespace traction::cli {

namespace {

using Count = unsigned long long;

const char* sentence(CameraState state) {
  switch (state) {
  case CameraState::kWaiting:
    return "waiting for its camera";
  case CameraState::kStreaming:
    return "camera open";
  case CameraState::kLost:
    return "camera lost, being looked for";
  case CameraState::kConnecting:
    return "camera found, being set up";
  case CameraState::kUnknown:
    break;
  }
  return "camera not opened yet";
}

void printMarkers(const MarkerStatus& markers) {
  if (markers.isWithoutGel()) std::printf("markers   %s\n", printable(markers.remark).c_str());
  if (markers.layers.empty()) return;
  std::string text;
  for (const MarkerStatus::Layer& layer : markers.layers) {
    if (!text.empty()) text += ", ";
    text += std::string(nameOf(layer.colour)) + " " + std::to_string(layer.found) + " of " +
            std::to_string(layer.expected) + " (" + std::to_string(layer.inZero) + " in the zero)";
  }
  std::printf("markers   %s\n", text.c_str());
  if (!markers.remark.empty()) std::printf("          %s\n", printable(markers.remark).c_str());
  for (const MarkerStatus::Finding& finding : markers.findings) {
    if (!finding.contradicts) continue;
    std::printf("          %s: %.5g by the gel file, %.5g by the picture", printable(finding.name).c_str(),
                finding.expected, finding.seen);
    if (finding.deviation > 0.0) std::printf(" +- %.2g", finding.deviation);
    std::printf("\n");
  }
}

std::string sentence(const Status& status) {
  return sentence(status.camera) + (status.cameraWhy.empty() ? std::string() : " (" + status.cameraWhy + ")");
}

void print(const CameraLink& link) {
  if (link.packetsResent + link.packetsMissing != 0) {
    std::printf("          %llu packets sent again, %llu missing\n", Count{link.packetsResent},
                Count{link.packetsMissing});
  }
  if (link.packetsRefused != 0) {
    std::printf("          %llu packets refused: not the camera's, or there was no room for them\n",
                Count{link.packetsRefused});
  }
  if (link.temperature_C) std::printf("          %.1f degrees Celsius\n", *link.temperature_C);
  if (link.ptp.empty()) return;
  std::printf("          PTP %s", printable(link.ptp).c_str());
  if (link.ptpOffset_s) std::printf(", %+.1f us from its master", *link.ptpOffset_s * 1e6);
  std::printf("\n");
}

void print(const Status& status) {
  const Ledger& ledger = status.ledger;
  const auto ms = [](double seconds) { return seconds * 1e3; };
  std::printf("%s: %s, up %.0f s, boot %s\n", printable(status.header.sensor).c_str(),
              printable(sentence(status)).c_str(), status.uptime_s, toHex(status.header.boot).c_str());
  std::printf("rate      %.1f frames/s received, %.1f published\n", status.received_hz, status.published_hz);
  std::printf("latency   %.2f ms p50, %.2f p99, %.2f max (p50: track %.2f, solve %.2f, send %.2f)\n",
              ms(status.total.p50_s), ms(status.total.p99_s), ms(status.total.max_s), ms(status.track.p50_s),
              ms(status.solve.p50_s), ms(status.send.p50_s));
  std::printf("frames    %llu received = %llu published + %llu in flight + %llu not published\n",
              Count{ledger.received}, Count{ledger.published}, Count{ledger.inFlight}, Count{ledger.losses()});
  const std::pair<const char*, std::uint64_t> losses[] = {
      {"incomplete", ledger.incomplete},
      {"of a wrong size", ledger.wrongSize},
      {"of a wrong format", ledger.wrongFormat},
      {"stale", ledger.stale},
      {"implausible", ledger.implausible},
      {"evicted before tracking", ledger.evictedBeforeTrack},
      {"before there was a zero, or averaged for one", ledger.noRestPose},
      {"not measured, as there is no gel", ledger.noGel},
      {"evicted before solving", ledger.evictedBeforeSolve},
      {"evicted before publishing", ledger.evictedBeforePublish},
      {"discarded at the stop", ledger.discardedAtStop},
  };
  for (const auto& [cause, frames] : losses) {
    if (frames != 0) std::printf("          %llu %s\n", Count{frames}, cause);
  }
  if (!status.invalidWhy.empty()) std::printf("fields    not valid: %s\n", printable(status.invalidWhy).c_str());
  if (ledger.invalid != 0) {
    std::printf("%s%llu published fields were not valid\n", status.invalidWhy.empty() ? "fields    " : "          ",
                Count{ledger.invalid});
  }
  std::printf("camera    %llu frames never arrived, %llu reconnects\n", Count{ledger.missing},
              Count{ledger.reconnects});
  if (ledger.doubted != 0) {
    std::printf("          %llu frames of which packets came twice, or early, or while others sent in its name\n",
                Count{ledger.doubted});
  }
  if (!status.unreleasedWhy.empty()) {
    std::printf(
        "          stays locked for its heartbeat's time (3 s for most) after a kill -9 of the daemon: %s; restart "
        "the service\n",
        printable(status.unreleasedWhy).c_str());
  }
  if (status.cameraLink) print(*status.cameraLink);
  printMarkers(status.markers);
  if (const auto& drift = status.restDrift) {
    std::printf("zero      drifted by (%+.3f, %+.3f) px, scale %+.1e, roll %+.1e rad, markers %.3f px; untouched "
                "%.0f s ago\n",
                drift->shiftU_px, drift->shiftV_px, drift->scale, drift->roll, drift->rms_px, drift->age_s);
  }
  if (const std::string granted = grantedOf(status.scheduling); granted != "off")
    std::printf("real time %s\n", printable(granted).c_str());
  if (const std::string refused = refusedOf(status.scheduling); !refused.empty())
    std::printf("real time not granted: %s; the log has what mends it\n", printable(refused).c_str());
  if (status.logLinesLost != 0) {
    std::printf("log       %llu lines lost: whoever reads it was too slow, or its disk is full\n",
                Count{status.logLinesLost});
  }
}

}  // namespace

void status(const ControlOptions& options, bool json) {
  const Status status = Control(options).status();
  if (json) {
    printLine(toJson(status));
  } else {
    print(status);
    flushOutput();
  }
  if (status.camera != CameraState::kStreaming) throw NoField("no field can come: " + sentence(status));
  if (status.markers.isWithoutGel()) throw NoField("no field can come: " + status.markers.remark);
}

void describe(const ControlOptions& options) {
  printLine(toJson(Control(options).description()));
}

void zero(const ControlOptions& options, const ZeroCommand& command) {
  const Control control(options);
  const ZeroResult result = command.undo ? control.undoZero() : control.zero({.anyway = command.anyway});
  if (command.json) {
    printLine(toJson(result));
    return;
  }
  std::printf("zero %s: %u of %u markers, pixel noise %.1f grey levels, id %s\n", command.undo ? "restored" : "taken",
              result.markersPresent, result.markersExpected, result.noise_levels, toHex(result.zero.id).c_str());
  if (!result.remark.empty()) std::printf("warning: %s\n", printable(result.remark).c_str());
}

}  // namespace traction::cli
