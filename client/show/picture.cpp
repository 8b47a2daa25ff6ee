#include "client/show/picture.h"

#include "client/show/health.h"
#include "client/show/picture_parts.h"

#include <algorithm>
#include <cmath>

namespace traction::client {

namespace {

constexpr int kPanelWidth = 34;

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

}  // namespace

double roundUp(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= value * (1.0 - 1e-9)) return factor * decade;
  }
  return 10.0 * decade;
}

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
    drawPanel(canvas, {column, kTop, width - column, room}, scene, now_ns, untold);
  } else {
    drawPanel(canvas, {1, kTop + layout.height(), width - 2, room - layout.height()}, scene, now_ns, untold);
  }
  if (bottom < height) drawLegend(canvas, bottom, full_N);
  return canvas;
}

std::string summary(const Scene& scene, std::int64_t now_ns) {
  std::string line = format("%6.1f/s", scene.rate_hz(now_ns));
  const std::vector<Problem> wrong = problems(scene, now_ns);
  if (healthOf(wrong) < Health::kNoForces) {
    const Vector3& force = scene.field->resultant_N;
    line += format("  force %+.3f %+.3f %+.3f N  total %.3f N  markers %u  residual %.3f px", force[0], force[1],
                   force[2], length(force), scene.field->validMarkers, scene.field->residual_px);
  } else {
    line += "  no force: " + wrong.front().what;
  }
  for (const TrackedContact& each : scene.touching(now_ns).value_or(std::vector<TrackedContact>{})) {
    if (isSeen(each))
      line += format("  contact %llu %s %.3f N stick %s", static_cast<unsigned long long>(each.id),
                     duration(age_s(each)).c_str(), length(each.force_N), stickRatio(each).c_str());
  }
  if (const auto latency = scene.latency(now_ns)) {
    line += format("  latency %.2f ms p50 %.2f ms p99", latency->p50_ms, latency->p99_ms);
  }
  line += format("  lost %llu", static_cast<unsigned long long>(scene.lost));
  for (const Problem& one : wrong) line += one.health == Health::kDoubtful ? "  ! " + one.what : "";
  return line;
}

}  // namespace traction::client
