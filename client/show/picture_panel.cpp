// Writes the numbers beside the field: the force, and the link from the camera to here.

#include "client/show/picture_parts.h"
#include "client/show/reflection.h"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace traction::client {

namespace {

constexpr double kSmallestForce_N = 0.1;  ///< smaller resultants are shown without direction

/// Draws the tangential part of the resultant as an arrow in a circle, whose radius stands for the length of the
/// resultant.
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

/// Draws the magnitudes of the resultant over time. Returns the force at the upper edge [N].
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

/// Writes numbers below each other, most important first, and omits what does not fit.
struct Panel {
  Canvas& canvas;
  int column, row, width, bottom;

  int left() const { return bottom - row; }
  void skip() { ++row; }

  void heading(const std::string& text, const Style& style = kAccent) {
    if (left() > 0) canvas.text(column, row++, text, style);
  }
  /// Writes "name   number unit".
  void line(const char* name, const std::string& number, const std::string& unit, const Style& style = kPlain) {
    if (left() <= 0) return;
    constexpr int kNumberEnd = 17;
    canvas.text(column, row, name, kDim);
    const int start = column + std::max(9, kNumberEnd - static_cast<int>(number.size()));
    canvas.text(canvas.text(start, row, number, style) + 1, row, unit, kDim);
    ++row;
  }

  /// Draws shear and history side by side, with captions above: 6 rows.
  void pictures(const Vector3& resultant_N, const std::deque<double>& history) {
    constexpr int kHistory = 13;
    canvas.text(column, row, "shear", kDim);
    drawDial(canvas, column, row + 1, resultant_N);
    const double full_N =
        drawHistory(canvas, history, column + kHistory, row + 1, std::clamp(width - kHistory - 1, 0, 40), 5);
    canvas.text(column + kHistory, row, format("total, up to %g N", full_N), kDim);
    row += 6;
  }
};

/// Rows of the figures of the link, and of the pictures.
constexpr int kNumbers = 6, kPictures = 6;

/// Writes the contacts of traction-touch, by increasing id, as many as leave room for the figures of the link.
void drawContacts(Panel& panel, const std::vector<TrackedContact>& contacts) {
  const auto room = static_cast<std::size_t>(std::max(0, panel.left() - kNumbers - 1));
  if (contacts.empty() || room == 0) return panel.line("contacts", format("%zu", contacts.size()), "");
  panel.heading("contact  force N    stick     age", kDim);
  for (std::size_t i = 0; i < std::min(contacts.size(), room); ++i) {
    const TrackedContact& each = contacts[i];
    const bool slips = each.slip && each.slip->state >= SlipState::kIncipient;
    const std::string force = isSeen(each) ? format("%.3f", length(each.force_N)) : "-";
    const std::string stick = isSeen(each) ? stickRatio(each) : "absent";
    panel.heading(format("%7llu %8s  %7s %7s", static_cast<unsigned long long>(each.id), force.c_str(), stick.c_str(),
                         duration(age_s(each)).c_str()),
                  slips          ? kWarning
                  : isSeen(each) ? kPlain
                                 : kDim);
  }
}

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
  const auto note = [&](std::size_t axis, const char* direction) {
    const double deviation = deviationsOf(field.resultantCovariance_N2).at(axis);
    return isKnown && deviation > 0.0 ? spread(deviation, 3) + format(" N  %s", direction) : format("N  %s", direction);
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

  if (const auto contacts = scene.touching(now_ns)) {
    drawContacts(panel, *contacts);
  } else if (isKnown && field.method != Method::kNone) {
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

}  // namespace

void drawPanel(Canvas& canvas, const Rectangle& place, const Scene& scene, std::int64_t now_ns,
               const std::string& untold) {
  Panel panel{canvas, place.column, place.row, place.width, place.row + place.height};
  drawForce(panel, scene, now_ns, untold);
  drawLink(panel, scene, now_ns);
}

}  // namespace traction::client
