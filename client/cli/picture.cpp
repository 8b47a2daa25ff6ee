// The field's nodes become cells of the page, two columns wide so that they are about square. Where there is less room
// than nodes, cells sum the nodes (or parts of nodes) below them: forces add up. Where there is more, a node takes a
// block of cells. A cell's shade is the normal force, its arrow the direction of the tangential one.

#include "client/cli/picture.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <ctime>
#include <numbers>

namespace traction::cli {

namespace {

constexpr double kGramForce_N = 9.80665e-3;
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kSmallestScale_N = 0.01;  ///< below it there is noise
constexpr int kPanelWidth = 34;

constexpr Colour24 kPaper{14, 16, 24};
constexpr Colour24 kBar{36, 41, 58};
const Style kPlain;
const Style kDim{{120, 126, 142}, kPaper, false};
const Style kBright{{255, 255, 255}, kPaper, true};
const Style kGood{{120, 220, 140}, kPaper, false};
const Style kWarning{{255, 196, 84}, kPaper, true};
const Style kLine{{70, 76, 96}, kPaper, false};
const Style kAccent{{110, 190, 255}, kPaper, false};

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...) {
  std::array<char, 160> text;
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text.data(), text.size(), pattern, arguments);
  va_end(arguments);
  return text.data();
}

/// -1: the strongest pull, 1: the strongest press.
Colour24 shade(double share) {
  constexpr std::array<Colour24, 6> kPress = {
      {{22, 24, 36}, {66, 20, 96}, {150, 36, 98}, {222, 80, 50}, {250, 175, 50}, {255, 248, 180}}};
  constexpr std::array<Colour24, 3> kPull = {{{22, 24, 36}, {20, 80, 150}, {110, 210, 255}}};
  const auto along = [](const auto& stops, double where) {
    const double position = std::clamp(where, 0.0, 1.0) * static_cast<double>(stops.size() - 1);
    const auto below = std::min(static_cast<std::size_t>(position), stops.size() - 2);
    return mix(stops[below], stops[below + 1], position - static_cast<double>(below));
  };
  return share >= 0.0 ? along(kPress, share) : along(kPull, -share);
}

/// The arrow for a force (x right, y up) of a length between 0 and 1.
const char* arrow(double x, double y, double share) {
  constexpr std::array<const char*, 8> kLight = {"→", "↗", "↑", "↖", "←", "↙", "↓", "↘"};
  constexpr std::array<const char*, 8> kHeavy = {"⇒", "⇗", "⇑", "⇖", "⇐", "⇙", "⇓", "⇘"};
  if (share < 0.05) return "·";
  const auto octant = static_cast<std::size_t>(std::lround(std::atan2(y, x) * 4.0 / std::numbers::pi) + 8) % 8;
  return share < 0.4 ? kLight[octant] : kHeavy[octant];
}

/// Forces summed into columns x rows cells; the first row is the lowest (smallest y).
std::vector<Vector3> gather(const Field& field, int fromColumns, int fromRows, int columns, int rows) {
  std::vector<Vector3> cells(static_cast<std::size_t>(columns * rows));
  const auto overlap = [](int cell, int cells_, int node, int nodes) {
    const double size = static_cast<double>(nodes) / cells_;
    return std::max(0.0, std::min((cell + 1) * size, node + 1.0) - std::max(cell * size, static_cast<double>(node)));
  };
  for (int row = 0; row < fromRows; ++row) {
    for (int column = 0; column < fromColumns; ++column) {
      const auto& force = field.force_N[static_cast<std::size_t>(row * fromColumns + column)];
      const int r0 = row * rows / fromRows, r1 = std::min(rows - 1, ((row + 1) * rows - 1) / fromRows);
      const int c0 = column * columns / fromColumns;
      const int c1 = std::min(columns - 1, ((column + 1) * columns - 1) / fromColumns);
      for (int r = r0; r <= r1; ++r) {
        for (int c = c0; c <= c1; ++c) {
          const double share = overlap(r, rows, row, fromRows) * overlap(c, columns, column, fromColumns);
          for (std::size_t i = 0; i < 3; ++i) {
            cells[static_cast<std::size_t>(r * columns + c)][i] += share * static_cast<double>(force[i]);
          }
        }
      }
    }
  }
  return cells;
}

/// How the field is laid out in the room there is.
struct Layout {
  int columns, rows;  ///< cells
  int block;          ///< a cell is 2 * block characters wide and block high
  int width() const { return 2 * block * columns + 2; }
  int height() const { return block * rows + 2; }
};

