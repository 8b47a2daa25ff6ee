// The field is drawn on cells of the page, two columns wide so that they are about square, as many as there is room
// for. A cell shows the force of the nodes below it, whole or in part, for the area of one node: its shade is the
// normal force, its arrow the direction of the tangential one.

#include "client/cli/picture.h"

#include "client/cli/page.h"
#include "client/cli/reflection.h"
#include "client/src/printable.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>

namespace traction::cli {

namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kSmallestForce_N = 0.1;  ///< of a resultant with a direction worth telling
constexpr double kSmallestStrain = 0.1;   ///< pressure on a node, of Young's modulus, below which noise would be drawn
constexpr double kFaint = 0.08;           ///< of the scale; smaller shear is drawn as a dot
constexpr int kPanelWidth = 34;

const Style kShear{{90, 255, 240}, kPaper, true};

/// 1, 2 or 5 times a power of ten.
double roundUp(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= value * (1.0 - 1e-9)) return factor * decade;
  }
  return 10.0 * decade;
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

/// Of what is no more.
Colour24 faded(Colour24 colour) {
  const auto grey = static_cast<std::uint8_t>((colour.red + colour.green + colour.blue) / 8);
  return {grey, grey, grey};
}

/// The arrow for a force (x right, y up) of a length between 0 and 1.
const char* arrow(double x, double y, double share) {
  constexpr std::array<const char*, 8> kLight = {"→", "↗", "↑", "↖", "←", "↙", "↓", "↘"};
  constexpr std::array<const char*, 8> kHeavy = {"⇒", "⇗", "⇑", "⇖", "⇐", "⇙", "⇓", "⇘"};
  if (share < kFaint) return "·";
  const auto octant = static_cast<std::size_t>(std::lround(std::atan2(y, x) * 4.0 / std::numbers::pi) + 8) % 8;
  return share < 0.4 ? kLight[octant] : kHeavy[octant];
}

/// How much of [node, node + 1] of `nodes` lies in the cell of `cells` that divide the same length, in nodes.
double overlap(int cell, int cells, int node, int nodes) {
  const double size = static_cast<double>(nodes) / cells;
  return std::max(0.0, std::min((cell + 1) * size, node + 1.0) - std::max(cell * size, static_cast<double>(node)));
}

/// The field on columns x rows cells [N per area of a node]; the first row is the lowest (smallest y).
std::vector<Vector3> resample(const Field& field, int fromColumns, int fromRows, int columns, int rows) {
  std::vector<Vector3> cells;
  const double nodesPerCell = static_cast<double>(fromColumns) * fromRows / columns / rows;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      Vector3 sum{};
      const int lastRow = std::min(fromRows - 1, (row + 1) * fromRows / rows);
      const int lastColumn = std::min(fromColumns - 1, (column + 1) * fromColumns / columns);
      for (int r = row * fromRows / rows; r <= lastRow; ++r) {
        for (int c = column * fromColumns / columns; c <= lastColumn; ++c) {
          const double share = overlap(row, rows, r, fromRows) * overlap(column, columns, c, fromColumns);
          const auto& force = field.force_N[static_cast<std::size_t>(r * fromColumns + c)];
          for (std::size_t i = 0; i < 3; ++i) sum[i] += share * static_cast<double>(force[i]) / nodesPerCell;
        }
      }
      cells.push_back(sum);
    }
  }
  return cells;
}

/// From (x, y) by (dx, dy), in dots, y down.
void drawArrow(Dots& dots, double x, double y, double dx, double dy) {
  constexpr double kHalfAngle = 0.55;
  const double head = std::clamp(0.45 * std::hypot(dx, dy), 2.0, 4.0);
  const double direction = std::atan2(dy, dx);
  const double tipX = x + dx, tipY = y + dy;
  dots.line(x, y, tipX, tipY);
  if (std::hypot(dx, dy) < 2.0) return;
  for (const double back : {direction + kHalfAngle, direction - kHalfAngle}) {
    dots.line(tipX, tipY, tipX - head * std::cos(back), tipY - head * std::sin(back));
  }
}

