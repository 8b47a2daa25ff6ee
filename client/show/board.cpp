#include "client/show/board.h"

#include "base/printable.h"
#include "client/show/health.h"
#include "client/show/page.h"
#include "client/show/reflection.h"
#include "client/show/status_text.h"

#include <algorithm>
#include <utility>

namespace traction::client {

namespace {

constexpr int kWhole = 20;   ///< rows of an instrument with all its figures
constexpr int kShort = 5;    ///< rows of an instrument with its main figures
constexpr int kLedger = 40;  ///< columns of the ledger

using Count = unsigned long long;

enum class Tone { kPlain, kOld, kBad };

struct Row {
  std::string label, text;
  Tone tone = Tone::kPlain;
};

/// Number of frames of one kind.
struct Account {
  std::string name;
  std::uint64_t total = 0;
  std::optional<double> rate_hz;  ///< empty: there is no status before, or it is no counter
  v1::Top::Loss loss = v1::Top::LOSS_NONE;
  bool isCounter = false;

  bool isLoss() const { return loss != v1::Top::LOSS_NONE; }
};

const Style& styleOf(Tone tone) {
  return tone == Tone::kOld ? kDim : tone == Tone::kBad ? kWarning : kPlain;
}

std::vector<Account> accountsOf(const Scene& scene) {
  if (!scene.status) return {};
  std::vector<Account> all;
  for (TopNumber& one : topNumbers(*scene.status->message, "frames"))
    all.push_back({std::move(one.word), one.number, {}, one.loss, one.isCounter});
  if (!scene.statusBefore) return all;
  const double seconds = (*scene.status)->uptime_s() - (*scene.statusBefore)->uptime_s();
  const std::vector<TopNumber> before = topNumbers(*scene.statusBefore->message, "frames");
  for (std::size_t i = 0; i < all.size() && seconds > 0.0; ++i) {
    const double more = static_cast<double>(all[i].total) - static_cast<double>(before[i].number);
    if (all[i].isCounter) all[i].rate_hz = more / seconds;
  }
  return all;
}

/// Returns everything that is wrong, most important first; empty: nothing.
std::string complaint(const Watched& one, std::int64_t now_ns) {
  if (!one.failure.empty()) return printable(one.failure);
  std::string text;
  for (const Problem& problem : problems(one.scene, now_ns)) text += (text.empty() ? "" : "; ") + sentence(problem);
  return text;
}

std::string titleOf(const Watched& one) {
  const bool isEndpoint = one.endpoint.empty() && one.name.find("://") != std::string::npos;
  if (isEndpoint && one.scene.description) return printable(one.scene.description->header.sensor);
  return one.name;
}

std::string stateOf(const Watched& one, std::int64_t now_ns) {
  if (!one.failure.empty()) return "failed";
  if (!one.scene.connected() && !one.scene.status) return "not there";
  if (!one.scene.status) return "no status yet";
  const v1::Status& status = *one.scene.status->message;
  return inBrackets("camera " + wordOf("CameraState", status.camera()) + ", up " + duration(status.uptime_s()),
                    one.scene.isStatusOld(now_ns));
}

/// The figures of an instrument; those that are out of date are in brackets.
struct Figures {
  Row force, total, fields, frames, track, solve, send, whole, here, markers, found, residual, drift, packets, camera,
      memory, realTime, latency;
  bool statusIsOld = false;
};

Figures figuresOf(const Scene& scene, std::int64_t now_ns) {
  Figures all;
  all.statusIsOld = scene.isStatusOld(now_ns);
  const bool fieldIsOld = !scene.trouble(now_ns).what.empty(), isValid = scene.field && scene.field->valid;
  const auto row = [](const char* label, const std::string& text, bool isOld) {
    return Row{label, inBrackets(text.empty() ? "-" : text, isOld), isOld ? Tone::kOld : Tone::kPlain};
  };
  for (auto [to, label] : {std::pair{&all.force, "force"}, {&all.total, "total"}, {&all.residual, "residual"}})
    *to = {label, "-", Tone::kOld};
  if (isValid) {
    const Vector3& force = scene.field->resultant_N;
    const double total = length(force);
    all.force = row("force", format("%+.3f %+.3f %+.3f N", force[0], force[1], force[2]), fieldIsOld);
    all.total = row("total", format("%.3f N  %.0f gf", total, total / kGramForce_N), fieldIsOld);
  }
  if (scene.field) all.residual = row("residual", format("%.3f px", scene.field->residual_px), fieldIsOld);
  all.fields = {"fields", format("%.1f /s come here", scene.rate_hz(now_ns))};
  if (const auto latency = scene.latency(now_ns)) {
    all.here = row("  to here", format("%7.2f %7.2f", latency->p50_ms, latency->p99_ms), fieldIsOld);
  } else {
    const bool isElsewhere = scene.description && !scene.description->sameHost;
    all.here = {"  to here", isElsewhere ? "another host's clock" : "-", Tone::kOld};
  }

  const v1::Status none;
  const v1::Status& status = scene.status ? *scene.status->message : none;
  const auto ofStatus = [&](const char* label, const std::string& text) {
    return scene.status ? row(label, text, all.statusIsOld) : Row{label, "-", Tone::kOld};
  };
  const auto stage = [&](const char* label, const v1::Quantiles& of, const char* pattern = "%7.2f %7.2f %7.2f") {
    return ofStatus(label, format(pattern, of.p50_s() * 1e3, of.p99_s() * 1e3, of.max_s() * 1e3));
  };
  const v1::Latencies& latencies = status.latencies();
  all.frames =
      ofStatus("frames", format("%.1f in, %.1f out /s", status.rates().received_hz(), status.rates().published_hz()));
  all.track = stage("  track", latencies.track());
  all.solve = stage("  solve", latencies.solve());
  all.send = stage("  send", latencies.send());
  all.whole = stage("  total", latencies.total());
  all.latency = stage("latency", latencies.total(), "%.2f ms p50 %.2f p99 %.2f max");
  std::string markers, packets, camera;
  unsigned found = 0, expected = 0;
  for (const v1::LayerStatus& layer : status.markers().layers()) {
    markers += (markers.empty() ? "" : ", ") + wordOf("Colour", layer.colour()) +
               format(" %u/%u", layer.found(), layer.expected());
    found += layer.found();
    expected += layer.expected();
  }
  all.markers = ofStatus("markers", markers);
  all.found = ofStatus("markers", format("%u/%u", found, expected));
  const v1::RestDrift& drift = status.rest_drift();
  all.drift = ofStatus("drift", status.has_rest_drift() ? format("%+.2f %+.2f px, %s ago", drift.shift_u_px(),
                                                                 drift.shift_v_px(), duration(drift.age_s()).c_str())
                                                        : "");
  for (const TopNumber& one : topNumbers(status, "packets"))
    packets += (packets.empty() ? "" : " ") + std::to_string(one.number) + " " + one.word;
  all.packets = ofStatus("packets", packets);
  if (status.camera_link().has_temperature()) camera = format("%.1f °C", status.camera_link().temperature());
  if (!status.camera_link().ptp().empty())
    camera += (camera.empty() ? "PTP " : ", PTP ") + printable(status.camera_link().ptp());
  all.camera = ofStatus("camera", camera);
  const auto memory = static_cast<double>(status.memory_bytes());
  all.memory = ofStatus("memory", memory > 0.0 ? format("%.1f MiB", memory / 1048576.0) : "");
  all.realTime = ofStatus("real time", printable(grantedOf(status)));
  return all;
}

std::vector<Row> rowsOf(const Figures& all) {
  return {all.force,   all.total,    all.fields, all.frames,  {"latency", "    p50     p99     max  ms", Tone::kOld},
          all.track,   all.solve,    all.send,   all.whole,   all.here,
          all.markers, all.residual, all.drift,  all.packets, all.camera,
          all.memory,  all.realTime};
}

/// Returns the row of the losses: "lost 12: 10 stale (2.5/s), 2 never arrived".
Row lossesInWords(const Scene& scene, bool isOld) {
  std::string causes;
  std::uint64_t sum = 0;
  bool isNow = false;
  for (const Account& one : accountsOf(scene)) {
    if (one.loss != v1::Top::LOSS_FRAME || one.total == 0) continue;
    sum += one.total;
    causes += (causes.empty() ? ": " : ", ") + format("%llu ", Count{one.total}) + one.name;
    if (one.rate_hz && *one.rate_hz > 0.0) causes += format(" (%.1f/s)", *one.rate_hz), isNow = true;
  }
  if (!scene.status) return {"lost", "-", Tone::kOld};
  return {"lost", inBrackets(format("%llu", Count{sum}) + causes, isOld),
          isOld   ? Tone::kOld
          : isNow ? Tone::kBad
                  : Tone::kPlain};
}

void drawHead(Canvas& canvas, int row, const Watched& one, bool isWell, std::int64_t now_ns) {
  int column = canvas.text(1, row, titleOf(one), kBright);
  column = canvas.text(column + 2, row, stateOf(one, now_ns), isWell ? kAccent : kWarning);
  const std::string& where = one.endpoint.empty() && titleOf(one) != one.name ? one.name : one.endpoint;
  const int start = canvas.width() - 1 - static_cast<int>(where.size());
  if (start > column + 1) canvas.text(start, row, where, kDim);
}

/// Draws the complaint in at most `most` rows. Returns the number of rows.
int drawComplaint(Canvas& canvas, int row, const std::string& complaint, int most) {
  if (complaint.empty()) return canvas.text(1, row, "no flags", kDim), 1;
  const std::vector<std::string> lines = wrapped(complaint, canvas.width() - 2);
  const auto rows = std::min(lines.size(), static_cast<std::size_t>(most));
  canvas.text(1, row, "!", kWarning);
  for (std::size_t i = 0; i < rows; ++i) {
    const bool isCut = i + 1 == rows && rows < lines.size();
    const std::string line =
        isCut ? lines[i].substr(0, static_cast<std::size_t>(std::max(canvas.width() - 6, 0))) + "..." : lines[i];
    canvas.text(2, row + static_cast<int>(i), line, kWarning);
  }
  return static_cast<int>(rows);
}

void drawLedger(Canvas& canvas, int column, int row, int bottom, const Scene& scene, bool isOld) {
  constexpr int kRateEnd = 30;
  const auto right = [&](int end, const std::string& text, const Style& style) {
    canvas.text(column + end - static_cast<int>(text.size()), row, text, style);
  };
  canvas.text(column, row, isOld ? "frames, not of now" : "frames", kDim);
  right(kRateEnd, "/s", kDim);
  right(kLedger, "total", kDim);
  ++row;
  for (const Account& one : accountsOf(scene)) {
    if (row >= bottom) return;
    const bool isGrowing = !isOld && one.isLoss() && one.rate_hz && *one.rate_hz > 0.0;
    const Style& style = isGrowing ? kWarning : isOld || (one.isLoss() && one.total == 0) ? kDim : kPlain;
    canvas.text(column, row, "  " + one.name, isGrowing ? kWarning : kDim);
    right(kRateEnd, one.rate_hz ? format("%.1f", *one.rate_hz) : "", style);
    right(kLedger, format("%llu", Count{one.total}), style);
    ++row;
  }
}

void drawRows(Canvas& canvas, int row, int bottom, const std::vector<Row>& rows) {
  for (const Row& one : rows) {
    if (row >= bottom) return;
    canvas.text(1, row, one.label, kDim);
    canvas.text(11, row, one.text, styleOf(one.tone));
    ++row;
  }
}

void drawWhole(Canvas& canvas, int row, int bottom, const Watched& one, std::int64_t now_ns) {
  const std::string wrong = complaint(one, now_ns);
  drawHead(canvas, row, one, wrong.empty(), now_ns);
  row += drawComplaint(canvas, row + 1, wrong, std::max(1, 1 + bottom - row - kWhole)) - 1;
  const Figures figures = figuresOf(one.scene, now_ns);
  drawRows(canvas, row + 2, bottom, rowsOf(figures));
  if (canvas.width() < 2 * kLedger - 1) return;
  canvas.fill(canvas.width() - kLedger - 2, row + 2, kLedger + 2, bottom - row - 2, kPlain);
  drawLedger(canvas, canvas.width() - kLedger - 1, row + 2, bottom, one.scene, figures.statusIsOld);
}

void drawShort(Canvas& canvas, int row, const Watched& one, std::int64_t now_ns) {
  const std::string wrong = complaint(one, now_ns);
  const Figures figures = figuresOf(one.scene, now_ns);
  drawHead(canvas, row, one, wrong.empty(), now_ns);
  drawComplaint(canvas, row + 1, wrong, 1);
  const auto put = [&](int at, std::initializer_list<Row> rows) {
    int column = 3;
    for (const Row& each : rows) {
      column = canvas.text(column, at, each.label, kDim);
      column = canvas.text(column + 1, at, each.text, styleOf(each.tone)) + 2;
    }
  };
  put(row + 2,
      {figures.force, {"rate", format("%.1f/s", one.scene.rate_hz(now_ns))}, figures.residual, figures.memory});
  put(row + 3, {figures.latency, figures.found});
  put(row + 4, {lossesInWords(one.scene, figures.statusIsOld)});
}

}  // namespace

Canvas drawBoard(const std::vector<Watched>& all, int width, int height, std::int64_t now_ns) {
  Canvas canvas(width, height);
  const Style bar{{230, 232, 240}, kBar, true}, quiet{{150, 156, 175}, kBar, false};
  canvas.fill(0, 0, width, 1, bar);
  const int count = static_cast<int>(all.size());
  const int column = canvas.text(1, 0, count == 1 ? "tractiond" : format("tractiond: %d instruments", count), bar);
  if (width - 9 > column + 1) canvas.text(width - 9, 0, "q quits ", quiet);
  if (count == 1 || count * kWhole <= height - 1) {
    const int rows = (height - 1) / count;
    for (int i = 0; i < count; ++i)
      drawWhole(canvas, 1 + i * rows, 1 + (i + 1) * rows, all[static_cast<std::size_t>(i)], now_ns);
    return canvas;
  }
  const int fit = count * kShort <= height - 1 ? count : (height - 2) / kShort;
  for (int i = 0; i < fit; ++i) drawShort(canvas, 1 + i * kShort, all[static_cast<std::size_t>(i)], now_ns);
  if (fit < count) {
    canvas.text(1, height - 1, format("%d more: a higher window, or name those that you want", count - fit), kWarning);
  }
  return canvas;
}

std::string boardLine(const Watched& one, std::int64_t now_ns) {
  const Figures figures = figuresOf(one.scene, now_ns);
  std::string line = titleOf(one) + "  " + stateOf(one, now_ns);
  for (const Row& row : {figures.force, Row{"rate", format("%.1f/s", one.scene.rate_hz(now_ns))}, figures.latency,
                         figures.found, figures.residual, lossesInWords(one.scene, figures.statusIsOld)}) {
    line += "  " + row.label + " " + row.text;
  }
  const std::string wrong = complaint(one, now_ns);
  return wrong.empty() ? line : line + "  ! " + wrong;
}

std::string boardText(const Watched& one, std::int64_t now_ns) {
  std::string text =
      titleOf(one) + "  " + stateOf(one, now_ns) + (one.endpoint.empty() ? "" : "  " + one.endpoint) + "\n";
  const std::string wrong = complaint(one, now_ns);
  text += "  " + (wrong.empty() ? "no flags" : "! " + wrong) + "\n";
  const auto add = [&](const std::string& label, const std::string& rest) {
    text += "  " + label + std::string(label.size() < 24 ? 24 - label.size() : 1, ' ') + rest + "\n";
  };
  const Figures figures = figuresOf(one.scene, now_ns);
  for (const Row& row : rowsOf(figures)) add(row.label, row.text);
  if (!one.scene.status) return text;
  add(figures.statusIsOld ? "frames, not of now" : "frames", "      /s       total");
  for (const Account& each : accountsOf(one.scene)) {
    const std::string rate = each.rate_hz ? format("%.1f", *each.rate_hz) : "";
    add("  " + each.name, format("%8s %11llu", rate.c_str(), Count{each.total}));
  }
  return text;
}

}  // namespace traction::client
