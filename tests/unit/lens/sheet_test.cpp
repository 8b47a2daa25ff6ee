#include "lens/sheet.h"
#include "tests/support/seed.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <random>
#include <regex>
#include <string>
#include <vector>

namespace lens::sheet_test {
namespace {

struct Circle {
  double u, v, r;  ///< mm on the page
};

/// What a reader of the file sees of its markers.
std::vector<Circle> markersOf(const std::string& svg) {
  std::vector<Circle> circles;
  const std::string group = svg.substr(svg.find("<g id=\"markers\""));
  const std::regex circle("<circle cx=\"([^\"]+)\" cy=\"([^\"]+)\" r=\"([^\"]+)\"/>");
  for (std::sregex_iterator i(group.begin(), group.end(), circle), end; i != end; ++i) {
    circles.push_back({std::stod((*i)[1]), std::stod((*i)[2]), std::stod((*i)[3])});
  }
  return circles;
}

std::string attribute(const std::string& svg, const std::string& name) {
  std::smatch found;
  return std::regex_search(svg, found, std::regex(" " + name + "=\"([^\"]+)\"")) ? found[1].str() : "";
}

sensor::Sensor randomSensor(std::mt19937& generator) {
  const auto between = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(generator);
  };
  const auto count = [&] { return std::uniform_int_distribution<int>(1, 30)(generator); };
  sensor::Sensor sensor;
  sensor.gel.size = {between(10e-3, 120e-3), between(10e-3, 120e-3), between(5e-3, 40e-3)};
  sensor.layers.resize(std::uniform_int_distribution<std::size_t>(1, 3)(generator));
  for (sensor::MarkerLayer& layer : sensor.layers) {
    layer.columns = count();
    layer.rows = count();
    layer.pitch = between(0.5e-3, 4e-3);
    layer.diameter = between(0.1, 0.6) * layer.pitch;
    layer.centre = {between(-5e-3, 5e-3), between(-5e-3, 5e-3)};
    layer.colour = generator() % 2 == 0 ? sensor::Colour::kRed : sensor::Colour::kBlue;
  }
  return sensor;
}

TEST(Sheet, CirclesAreTheMarkers) {
  std::mt19937 generator(tractiond::test::seed());
  for (int trial = 0; trial < 50; ++trial) {
    const sensor::Sensor sensor = randomSensor(generator);
    const bool mirrored = trial % 2 == 1;
    std::string registration;
    for (std::size_t i = 0; i < sensor.layers.size(); ++i) {
      const std::string svg = sheet(sensor, i, {mirrored});
      // Millimetres: the page and its coordinates are the same.
      const double width = std::stod(attribute(svg, "width")), height = std::stod(attribute(svg, "height"));
      EXPECT_TRUE(attribute(svg, "width").ends_with("mm"));
      double box[4];
      ASSERT_EQ(std::sscanf(attribute(svg, "viewBox").c_str(), "%lf %lf %lf %lf", box, box + 1, box + 2, box + 3), 4);
      EXPECT_EQ(box[2], width);
      EXPECT_EQ(box[3], height);
      const sensor::Points truth = sensor::markerPositions(std::vector{sensor.layers[i]});
      const std::vector<Circle> circles = markersOf(svg);
      ASSERT_EQ(circles.size(), static_cast<std::size_t>(sensor.layers[i].count()));
      // The origin lies where all layers have it: here the gel's outline says where that is, or the middle.
      const std::string outline = svg.substr(svg.find("<rect"));
      const double u0 = std::stod(attribute(outline, "x")) + 0.5 * std::stod(attribute(outline, "width"));
      const double v0 = std::stod(attribute(outline, "y")) + 0.5 * std::stod(attribute(outline, "height"));
      for (std::size_t k = 0; k < circles.size(); ++k) {
        const Eigen::Vector3d at = 1e3 * truth.col(static_cast<Eigen::Index>(k));
        ASSERT_NEAR(circles[k].u - u0, mirrored ? -at.x() : at.x(), 1e-3);
        ASSERT_NEAR(v0 - circles[k].v, at.y(), 1e-3);
        ASSERT_NEAR(circles[k].r, 500 * sensor.layers[i].diameter, 1e-6);
        ASSERT_GT(circles[k].u - circles[k].r, 0.0);
        ASSERT_LT(circles[k].u + circles[k].r, width);
        ASSERT_GT(circles[k].v - circles[k].r, 0.0);
        ASSERT_LT(circles[k].v + circles[k].r, height - 12.0);  // above the ruler
      }
      const std::size_t begin = svg.find("<g id=\"registration\"");
      const std::string crosses = svg.substr(begin, svg.find("</g>", begin) - begin);
      if (i > 0) {
        EXPECT_EQ(crosses, registration);  // the layers' sheets lie upon each other
      }
      registration = crosses;
    }
  }
}

TEST(Sheet, RulerIsFiftyMillimetres) {
  const std::string svg = sheet({}, 0);
  const std::string ruler = svg.substr(svg.find("<g id=\"ruler\""));
  EXPECT_NEAR(std::stod(attribute(ruler, "x2")) - std::stod(attribute(ruler, "x1")), 50.0, 1e-9);
}

}  // namespace
}  // namespace lens::sheet_test