Layout layoutFor(int nodeColumns, int nodeRows, int width, int height) {
  const int wide = std::max((width - 2) / 2, 1);
  const int high = std::max(height - 2, 1);
  const int block = std::max(1, std::min(wide / nodeColumns, high / nodeRows));
  // One measure for both directions keeps the picture in proportion.
  const double shrink = std::min({1.0, static_cast<double>(wide) / nodeColumns, static_cast<double>(high) / nodeRows});
  const auto cells = [&](int nodes) { return std::max(1, static_cast<int>(nodes * shrink)); };
  return {cells(nodeColumns), cells(nodeRows), block};
}

void centred(Canvas& canvas, int column, int row, int width, std::string_view text, const Style& style) {
  const auto characters =
      static_cast<int>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
  canvas.text(column + std::max(0, (width - characters) / 2), row, text, style);
}

/// Why there is no field to show; empty: there is one.
std::string obstacle(const Scene& scene) {
  if (scene.field && scene.field->valid) return "";
  if (scene.field) return "too few markers are seen";
  if (!scene.status) return "waiting for the first message";
  switch (scene.status->camera) {
  case CameraState::kWaiting:
    return "tractiond waits for a camera";
  case CameraState::kLost:
    return "tractiond has lost its camera";
  case CameraState::kStreaming:
    return scene.status->received_hz > 0.0 ? "finding the markers and their rest pose" : "the camera sends no frames";
  case CameraState::kUnknown:
    break;
  }
  return "tractiond is starting";
}

/// Where on the page a point of the touched surface is, from 0 (left, low) to 1.
Vector2 shareOf(const Vector2& point_m, const Grid& nodes) {
  return {((point_m[0] - nodes.centre_m[0]) / nodes.pitch_m + nodes.columns / 2.0) / nodes.columns,
          ((point_m[1] - nodes.centre_m[1]) / nodes.pitch_m + nodes.rows / 2.0) / nodes.rows};
}

/// The shades and arrows; returns the force that is drawn brightest.
double drawCells(Canvas& canvas, const Scene& scene, const Layout& layout, int left, int top, Scale& scale,
                 std::int64_t now_ns) {
  const Grid& nodes = scene.description->nodes;
  const auto cells =
      gather(*scene.field, static_cast<int>(nodes.columns), static_cast<int>(nodes.rows), layout.columns, layout.rows);
  double strongest = 0.0;
  for (const Vector3& force : cells) strongest = std::max(strongest, length(force));
  const double full_N = scale.update(strongest, now_ns);
  for (int r = 0; r < layout.rows; ++r) {
    for (int c = 0; c < layout.columns; ++c) {
      const Vector3& force = cells[static_cast<std::size_t>(r * layout.columns + c)];
      const double tangential = std::hypot(force[0], force[1]) / full_N;
      const Colour24 paper = shade(force[2] / full_N);
      const bool light = paper.red + paper.green > 330;
      const Colour24 contrast = light ? Colour24{10, 10, 10} : Colour24{255, 255, 255};
      const Style style{mix(paper, contrast, 0.22 + 1.3 * tangential), paper, tangential > 0.2};
      const int x = left + 2 * layout.block * c;
      const int y = top + layout.block * (layout.rows - 1 - r);
      canvas.fill(x, y, 2 * layout.block, layout.block, style);
      canvas.text(x + layout.block - 1, y + layout.block / 2, arrow(force[0], force[1], tangential), style);
    }
  }
  const Vector2 centre = shareOf(scene.field->centreOfPressure_m, nodes);
  if (scene.field->centreOfPressureValid && centre[0] > 0.0 && centre[0] < 1.0 && centre[1] > 0.0 && centre[1] < 1.0) {
    const int x = left + static_cast<int>(centre[0] * (layout.width() - 2));
    const int y = top + static_cast<int>((1.0 - centre[1]) * (layout.height() - 2));
    canvas.text(x, y, "✛", {{90, 255, 240}, shade(0.0), true});
  }
  return full_N;
}