/// What a reader of the field should know, most important first.
std::vector<std::string> warnings(const Scene& scene, std::int64_t now_ns) {
  constexpr std::int64_t kRestartIsNews_ns = 10'000'000'000;
  std::vector<std::string> texts;
  if (scene.restarted_ns != 0 && now_ns - scene.restarted_ns < kRestartIsNews_ns)
    texts.push_back("tractiond restarted");
  if (!scene.field || !scene.trouble(now_ns).what.empty()) return texts;
  for (const std::string& one : words(scene.field->header.flags)) texts.push_back(one);
  return texts;
}

/// The cells of the field, and the room they take with their frame.
struct Layout {
  int columns, rows;
  int width() const { return 2 * columns + 2; }
  int height() const { return rows + 2; }
};

Layout layoutFor(int nodeColumns, int nodeRows, int width, int height) {
  double scale = std::min((width - 2) / 2.0 / nodeColumns, (height - 2.0) / nodeRows);
  if (scale > 1.0) scale = std::floor(2.0 * scale) / 2.0;  // a cell or two a node: a regular picture
  const auto cells = [&](int nodes) { return std::max(1, static_cast<int>(nodes * scale + 1e-9)); };
  return {cells(nodeColumns), cells(nodeRows)};
}

int columnsOf(std::string_view utf8) {
  return static_cast<int>(std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

/// In lines, with a blank on either side.
std::vector<std::string> wrapped(std::string_view text, int width) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    if (lines.empty() || columnsOf(lines.back()) + 1 + columnsOf(word) > width) {
      lines.push_back(" " + std::string(word) + " ");
    } else {
      lines.back().append(word).append(" ");
    }
    text.remove_prefix(std::min(word.size() + 1, text.size()));
  }
  return lines;
}

/// In the middle; false: there is no room for it.
bool centred(Canvas& canvas, int column, int row, int width, int height, std::string_view text, const Style& style) {
  const std::vector<std::string> lines = wrapped(text, width);
  const auto isTooLong = [&](const std::string& line) { return columnsOf(line) > width; };
  if (static_cast<int>(lines.size()) > height || std::any_of(lines.begin(), lines.end(), isTooLong)) return false;
  row += (height - static_cast<int>(lines.size())) / 2;
  for (const std::string& line : lines) canvas.text(column + (width - columnsOf(line)) / 2, row++, line, style);
  return true;
}

/// Why there are no forces of now to show; empty: there are.
std::string obstacle(const Scene& scene, std::int64_t now_ns) {
  const Scene::Trouble trouble = scene.trouble(now_ns);
  if (!trouble.what.empty()) return scene.sentence(trouble);
  if (scene.field->valid) return "";
  if (scene.status && !(*scene.status)->invalid_why().empty()) return printable((*scene.status)->invalid_why());
  return (scene.field->header.flags & kGelMismatch) != 0 ? "the gel file does not fit the picture"
                                                         : "too few markers are seen";
}

/// Where on the page a point of the touched surface is, from 0 (left, low) to 1.
Vector2 shareOf(const Vector2& point_m, const Grid& nodes) {
  return {((point_m[0] - nodes.centre_m[0]) / nodes.pitch_m + nodes.columns / 2.0) / nodes.columns,
          ((point_m[1] - nodes.centre_m[1]) / nodes.pitch_m + nodes.rows / 2.0) / nodes.rows};
}

/// Where the force acts, and its tangential part as a long arrow: half the field's width for all of the force.
void drawResultant(Canvas& canvas, const Field& field, const Grid& nodes, const Layout& layout, int left, int top) {
  const Vector2 centre = shareOf(field.centreOfPressure_m, nodes);
  if (!field.centreOfPressureValid || std::abs(centre[0] - 0.5) >= 0.5 || std::abs(centre[1] - 0.5) >= 0.5) return;
  Dots dots(layout.width() - 2, layout.height() - 2);
  const double x = centre[0] * dots.width(), y = (1.0 - centre[1]) * dots.height();
  const double reach = dots.width() / 2.0 / length(field.resultant_N);
  drawArrow(dots, x, y, field.resultant_N[0] * reach, -field.resultant_N[1] * reach);
  dots.paint(canvas, left, top, kShear, Canvas::Paper::kKept);
  canvas.text(left + static_cast<int>(x / 2.0), top + static_cast<int>(y / 4.0), "✛", kShear, Canvas::Paper::kKept);
}

