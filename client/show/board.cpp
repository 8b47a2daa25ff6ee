#include "client/show/board.h"

#include "client/show/health.h"
#include "client/show/page.h"
#include "client/show/reflection.h"
#include "client/show/status_text.h"
#include "client/src/printable.h"

#include <algorithm>
#include <utility>

namespace traction::client {

namespace {

constexpr int kWhole = 20;   ///< rows of an instrument with all its figures
constexpr int kShort = 5;    ///< rows of an instrument with its main figures
constexpr int kLedger = 40;  ///< columns of the ledger

using Count = unsigned long long;

/// Getter of one stage.
using Stage = const v1::Quantiles& (v1::Latencies::*)() const;

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

/// Makes the rows about the field and the status; figures that are out of date are in brackets.
class Numbers {
 public:
  Numbers(const Scene& scene, std::int64_t now_ns)
      : scene_(scene)
      , now_ns_(now_ns)
      , fieldIsOld_(!scene.trouble(now_ns).what.empty())
      , statusIsOld_(scene.isStatusOld(now_ns)) {}

  Row force() const {
    if (!isValid()) return {"force", "-", Tone::kOld};
    const Vector3& force = scene_.field->resultant_N;
    return ofField("force", format("%+.3f %+.3f %+.3f N", force[0], force[1], force[2]));
  }
  Row total() const {
    if (!isValid()) return {"total", "-", Tone::kOld};
    const double total = length(scene_.field->resultant_N);
    return ofField("total", format("%.3f N  %.0f gf", total, total / kGramForce_N));
  }
  Row residual() const {
    if (!scene_.field) return {"residual", "-", Tone::kOld};
    return ofField("residual", format("%.3f px", scene_.field->residual_px));
  }
  Row fields() const { return {"fields", format("%.1f /s come here", scene_.rate_hz(now_ns_)), Tone::kPlain}; }
  Row frames() const {
    return ofStatus("frames", [](const v1::Status& s) {
      return format("%.1f in, %.1f out /s", s.rates().received_hz(), s.rates().published_hz());
    });
  }
  Row stage(const char* name, Stage get) const {
    return ofStatus(name, [&](const v1::Status& s) {
      const v1::Quantiles& of = (s.latencies().*get)();
      return format("%7.2f %7.2f %7.2f", of.p50_s() * 1e3, of.p99_s() * 1e3, of.max_s() * 1e3);
    });
  }
  Row here() const {
    const auto latency = scene_.latency(now_ns_);
    if (!latency) {
      return {"  to here", scene_.description && !scene_.description->sameHost ? "another host's clock" : "-",
              Tone::kOld};
    }
    return ofField("  to here", format("%7.2f %7.2f", latency->p50_ms, latency->p99_ms));
  }
  Row markers() const {
    return ofStatus("markers", [](const v1::Status& s) {
      std::string text;
      for (const v1::LayerStatus& layer : s.markers().layers()) {
        text += (text.empty() ? "" : ", ") + wordOf("Colour", layer.colour()) +
                format(" %u/%u", layer.found(), layer.expected());
      }
      return text.empty() ? std::string("-") : text;
    });
  }
  Row found() const {
    return ofStatus("markers", [](const v1::Status& s) {
      unsigned found = 0, expected = 0;
      for (const v1::LayerStatus& layer : s.markers().layers()) found += layer.found(), expected += layer.expected();
      return format("%u/%u", found, expected);
    });
  }
  Row latency() const {
    return ofStatus("latency", [](const v1::Status& s) {
      const v1::Quantiles& total = s.latencies().total();
      return format("%.2f ms p50 %.2f p99 %.2f max", total.p50_s() * 1e3, total.p99_s() * 1e3, total.max_s() * 1e3);
    });
  }
  Row drift() const {
    return ofStatus("drift", [](const v1::Status& s) {
      if (!s.has_rest_drift()) return std::string("-");
      const v1::RestDrift& drift = s.rest_drift();
      return format("%+.2f %+.2f px, %s ago", drift.shift_u_px(), drift.shift_v_px(), duration(drift.age_s()).c_str());
    });
  }
  Row packets() const {
    return ofStatus("packets", [](const v1::Status& s) {
      std::string text;
      for (const TopNumber& one : topNumbers(s, "packets"))
        text += (text.empty() ? "" : " ") + std::to_string(one.number) + " " + one.word;
      return text.empty() ? std::string("-") : text;
    });
  }
  Row warmth() const {
    return ofStatus("camera", [](const v1::Status& s) {
      std::string text;
      const v1::CameraLink& link = s.camera_link();
      if (link.has_temperature()) text = format("%.1f °C", link.temperature());
      if (!link.ptp().empty()) text += (text.empty() ? "PTP " : ", PTP ") + printable(link.ptp());
      return text.empty() ? std::string("-") : text;
    });
  }
  Row memory() const {
    return ofStatus("memory", [](const v1::Status& s) {
      return s.memory_bytes() == 0 ? std::string("-")
                                   : format("%.1f MiB", static_cast<double>(s.memory_bytes()) / 1048576.0);
    });
  }
  Row realTime() const {
    return ofStatus("real time", [](const v1::Status& s) { return printable(grantedOf(s)); });
  }
  bool statusIsOld() const { return statusIsOld_; }