/// The field in its frame; returns the force that is drawn brightest, 0 where there is no field.
double drawField(Canvas& canvas, const Scene& scene, const Layout& layout, int column, int row, Scale& scale,
                 std::int64_t now_ns) {
  canvas.frame(column, row, layout.width(), layout.height(), kLine);
  canvas.text(column, row + 1, "↑", kDim);
  canvas.text(column, row + 2, "y", kDim);
  const int bottom = row + layout.height() - 1;
  canvas.text(column + layout.width() - 5, bottom, " x → ", kDim);
  const int left = column + 1, top = row + 1;
  canvas.fill(left, top, layout.width() - 2, layout.height() - 2, {kPlain.ink, shade(0.0)});

  std::string why = obstacle(scene);
  if (why.empty() && !scene.description) why = "waiting for the description";
  if (why.empty()) {
    const Grid& nodes = scene.description->nodes;
    canvas.text(column + 2, bottom,
                format(" %.0f × %.0f mm ", nodes.columns * nodes.pitch_m * 1e3, nodes.rows * nodes.pitch_m * 1e3),
                kDim);
    if (scene.field->force_N.size() == std::size_t{nodes.columns} * nodes.rows) {
      return drawCells(canvas, scene, layout, left, top, scale, now_ns);
    }
    why = "field and description do not match";
  }
  centred(canvas, left, top + (layout.height() - 2) / 2, layout.width() - 2, why, {{255, 196, 84}, shade(0.0), false});
  return 0.0;
}

/// The tangential part of the resultant as an arrow in a circle, its length of the whole force.
void drawDial(Canvas& canvas, int column, int row, const Vector3& resultant_N) {
  constexpr int kColumns = 10, kRows = 5;
  Dots circle(kColumns, kRows), needle(kColumns, kRows);
  const double centre = (circle.width() - 1) / 2.0;
  const double radius = centre;
  for (int i = 0; i < 60; ++i) {
    const double angle = i * 6.0 / kDegrees;
    circle.set(static_cast<int>(std::lround(centre + radius * std::cos(angle))),
               static_cast<int>(std::lround(centre - radius * std::sin(angle))));
  }
  circle.paint(canvas, column, row, kLine);
  const double total = length(resultant_N);
  if (total < kSmallestScale_N) return;
  const double x = resultant_N[0] / total * (radius - 1.0), y = -resultant_N[1] / total * (radius - 1.0);
  const double tip = std::hypot(x, y);
  needle.line(centre, centre, centre + x, centre + y);
  if (tip > 2.0) {
    for (const double side : {2.6, -2.6}) {
      const double angle = std::atan2(y, x) + side;
      needle.line(centre + x, centre + y, centre + x + 3.0 * std::cos(angle), centre + y + 3.0 * std::sin(angle));
    }
  } else {
    for (const double d : {0.0, 1.0}) needle.line(centre - 0.5, centre - 0.5 + d, centre + 0.5, centre - 0.5 + d);
  }
  needle.paint(canvas, column, row, kAccent);
}

void drawHistory(Canvas& canvas, const std::deque<double>& history, int column, int row, int width, int height) {
  Dots dots(width, height);
  const double top = history.empty() ? 0.0 : *std::max_element(history.begin(), history.end());
  const double full = std::max(top, 5.0 * kSmallestScale_N);
  const auto count = std::min(history.size(), static_cast<std::size_t>(dots.width()));
  for (std::size_t i = 0; i < count; ++i) {
    const double value = history[history.size() - count + i] / full;
    const int x = dots.width() - static_cast<int>(count) + static_cast<int>(i);
    const int y = static_cast<int>(std::lround((1.0 - value) * (dots.height() - 1)));
    for (int below = y; below < dots.height(); ++below) dots.set(x, below);
  }
  dots.paint(canvas, column, row, kAccent);
}

std::string duration(double seconds) {
  if (seconds < 120.0) return format("%.0f s", seconds);
  if (seconds < 7200.0) return format("%.0f min", seconds / 60.0);
  return seconds < 172'800.0 ? format("%.0f h", seconds / 3600.0) : format("%.0f days", seconds / 86'400.0);
}

std::string zeroText(const Scene& scene) {
  if (!scene.description || !scene.description->zero) return "none yet";
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const double age_s = static_cast<double>(now.tv_sec) - static_cast<double>(scene.description->zero->time_ns) * 1e-9;
  return duration(std::max(age_s, 0.0)) + " old" + (scene.description->zero->requested ? "" : ", taken at first start");
}

std::vector<std::string> warnings(const Scene& scene, std::int64_t now_ns) {
  std::vector<std::string> texts;
  const double silence_s = static_cast<double>(now_ns - scene.lastArrival_ns) * 1e-9;
  if (scene.lastArrival_ns != 0 && silence_s > 2.5) texts.push_back(format("nothing heard for %.0f s", silence_s));
  if (scene.status && scene.status->camera == CameraState::kLost) texts.push_back("camera lost");
  if (!scene.field) return texts;
  const std::uint32_t flags = scene.field->header.flags;
  if (flags & kZeroUnverified) texts.push_back("zero not verified: tractionctl zero");
  if (flags & kFewMarkers) texts.push_back("too few markers");
  if (flags & kReacquiring) texts.push_back("markers labelled anew");
  if (flags & kDiscontinuity) texts.push_back("frames were lost before this one");
  return texts;
}