/// The shades and arrows; returns the force that is drawn brightest.
double drawCells(Canvas& canvas, const Scene& scene, const Layout& layout, int left, int top, Scale& scale,
                 std::int64_t now_ns, bool isOld) {
  const Grid& nodes = scene.description->nodes;
  const auto cells = resample(*scene.field, static_cast<int>(nodes.columns), static_cast<int>(nodes.rows),
                              layout.columns, layout.rows);
  double strongest_N = 0.0;
  for (const Vector3& force : cells) strongest_N = std::max(strongest_N, length(force));
  const double smallest_N = kSmallestStrain * scene.description->gel.youngsModulus_Pa * nodes.pitch_m * nodes.pitch_m;
  const double full_N = scale.update(strongest_N, std::max(smallest_N, 1e-6), now_ns);
  for (int r = 0; r < layout.rows; ++r) {
    for (int c = 0; c < layout.columns; ++c) {
      const Vector3& force = cells[static_cast<std::size_t>(r * layout.columns + c)];
      const double tangential = std::hypot(force[0], force[1]) / full_N;
      const Colour24 paper = isOld ? faded(shade(force[2] / full_N)) : shade(force[2] / full_N);
      const Colour24 contrast = isLight(paper) ? Colour24{10, 10, 10} : Colour24{255, 255, 255};
      const Style style{mix(paper, contrast, 0.2 + 1.3 * tangential), paper, tangential > 0.2};
      const int y = top + layout.rows - 1 - r;
      canvas.text(canvas.text(left + 2 * c, y, arrow(force[0], force[1], tangential), style), y, " ", style);
    }
  }
  if (!isOld) drawResultant(canvas, *scene.field, nodes, layout, left, top);
  return full_N;
}

struct Drawn {
  double full_N = 0.0;  ///< the force that is drawn brightest; 0: no field
  std::string untold;   ///< what there was no room for
};

/// The field in its frame.
Drawn drawField(Canvas& canvas, const Scene& scene, const Layout& layout, int column, int row, Scale& scale,
                std::int64_t now_ns) {
  canvas.frame(column, row, layout.width(), layout.height(), kLine);
  canvas.text(column, row + 1, "↑", kDim);
  canvas.text(column, row + 2, "y", kDim);
  const int bottom = row + layout.height() - 1;
  canvas.text(column + layout.width() - 5, bottom, " x → ", kDim);
  int next = column + 2;
  for (const std::string& text : warnings(scene, now_ns)) {
    if (next + columnsOf(text) + 5 > column + layout.width()) break;
    next = canvas.text(next, row, " ! " + text + " ", kWarning);
  }
  const int left = column + 1, top = row + 1;
  canvas.fill(left, top, layout.width() - 2, layout.height() - 2, {kPlain.ink, shade(0.0)});

  std::string why = obstacle(scene, now_ns);
  Drawn drawn;
  if (scene.field && scene.field->valid && scene.description) {
    const Grid& nodes = scene.description->nodes;
    canvas.text(column + 2, bottom,
                format(" %.0f × %.0f mm ", nodes.columns * nodes.pitch_m * 1e3, nodes.rows * nodes.pitch_m * 1e3),
                kDim);
    if (scene.field->force_N.size() == std::size_t{nodes.columns} * nodes.rows) {
      drawn.full_N = drawCells(canvas, scene, layout, left, top, scale, now_ns, !why.empty());
    } else if (why.empty()) {
      why = "field and description do not match";
    }
  } else if (why.empty()) {
    why = "waiting for the description";
  }
  const Style style{kWarning.ink, shade(0.0), true};
  if (!centred(canvas, left, top, layout.width() - 2, layout.height() - 2, why, style)) drawn.untold = why;
  return drawn;
}