 private:
  bool isValid() const { return scene_.field && scene_.field->valid; }
  Row ofField(const char* label, const std::string& text) const {
    return {label, inBrackets(text, fieldIsOld_), fieldIsOld_ ? Tone::kOld : Tone::kPlain};
  }
  template <typename Text>
  Row ofStatus(const char* label, Text&& text) const {
    if (!scene_.status) return {label, "-", Tone::kOld};
    return {label, inBrackets(text(*scene_.status->message), statusIsOld_), statusIsOld_ ? Tone::kOld : Tone::kPlain};
  }

  const Scene& scene_;
  std::int64_t now_ns_;
  bool fieldIsOld_, statusIsOld_;
};

std::vector<Row> rowsOf(const Watched& one, std::int64_t now_ns) {
  const Numbers numbers(one.scene, now_ns);
  return {numbers.force(),
          numbers.total(),
          numbers.fields(),
          numbers.frames(),
          {"latency", "    p50     p99     max  ms", Tone::kOld},
          numbers.stage("  track", &v1::Latencies::track),
          numbers.stage("  solve", &v1::Latencies::solve),
          numbers.stage("  send", &v1::Latencies::send),
          numbers.stage("  total", &v1::Latencies::total),
          numbers.here(),
          numbers.markers(),
          numbers.residual(),
          numbers.drift(),
          numbers.packets(),
          numbers.warmth(),
          numbers.memory(),
          numbers.realTime()};
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
  std::string line = "!";
  int rows = 0;
  for (std::string_view rest = complaint; !rest.empty();) {
    const std::string_view word = rest.substr(0, rest.find(' '));
    const bool fits = static_cast<int>(line.size() + 1 + word.size()) <= canvas.width() - 2;
    if (!fits && rows + 1 == most) {
      canvas.text(1, row + rows, line.substr(0, static_cast<std::size_t>(std::max(canvas.width() - 5, 0))) + " ...",
                  kWarning);
      return most;
    }
    if (!fits) canvas.text(1, row + rows++, std::exchange(line, " "), kWarning);
    line.append(" ").append(word);
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
  }
  canvas.text(1, row + rows, line, kWarning);
  return rows + 1;
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
  const bool isBeside = canvas.width() >= 2 * kLedger - 1;
  drawRows(canvas, row + 2, bottom, rowsOf(one, now_ns));
  if (!isBeside) return;
  canvas.fill(canvas.width() - kLedger - 2, row + 2, kLedger + 2, bottom - row - 2, kPlain);
  drawLedger(canvas, canvas.width() - kLedger - 1, row + 2, bottom, one.scene,
             Numbers(one.scene, now_ns).statusIsOld());
}

void drawShort(Canvas& canvas, int row, const Watched& one, std::int64_t now_ns) {
  const std::string wrong = complaint(one, now_ns);
  const Numbers numbers(one.scene, now_ns);
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
      {numbers.force(), {"rate", format("%.1f/s", one.scene.rate_hz(now_ns))}, numbers.residual(), numbers.memory()});
  put(row + 3, {numbers.latency(), numbers.found()});
  put(row + 4, {lossesInWords(one.scene, numbers.statusIsOld())});
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
  const Numbers numbers(one.scene, now_ns);
  std::string line = titleOf(one) + "  " + stateOf(one, now_ns);
  for (const Row& row : {numbers.force(), Row{"rate", format("%.1f/s", one.scene.rate_hz(now_ns))}, numbers.latency(),
                         numbers.found(), numbers.residual(), lossesInWords(one.scene, numbers.statusIsOld())}) {
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
  for (const Row& row : rowsOf(one, now_ns)) add(row.label, row.text);
  const bool isOld = Numbers(one.scene, now_ns).statusIsOld();
  if (!one.scene.status) return text;
  add(isOld ? "frames, not of now" : "frames", "      /s       total");
  for (const Account& each : accountsOf(one.scene)) {
    const std::string rate = each.rate_hz ? format("%.1f", *each.rate_hz) : "";
    add("  " + each.name, format("%8s %11llu", rate.c_str(), Count{each.total}));
  }
  return text;
}

}  // namespace traction::client