/// The numbers, most important first; what does not fit is left out.
void drawPanel(Canvas& canvas, const Scene& scene, int column, int row, int bottom, int width, std::int64_t now_ns) {
  const Field none;
  const Field& field = scene.field ? *scene.field : none;
  const bool valid = scene.field && field.valid;
  const auto line = [&](const char* name, const std::string& value, const char* unit, const Style& style) {
    if (row >= bottom) return;
    canvas.text(column, row, name, kDim);
    canvas.text(canvas.text(column + 9, row, value, valid || style == kPlain ? style : kDim) + 1, row, unit, kDim);
    ++row;
  };
  const auto heading = [&](const char* text) {
    if (row < bottom) canvas.text(column, row++, text, kAccent);
  };
  const Vector3& force = field.resultant_N;
  const double total = length(force), tangential = std::hypot(force[0], force[1]);
  heading("FORCE ON THE GEL");
  line("x", format("%+8.3f", force[0]), "N  to the right", kBright);
  line("y", format("%+8.3f", force[1]), "N  up", kBright);
  line("z", format("%+8.3f", force[2]), "N  into the gel", kBright);
  line("total", format("%8.3f", total), format("N  %.0f gf", total / kGramForce_N).c_str(), kBright);
  if (total > 5.0 * kSmallestScale_N) {
    line("slant", format("%8.1f", std::atan2(tangential, force[2]) * kDegrees),
         format("°  towards %.0f°", std::fmod(std::atan2(force[1], force[0]) * kDegrees + 360.0, 360.0)).c_str(),
         kBright);
  } else {
    line("slant", "       –", "", kDim);
  }
  line("torsion", format("%+8.2f", field.moment_Nm[2] * 1e3), "mN m about z", kPlain);
  line("centre",
       field.centreOfPressureValid
           ? format("%+5.1f %+5.1f", field.centreOfPressure_m[0] * 1e3, field.centreOfPressure_m[1] * 1e3)
           : "–",
       field.centreOfPressureValid ? "mm (x, y)" : "", kPlain);

  constexpr int kNumbers = 7, kDial = 5;
  if (bottom - row >= kNumbers + kDial + 1) {
    ++row;
    drawDial(canvas, column, row, valid ? force : Vector3{});
    drawHistory(canvas, scene.history(), column + 12, row, std::max(0, width - 13), kDial);
    row += kDial;
  }
  if (bottom - row > kNumbers) ++row;
  const auto latency = scene.latency(now_ns);
  line("rate", format("%8.1f", scene.rate_hz(now_ns)), "fields/s", kPlain);
  line("latency", latency ? format("%8.2f", latency->p50_ms) : "       –",
       latency ? format("ms, p99 %.2f", latency->p99_ms).c_str() : "another host's clock", kPlain);
  const std::uint64_t inDaemon = scene.status ? scene.status->ledger.losses() - scene.status->ledger.noRestPose : 0;
  const std::uint64_t missing = scene.status ? scene.status->ledger.missing : 0;
  line("lost", format("%llu", static_cast<unsigned long long>(scene.lost + inDaemon + missing)),
       format("(camera %llu daemon %llu here %llu)", static_cast<unsigned long long>(missing),
              static_cast<unsigned long long>(inDaemon), static_cast<unsigned long long>(scene.lost))
           .c_str(),
       scene.lost + inDaemon + missing ? kWarning : kPlain);
  std::size_t expected = 0;
  if (scene.description) {
    for (const MarkerLayer& layer : scene.description->layers)
      expected += std::size_t{layer.grid.columns} * layer.grid.rows;
  }
  line("markers", format("%u of %zu", field.validMarkers, expected), "", kPlain);
  line("residual", format("%8.3f", field.residual_px), "px", kPlain);
  line("zero", zeroText(scene), "", kPlain);
  for (const std::string& text : warnings(scene, now_ns)) {
    if (row < bottom) canvas.text(column, row++, "! " + text, kWarning);
  }
}