/// The tangential part of the resultant as an arrow in a circle, its length of the whole force.
void drawDial(Canvas& canvas, int column, int row, const Vector3& resultant_N) {
  Dots circle(10, 5), needle(10, 5);
  const double radius = (circle.width() - 1) / 2.0;
  for (int degrees = 0; degrees < 360; degrees += 6) {
    circle.set(static_cast<int>(std::lround(radius + radius * std::cos(degrees / kDegrees))),
               static_cast<int>(std::lround(radius + radius * std::sin(degrees / kDegrees))));
  }
  circle.paint(canvas, column, row, kLine);
  const double total = length(resultant_N);
  if (total < kSmallestForce_N) return;
  const double reach = (radius - 1.0) / total;
  drawArrow(needle, radius, radius, resultant_N[0] * reach, -resultant_N[1] * reach);
  needle.paint(canvas, column, row, kShear);
}

/// Returns the force at the top.
double drawHistory(Canvas& canvas, const std::deque<double>& history, int column, int row, int width, int height) {
  Dots dots(width, height);
  const auto count = std::min(history.size(), static_cast<std::size_t>(dots.width()));
  const auto first = history.end() - static_cast<std::ptrdiff_t>(count);
  const double full = roundUp(count == 0 ? 0.1 : std::max(*std::max_element(first, history.end()), 0.1));
  for (std::size_t i = 0; i < count; ++i) {
    const int x = dots.width() - static_cast<int>(count - i);
    const int y =
        static_cast<int>(std::lround((1.0 - first[static_cast<std::ptrdiff_t>(i)] / full) * (dots.height() - 1)));
    for (int below = y; below < dots.height(); ++below) dots.set(x, below);
  }
  dots.paint(canvas, column, row, kAccent);
  return full;
}

std::string zeroAge(const Scene& scene) {
  if (!scene.description || !scene.description->zero) return "none";
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return duration(
      std::max(0.0, static_cast<double>(now.tv_sec) - static_cast<double>(scene.description->zero->time_ns) * 1e-9));
}

/// The numbers, most important first; what does not fit is left out.
class Panel {
 public:
  Panel(Canvas& canvas, int column, int row, int width, int bottom)
      : canvas_(canvas)
      , column_(column)
      , row_(row)
      , width_(width)
      , bottom_(bottom) {}

  int left() const { return bottom_ - row_; }
  void skip() { ++row_; }

  void heading(const std::string& text, const Style& style = kAccent) {
    if (left() > 0) canvas_.text(column_, row_++, text, style);
  }
  /// name   number unit
  void line(const char* name, const std::string& number, const std::string& unit, const Style& style = kPlain) {
    if (left() <= 0) return;
    constexpr int kNumberEnd = 17;
    canvas_.text(column_, row_, name, kDim);
    const int start = column_ + std::max(9, kNumberEnd - static_cast<int>(number.size()));
    canvas_.text(canvas_.text(start, row_, number, style) + 1, row_, unit, kDim);
    ++row_;
  }

  /// Shear and history side by side, a caption above: 6 rows.
  void pictures(const Vector3& resultant_N, const std::deque<double>& history) {
    constexpr int kHistory = 13;
    canvas_.text(column_, row_, "shear", kDim);
    drawDial(canvas_, column_, row_ + 1, resultant_N);
    const double full_N =
        drawHistory(canvas_, history, column_ + kHistory, row_ + 1, std::clamp(width_ - kHistory - 1, 0, 40), 5);
    canvas_.text(column_ + kHistory, row_, format("total, up to %g N", full_N), kDim);
    row_ += 6;
  }

 private:
  Canvas& canvas_;
  int column_, row_, width_, bottom_;
};

/// Rows of each half of the panel that are always there.
constexpr int kNumbers = 6, kPictures = 6;

