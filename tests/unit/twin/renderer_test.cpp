#include "twin/renderer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace {

using twin::Channel;
using twin::Format;
using twin::kBlue;
using twin::kGreen;
using twin::kRed;
using twin::Optics;
using twin::Renderer;

Optics quiet() {
  Optics optics;
  optics.readNoise = 0.0;
  return optics;
}

/// One blue marker behind one red one, on a small picture.
sensor::Sensor pairOfMarkers() {
  sensor::Sensor pair;
  pair.camera.width = 40;
  pair.camera.height = 30;
  for (sensor::MarkerLayer& layer : pair.layers) layer.columns = layer.rows = 1;
  return pair;
}

double radius(const sensor::Sensor& sensor, std::size_t layer) {
  const double distance = sensor.camera.position.z() - sensor.layers[layer].depth;
  return 0.5 * sensor.layers[layer].diameter * sensor.camera.focal_px / distance;  // along u
}

std::vector<std::uint8_t> draw(Renderer& renderer, const Eigen::Matrix2Xd& markers_px, std::uint32_t seed = 0) {
  std::vector<std::uint8_t> picture(renderer.pictureSize());
  renderer.render(markers_px, seed, picture);
  return picture;
}

/// The picture by brute force: the visible colour at points 1/32 px apart, then the blur of each point by the Gaussian
/// and the pixel's square.
double slowLevel(const sensor::Sensor& sensor, const Optics& optics, const Eigen::Matrix2Xd& centres, int u, int v,
                 Channel channel) {
  constexpr double kStep = 1.0 / 32;
  const double blueRadius = radius(sensor, 0), redRadius = radius(sensor, 1);
  const auto pixelKernel = [&](double t) {
    const double scale = optics.blur_px * std::sqrt(2.0);
    return 0.5 * (std::erf((t + 0.5) / scale) - std::erf((t - 0.5) / scale));
  };
  constexpr int kSteps = static_cast<int>(6 / kStep);
  std::array<double, 2 * kSteps + 1> kernel;
  for (int i = -kSteps; i <= kSteps; ++i) kernel[static_cast<std::size_t>(i + kSteps)] = kStep * pixelKernel(i * kStep);
  double sum = 0.0;
  for (int j = -kSteps; j <= kSteps; ++j) {
    for (int i = -kSteps; i <= kSteps; ++i) {
      const double x = u + i * kStep, y = v + j * kStep;
      const auto isInside = [&](Eigen::Index marker, double r) {
        const double dx = x - centres(0, marker), dy = y - centres(1, marker);
        return dx * dx + dy * dy / (sensor.camera.aspect * sensor.camera.aspect) < r * r;
      };
      const bool red = isInside(1, redRadius);
      if (!red && !isInside(0, blueRadius)) continue;
      const double weight = channel == (red ? kRed : kBlue) ? 1.0 : optics.crossTalk;
      sum += weight * kernel[static_cast<std::size_t>(i + kSteps)] * kernel[static_cast<std::size_t>(j + kSteps)];
    }
  }
  return optics.background + optics.contrast * sum;
}

TEST(Renderer, PictureIsThatOfBruteForceAlsoWhereRedHidesBlue) {
  for (const double aspect : {1.0, 1.3}) {
    sensor::Sensor pair = pairOfMarkers();
    pair.camera.aspect = aspect;
    const Optics optics = quiet();
    Renderer renderer(pair, optics, Format::kRgb8);
    Eigen::Matrix2Xd centres(2, 2);
    centres << 20.3, 22.1, 14.8, 15.9;
    const auto picture = draw(renderer, centres);
    for (int v = 8; v < 24; ++v) {
      for (int u = 13; u < 30; ++u) {
        for (const Channel channel : {kRed, kGreen, kBlue}) {
          const int drawn = picture[static_cast<std::size_t>((v * 40 + u) * 3 + channel)];
          EXPECT_NEAR(drawn, slowLevel(pair, optics, centres, u, v, channel), 0.5 + 0.25)
              << u << " " << v << " " << channel << ", aspect " << aspect;
        }
      }
    }
  }
}

