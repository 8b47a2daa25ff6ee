// Draws the field on cells of the page, two columns wide so that they are about square, as many as there is room for. A
// cell shows the force of the nodes that it covers, whole or in part, for the area of one node: its shade is the normal
// force, its arrow the direction of the tangential one.

#include "client/show/health.h"
#include "client/show/picture_parts.h"

#include <algorithm>
#include <cmath>

namespace traction::client {

namespace {

constexpr double kSmallestStrain = 0.1;  ///< pressure on a node below which noise would be drawn, of Young's modulus
constexpr double kFaint = 0.08;          ///< smaller shear is drawn as a dot, of the scale

/// Returns the shade of a normal force.
/// \param share -1: the strongest pull, 1: the strongest press
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

/// Returns the colour of an outdated field.
Colour24 faded(Colour24 colour) {
  const auto grey = static_cast<std::uint8_t>((colour.red + colour.green + colour.blue) / 8);
  return {grey, grey, grey};
}

/// Returns the arrow for a force (x right, y up).
/// \param share of the scale, 0 to 1
const char* arrow(double x, double y, double share) {
  constexpr std::array<const char*, 8> kLight = {"→", "↗", "↑", "↖", "←", "↙", "↓", "↘"};
  constexpr std::array<const char*, 8> kHeavy = {"⇒", "⇗", "⇑", "⇖", "⇐", "⇙", "⇓", "⇘"};
  if (share < kFaint) return "·";
  const auto octant = static_cast<std::size_t>(std::lround(std::atan2(y, x) * 4.0 / std::numbers::pi) + 8) % 8;
  return share < 0.4 ? kLight[octant] : kHeavy[octant];
}

/// Returns the length, in nodes, that a cell and a node have in common on an axis that both divide evenly.
double overlap(int cell, int cells, int node, int nodes) {
  const double size = static_cast<double>(nodes) / cells;
  return std::max(0.0, std::min((cell + 1) * size, node + 1.0) - std::max(cell * size, static_cast<double>(node)));
}

/// Returns the field on columns x rows cells [N per area of a node], row by row from the lowest (smallest y).
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

/// Writes a text in the middle of a rectangle. Returns false, and writes nothing, if it does not fit.
bool centred(Canvas& canvas, int column, int row, int width, int height, std::string_view text, const Style& style) {
  const std::vector<std::string> lines = wrapped(text, width);
  const auto isTooLong = [&](const std::string& line) { return columnsOf(line) > width; };
  if (static_cast<int>(lines.size()) > height || std::any_of(lines.begin(), lines.end(), isTooLong)) return false;
  row += (height - static_cast<int>(lines.size())) / 2;
  for (const std::string& line : lines) canvas.text(column + (width - columnsOf(line)) / 2, row++, line, style);
  return true;
}

/// Returns the place of a point of the touched surface in the field, from 0 (left, low) to 1.
Vector2 shareOf(const Vector2& point_m, const Grid& nodes) {
  return {((point_m[0] - nodes.centre_m[0]) / nodes.pitch_m + nodes.columns / 2.0) / nodes.columns,
          ((point_m[1] - nodes.centre_m[1]) / nodes.pitch_m + nodes.rows / 2.0) / nodes.rows};
}

/// Draws the resultant at the centre of pressure, its tangential part as an arrow: half the field's width stands for
/// the length of the resultant.
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

/// Writes the ids of the contacts where they are.
void drawIds(Canvas& canvas, const std::vector<TrackedContact>& contacts, const Grid& nodes, const Layout& layout,
             int left, int top) {
  for (const TrackedContact& each : contacts) {
    const Vector2 at = shareOf(each.position_m, nodes);
    if (!isSeen(each) || std::abs(at[0] - 0.5) >= 0.5 || std::abs(at[1] - 0.5) >= 0.5) continue;
    const std::string id = std::to_string(each.id);
    const int width = layout.width() - 2, start = static_cast<int>(at[0] * width) + 1;
    canvas.text(left + std::max(0, std::min(start, width - static_cast<int>(id.size()))),
                top + static_cast<int>((1.0 - at[1]) * (layout.height() - 2)), id, kShear, Canvas::Paper::kKept);
  }
}

/// Draws the shades and arrows. Returns the force of full brightness [N].
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
  if (const auto contacts = scene.touching(now_ns)) drawIds(canvas, *contacts, nodes, layout, left, top);
  return full_N;
}

}  // namespace

Layout layoutFor(int nodeColumns, int nodeRows, int width, int height) {
  double scale = std::min((width - 2) / 2.0 / nodeColumns, (height - 2.0) / nodeRows);
  if (scale > 1.0) scale = std::floor(2.0 * scale) / 2.0;  // one or two cells per node: a regular picture
  const auto cells = [&](int nodes) { return std::max(1, static_cast<int>(nodes * scale + 1e-9)); };
  return {cells(nodeColumns), cells(nodeRows)};
}

DrawnField drawField(Canvas& canvas, const Scene& scene, const Layout& layout, int column, int row, Scale& scale,
                     std::int64_t now_ns) {
  canvas.frame(column, row, layout.width(), layout.height(), kLine);
  canvas.text(column, row + 1, "↑", kDim);
  canvas.text(column, row + 2, "y", kDim);
  const int bottom = row + layout.height() - 1;
  canvas.text(column + layout.width() - 5, bottom, " x → ", kDim);
  int next = column + 2;
  const std::vector<Problem> wrong = problems(scene, now_ns);
  for (const Problem& one : wrong) {
    const bool isNote = one.health == Health::kMeasuring;
    if (!isNote && one.health != Health::kDoubtful) continue;
    if (next + columnsOf(one.what) + 5 > column + layout.width()) break;
    next = canvas.text(next, row, (isNote ? " " : " ! ") + one.what + " ", isNote ? kDim : kWarning);
  }
  const int left = column + 1, top = row + 1;
  canvas.fill(left, top, layout.width() - 2, layout.height() - 2, {kPlain.ink, shade(0.0)});

  std::string why = healthOf(wrong) < Health::kNoForces ? "" : wrong.front().what;
  DrawnField drawn;
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

}  // namespace traction::client