void drawForce(Panel& panel, const Scene& scene, std::int64_t now_ns, const std::string& untold) {
  const Field none;
  const Field& field = scene.field ? *scene.field : none;
  const bool isKnown = scene.field && field.valid;
  const Scene::Trouble trouble = scene.trouble(now_ns);
  const bool isOld = !trouble.what.empty();
  const Style& strong = isKnown && !isOld ? kBright : kDim;
  const auto known = [&](const std::string& number) { return isKnown ? inBrackets(number, isOld) : "-"; };
  const Vector3& force = field.resultant_N;
  const double total = length(force), tangential = std::hypot(force[0], force[1]);
  if (!untold.empty()) panel.heading(untold, kWarning);
  if (isKnown && isOld) {
    panel.heading("FORCE " + duration(trouble.since_s) + " AGO", kWarning);
  } else {
    panel.heading("FORCE ON THE GEL");
  }
  const auto note = [&](int axis, const char* direction) {
    const Covariance& covariance = field.resultantCovariance_N2;
    const double variance = covariance.noise[4 * axis] + covariance.systematic[4 * axis];
    return isKnown && variance > 0.0 ? format("±%.3f N  %s", 2.0 * std::sqrt(variance), direction)
                                     : format("N  %s", direction);
  };
  panel.line("x", known(format("%+.3f", force[0])), note(0, "to the right"), strong);
  panel.line("y", known(format("%+.3f", force[1])), note(1, "up"), strong);
  panel.line("z", known(format("%+.3f", force[2])), note(2, "into the gel"), strong);
  panel.line("total", known(format("%.3f", total)), isKnown ? format("N  %.0f gf", total / kGramForce_N) : "N", strong);
  if (isKnown && total > kSmallestForce_N) {
    panel.line("slant", known(format("%.1f", std::atan2(tangential, force[2]) * kDegrees)),
               format("°  towards %.0f°", std::fmod(std::atan2(force[1], force[0]) * kDegrees + 360.0, 360.0)), strong);
  } else {
    panel.line("slant", "-", "");
  }
  panel.line("torsion", known(format("%+.2f", field.moment_Nm[2] * 1e3)), "mN m about z", isOld ? kDim : kPlain);
  if (isKnown && field.centreOfPressureValid) {
    const Vector2& centre_m = field.centreOfPressure_m;
    panel.line("centre", known(format("%+.1f %+.1f", centre_m[0] * 1e3, centre_m[1] * 1e3)), "mm (x, y)",
               isOld ? kDim : kPlain);
  } else {
    panel.line("centre", "-", "");
  }

  if (isKnown && field.method != Method::kNone) {
    const bool listed = field.method == Method::kContact || field.method == Method::kNoContact;
    panel.line("contacts", listed ? known(format("%zu", field.contacts.size())) : "-",
               listed ? "" : "large or unexplained: whole face");
  }

  if (panel.left() >= kNumbers + kPictures + 2) {
    panel.skip();
    panel.pictures(isKnown && !isOld ? force : Vector3{}, scene.history());
  }
  if (panel.left() > kNumbers) panel.skip();
}

void drawLink(Panel& panel, const Scene& scene, std::int64_t now_ns) {
  panel.line("rate", format("%.1f", scene.rate_hz(now_ns)), "fields/s");
  if (const auto latency = scene.latency(now_ns)) {
    panel.line("latency", format("%.2f", latency->p50_ms), format("ms, p99 %.2f", latency->p99_ms));
  } else {
    panel.line("latency", "-", scene.description && !scene.description->sameHost ? "another host's clock" : "");
  }
  std::uint64_t missing = 0, inDaemon = 0;
  if (scene.status) {
    missing = (*scene.status)->ledger().missing();
    for (const TopNumber& one : topNumbers(*scene.status->message, "frames"))
      inDaemon += one.loss == v1::Top::LOSS_FRAME ? one.number : 0;
    inDaemon -= missing;
  }
  const auto count = [](std::uint64_t number) { return format("%llu", static_cast<unsigned long long>(number)); };
  const auto lost = [&](const char* name, std::uint64_t number, const char* where) {
    panel.line(name, count(number), where, number != 0 ? kWarning : kPlain);
  };
  lost("lost", missing + inDaemon + scene.lost, "frames");
  if (missing != 0) lost("", missing, "before they came here");
  if (inDaemon != 0) lost("", inDaemon, "in tractiond");
  if (scene.lost != 0) lost("", scene.lost, "messages on the way");
  std::size_t expected = 0;
  if (scene.description) {
    for (const MarkerLayer& layer : scene.description->layers) {
      expected += std::size_t{layer.grid.columns} * layer.grid.rows;
    }
  }
  const bool isOld = !scene.trouble(now_ns).what.empty();
  const auto last = [&](const std::string& number) { return !scene.field ? "-" : inBrackets(number, isOld); };
  const Field none;
  const Field& field = scene.field ? *scene.field : none;
  panel.line("markers", last(count(field.validMarkers)), "of " + count(expected), isOld ? kDim : kPlain);
  panel.line("residual", last(format("%.3f", field.residual_px)), "px", isOld ? kDim : kPlain);
  panel.line("zero", zeroAge(scene), scene.description && scene.description->zero ? "old" : "");
}