TEST(Renderer, LargeMarkersAreThoseOfBruteForce) {
  for (const auto& [radius_px, elongation] : {std::tuple{70.0, 0.0}, {45.0, 1e-9}, {500.0, 0.0}}) {
    sensor::Sensor pair = pairOfMarkers();
    pair.camera.width = 200;
    pair.camera.height = 150;
    pair.camera.aspect = 1.1;
    for (std::size_t i = 0; i < 2; ++i) pair.layers[i].diameter *= radius_px / radius(pair, i);
    Optics optics = quiet();
    optics.variety.elongation = elongation;
    Renderer renderer(pair, optics, Format::kRgb8);
    Eigen::Matrix2Xd centres(2, 2);
    centres << 90.3, 90.3 - 1.5 * radius_px, 80.8, 75.9;  // the red one's centre is outside the picture
    const auto picture = draw(renderer, centres);
    for (int v = 3; v < 150; v += 12) {
      for (int u = 2; u < 200; u += 14) {
        for (const Channel channel : {kRed, kBlue}) {
          const int drawn = picture[static_cast<std::size_t>((v * 200 + u) * 3 + channel)];
          EXPECT_NEAR(drawn, slowLevel(pair, optics, centres, u, v, channel), 0.5 + 0.25)
              << u << " " << v << " " << channel << ", radius " << radius_px << " px";
        }
      }
    }
  }
}

TEST(Renderer, EveryFormatHoldsTheSamePicture) {
  const sensor::Sensor pair = pairOfMarkers();
  Optics optics = quiet();
  optics.lightSlope = {0.2, -0.1};
  Eigen::Matrix2Xd centres(2, 2);
  centres << 11.2, 30.7, 7.6, 21.4;
  Renderer rgb(pair, optics, Format::kRgb8), bgr(pair, optics, Format::kBgr8);
  const auto expected = draw(rgb, centres), swapped = draw(bgr, centres);
  for (std::size_t i = 0; i < expected.size(); i += 3) {
    ASSERT_EQ(swapped[i], expected[i + 2]);
    ASSERT_EQ(swapped[i + 1], expected[i + 1]);
    ASSERT_EQ(swapped[i + 2], expected[i]);
  }
  const std::pair<Format, std::array<Channel, 4>> mosaics[] = {{Format::kBayerRG8, {kRed, kGreen, kGreen, kBlue}},
                                                               {Format::kBayerGR8, {kGreen, kRed, kBlue, kGreen}},
                                                               {Format::kBayerGB8, {kGreen, kBlue, kRed, kGreen}},
                                                               {Format::kBayerBG8, {kBlue, kGreen, kGreen, kRed}}};
  for (const auto& [format, channels] : mosaics) {
    Renderer bayer(pair, optics, format);
    const auto picture = draw(bayer, centres);
    for (std::size_t v = 0; v < 30; ++v) {
      for (std::size_t u = 0; u < 40; ++u) {
        ASSERT_EQ(picture[v * 40 + u], expected[(v * 40 + u) * 3 + channels[v % 2 * 2 + u % 2]]);
      }
    }
  }
}

TEST(Renderer, ReadNoiseHasTheDeviationAskedForAndIsIndependent) {
  sensor::Sensor sensor;
  sensor.layers.clear();
  Optics optics;
  optics.readNoise = 3.0;
  Renderer renderer(sensor, optics, Format::kRgb8);
  const auto first = draw(renderer, Eigen::Matrix2Xd(2, 0), 1), again = draw(renderer, Eigen::Matrix2Xd(2, 0), 1);
  EXPECT_EQ(first, again);
  const auto second = draw(renderer, Eigen::Matrix2Xd(2, 0), 2);
  double sum = 0, squares = 0, neighbours = 0, below = 0, frames = 0;
  const std::size_t row = 640 * 3, count = first.size() - row;
  for (std::size_t i = 0; i < count; ++i) {
    const double here = first[i] - 20.0;
    sum += here;
    squares += here * here;
    neighbours += here * (first[i + 1] - 20.0);
    below += here * (first[i + row] - 20.0);
    frames += here * (second[i] - 20.0);
  }
  const auto n = static_cast<double>(count);
  EXPECT_NEAR(sum / n, 0.0, 0.05);
  EXPECT_NEAR(squares / n, 9.0 + 1.0 / 12.0, 0.15);
  EXPECT_NEAR(neighbours / squares, 0.0, 0.01);
  EXPECT_NEAR(below / squares, 0.0, 0.01);
  EXPECT_NEAR(frames / squares, 0.0, 0.01);
}

TEST(Renderer, ShotNoiseGrowsWithTheLight) {
  sensor::Sensor sensor;
  sensor.layers.clear();
  Optics optics;
  optics.readNoise = 1.0;
  optics.shotNoise = 0.1;
  for (const double background : {20.0, 80.0, 160.0}) {
    optics.background = background;
    Renderer renderer(sensor, optics, Format::kBayerRG8);
    const auto picture = draw(renderer, Eigen::Matrix2Xd(2, 0));
    double squares = 0;
    for (const std::uint8_t level : picture) squares += (level - background) * (level - background);
    EXPECT_NEAR(squares / static_cast<double>(picture.size()), 1.0 + 0.1 * background + 1.0 / 12.0,
                0.03 * (1.0 + 0.1 * background));
  }
}

}  // namespace
