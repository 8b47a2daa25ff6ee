#include "lens/sheet.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace lens {

namespace {

constexpr double kMillimetres = 1e3;
constexpr double kMargin = 12e-3;  // around gel and markers, for crosses, ruler and text [m]
constexpr double kCross = 5e-3;    // half the size of a registration cross [m]
constexpr double kRuler = 50e-3;
constexpr double kNarrowest = kRuler + 2 * kMargin;

/// Returns the half size of the area of gel and markers about the origin [m].
Eigen::Vector2d halfField(const sensor::Sensor& sensor) {
  Eigen::Vector2d half = sensor.body ? Eigen::Vector2d::Zero().eval() : (0.5 * sensor.gel.size.head<2>()).eval();
  const sensor::Points markers = sensor::markerPositions(sensor);
  Eigen::Index next = 0;
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    const auto own = markers.middleCols(next, layer.count()).topRows<2>();
    half = half.cwiseMax((own.cwiseAbs().array() + 0.5 * layer.diameter).rowwise().maxCoeff().matrix());
    next += layer.count();
  }
  return half;
}

template <typename... Numbers>
std::string format(const char* pattern, Numbers... numbers) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), pattern, numbers...);
  return text.data();
}

std::string line(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return format("<line x1=\"%.6g\" y1=\"%.6g\" x2=\"%.6g\" y2=\"%.6g\"/>\n", from.x(), from.y(), to.x(), to.y());
}

std::string cross(const Eigen::Vector2d& place) {
  const double arm = kCross * kMillimetres;
  return line(place - Eigen::Vector2d(arm, 0), place + Eigen::Vector2d(arm, 0)) +
         line(place - Eigen::Vector2d(0, arm), place + Eigen::Vector2d(0, arm)) +
         format("<circle cx=\"%.6g\" cy=\"%.6g\" r=\"%.6g\"/>\n", place.x(), place.y(), 0.5 * arm);
}

}  // namespace

Eigen::Vector2d pageSize(const sensor::Sensor& sensor) {
  const Eigen::Vector2d page = 2.0 * (halfField(sensor) + Eigen::Vector2d::Constant(kMargin));
  return {std::max(page.x(), kNarrowest), page.y() + kMargin};
}

std::string sheet(const sensor::Sensor& sensor, std::size_t index, bool mirrored) {
  const sensor::MarkerLayer& layer = sensor.layers[index];
  const Eigen::Vector2d page = kMillimetres * pageSize(sensor), half = kMillimetres * halfField(sensor);
  // In SVG y points down. The lower strip holds ruler and text.
  const Eigen::Vector2d origin(0.5 * page.x(), 0.5 * (page.y() - kMillimetres * kMargin));
  const double side = mirrored ? -1.0 : 1.0;

  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  text += format("<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"%.6gmm\" height=\"%.6gmm\" "
                 "viewBox=\"0 0 %.6g %.6g\">\n",
                 page.x(), page.y(), page.x(), page.y());
  text += format("<title>Layer %zu of %zu, %s: %d x %d markers%s</title>\n", index + 1, sensor.layers.size(),
                 nameOf(layer.colour), layer.columns, layer.rows, mirrored ? ", mirrored" : "");
  text += "<g id=\"registration\" fill=\"none\" stroke=\"black\" stroke-width=\"0.1\">\n";
  const double beyond = kMillimetres * (kMargin - kCross) - 1.0;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      text += cross(origin + Eigen::Vector2d(x * (half.x() + beyond), y * (half.y() + beyond)));
    }
  }
  if (!sensor.body) {
    const Eigen::Vector2d gel = kMillimetres * sensor.gel.size.head<2>();
    text += format("<rect x=\"%.6g\" y=\"%.6g\" width=\"%.6g\" height=\"%.6g\" stroke-dasharray=\"1 1\"/>\n",
                   origin.x() - 0.5 * gel.x(), origin.y() - 0.5 * gel.y(), gel.x(), gel.y());
  }
  text += "</g>\n<g id=\"ruler\" stroke=\"black\" stroke-width=\"0.1\" font-family=\"sans-serif\" font-size=\"3\">\n";
  const double left = origin.x() - 0.5 * kMillimetres * kRuler, base = page.y() - 8.0;
  text += line({left, base}, {left + kMillimetres * kRuler, base});
  for (int mm = 0; mm <= 50; ++mm) {
    text += line({left + mm, base}, {left + mm, base - (mm % 10 == 0 ? 3.0 : mm % 5 == 0 ? 2.0 : 1.0)});
  }
  text += format("<text x=\"%.6g\" y=\"%.6g\" stroke=\"none\">50 mm; layer %zu, %s, %.6g mm deep%s</text>\n", left,
                 base + 5.0, index + 1, nameOf(layer.colour), kMillimetres * layer.depth, mirrored ? "; mirrored" : "");
  text += format("</g>\n<g id=\"markers\" fill=\"%s\">\n", layer.darker ? "black" : nameOf(layer.colour));
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < index; ++i) first += sensor.layers[i].count();
  const sensor::Points markers = kMillimetres * sensor::markerPositions(sensor);
  for (Eigen::Index i = first; i < first + layer.count(); ++i) {
    text += format("<circle cx=\"%.9g\" cy=\"%.9g\" r=\"%.9g\"/>\n", origin.x() + side * markers(0, i),
                   origin.y() - markers(1, i), 0.5 * kMillimetres * layer.diameter);
  }
  return text + "</g>\n</svg>\n";
}

}  // namespace lens