void drawPanel(Panel panel, const Scene& scene, std::int64_t now_ns, const std::string& untold) {
  drawForce(panel, scene, now_ns, untold);
  drawLink(panel, scene, now_ns);
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

void drawLegend(Canvas& canvas, int row, double full_N) {
  constexpr int kSteps = 15;
  int column = canvas.text(1, row, "pull ", kDim);
  for (int i = -kSteps / 3; i <= kSteps; ++i) {
    column = canvas.text(column, row, " ", {kPlain.ink, shade(static_cast<double>(i) / kSteps)});
  }
  column = canvas.text(column, row, " press", kDim);
  if (full_N > 0.0) column = canvas.text(column, row, format(" %g N/node", full_N), kDim);
  column = canvas.text(column, row, "   → ⇒ shear", kDim);
  canvas.text(column, row, "   ✛ resultant", kDim);
}

}  // namespace

double Scale::update(double strongest_N, double smallest_N, std::int64_t now_ns) {
  const double wanted_N = roundUp(std::max(strongest_N, smallest_N));
  if (wanted_N >= scale_N_) needed_ns_ = now_ns;
  if (wanted_N > scale_N_ || now_ns - needed_ns_ > 2'000'000'000) scale_N_ = wanted_N;
  return scale_N_;
}

Canvas draw(const Scene& scene, int width, int height, Scale& scale, std::int64_t now_ns, std::string_view endpoint) {
  Canvas canvas(width, height);
  const bool hasGel = scene.description && scene.description->hasGel();
  const Grid nodes = hasGel ? scene.description->nodes : Grid{24, 24};
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
  const auto [full_N, untold] = drawField(canvas, scene, layout, 0, kTop, scale, now_ns);
  if (isBeside) {
    const int column = layout.width() + 2;
    drawPanel(Panel(canvas, column, kTop, width - column, bottom), scene, now_ns, untold);
  } else {
    drawPanel(Panel(canvas, 1, kTop + layout.height(), width - 2, bottom), scene, now_ns, untold);
  }
  if (bottom < height) drawLegend(canvas, bottom, full_N);
  return canvas;
}

std::string summary(const Scene& scene, std::int64_t now_ns) {
  std::string line = format("%6.1f/s", scene.rate_hz(now_ns));
  const std::string why = obstacle(scene, now_ns);
  if (why.empty()) {
    const Vector3& force = scene.field->resultant_N;
    line += format("  force %+.3f %+.3f %+.3f N  total %.3f N  markers %u  residual %.3f px", force[0], force[1],
                   force[2], length(force), scene.field->validMarkers, scene.field->residual_px);
  } else {
    line += "  no force: " + why;
  }
  if (const auto latency = scene.latency(now_ns)) {
    line += format("  latency %.2f ms p50 %.2f ms p99", latency->p50_ms, latency->p99_ms);
  }
  line += format("  lost %llu", static_cast<unsigned long long>(scene.lost));
  for (const std::string& text : warnings(scene, now_ns)) line += "  ! " + text;
  return line;
}

}  // namespace traction::cli