void drawBar(Canvas& canvas, const Scene& scene, std::string_view endpoint) {
  const Style bar{{230, 232, 240}, kBar, true}, quiet{{150, 156, 175}, kBar, false};
  canvas.fill(0, 0, canvas.width(), 1, bar);
  int column = canvas.text(1, 0, "tractiond", bar);
  if (scene.description)
    column = canvas.text(column + 1, 0, scene.description->header.sensor, {kAccent.ink, kBar, true});
  if (scene.description && !scene.description->camera.model.empty()) {
    const Camera& camera = scene.description->camera;
    column = canvas.text(column + 2, 0, camera.vendor + " " + camera.model, quiet);
  }
  const std::string right = std::string(endpoint) + "  q quits ";
  const int start = canvas.width() - static_cast<int>(right.size());
  if (start > column + 2) {
    canvas.text(start, 0, right, quiet);
  } else if (canvas.width() - 9 > column + 2) {
    canvas.text(canvas.width() - 9, 0, "q quits ", quiet);
  }
}

void drawLegend(Canvas& canvas, int row, double full_N, const Layout& layout, int nodeColumns) {
  constexpr int kSteps = 15;
  int column = canvas.text(1, row, "pull ", kDim);
  for (int i = -kSteps / 3; i <= kSteps; ++i) {
    column = canvas.text(column, row, " ", {kPlain.ink, shade(static_cast<double>(i) / kSteps)});
  }
  column = canvas.text(column, row, " press", kDim);
  if (full_N > 0.0) {
    const char* of = layout.columns == nodeColumns ? "node" : "cell";
    column = canvas.text(column, row, format(" (full: %g N a %s)", full_N, of), kDim);
  }
  column = canvas.text(column, row, "   → ⇒ shear", kDim);
  canvas.text(column, row, "   ✛ centre of pressure", kDim);
}

}  // namespace

double Scale::update(double strongest_N, std::int64_t now_ns) {
  const double wanted = std::max(strongest_N, kSmallestScale_N);
  const double decade = std::pow(10.0, std::floor(std::log10(wanted * 1.0000001)));
  double step = 10.0 * decade;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * decade >= wanted * 0.9999999) step = factor * decade;
  }
  if (step >= scale_N_) {
    scale_N_ = step;
    needed_ns_ = now_ns;
  } else if (now_ns - needed_ns_ > 2'000'000'000) {
    scale_N_ = step;
  }
  return scale_N_;
}

Canvas draw(const Scene& scene, int width, int height, Scale& scale, std::int64_t now_ns, std::string_view endpoint) {
  Canvas canvas(width, height);
  const Grid nodes = scene.description ? scene.description->nodes : Grid{24, 24};
  const int nodeColumns = static_cast<int>(std::clamp(nodes.columns, 1U, 1000U));
  const int nodeRows = static_cast<int>(std::clamp(nodes.rows, 1U, 1000U));
  drawBar(canvas, scene, endpoint);
  constexpr int kTop = 1;
  const int bottom = height >= 12 ? height - 1 : height;
  const int room = bottom - kTop;

  // The panel stands beside the field unless the field gets much larger with the panel below it.
  const Layout beside = layoutFor(nodeColumns, nodeRows, width - kPanelWidth - 1, room);
  const Layout above = layoutFor(nodeColumns, nodeRows, width, room - std::min(8, room / 3));
  const bool isBeside = width >= kPanelWidth + 20 && 4 * beside.width() >= 3 * above.width();
  const Layout& layout = isBeside ? beside : above;
  const double full_N = drawField(canvas, scene, layout, 0, kTop, scale, now_ns);
  if (isBeside) {
    const int column = layout.width() + 2;
    drawPanel(canvas, scene, column, kTop, bottom, width - column, now_ns);
  } else {
    drawPanel(canvas, scene, 1, kTop + layout.height(), bottom, width - 2, now_ns);
  }
  if (bottom < height) drawLegend(canvas, bottom, full_N, layout, nodeColumns);
  return canvas;
}

std::string summary(const Scene& scene, std::int64_t now_ns) {
  std::string line = format("%6.1f/s", scene.rate_hz(now_ns));
  const std::string why = obstacle(scene);
  if (why.empty()) {
    const Vector3& force = scene.field->resultant_N;
    line += format("  force %+.3f %+.3f %+.3f N  total %.3f N  markers %u  residual %.3f px", force[0], force[1],
                   force[2], length(force), scene.field->validMarkers, scene.field->residual_px);
  } else {
    line += "  " + why;
  }
  if (const auto latency = scene.latency(now_ns)) {
    line += format("  latency %.2f ms p50 %.2f ms p99", latency->p50_ms, latency->p99_ms);
  }
  line += format("  lost %llu", static_cast<unsigned long long>(scene.lost));
  for (const std::string& text : warnings(scene, now_ns)) line += "  ! " + text;
  return line;
}

}  // namespace traction::cli
