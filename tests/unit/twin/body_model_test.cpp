// A body in the twin: loads between the nodes of a ball, and what a camera sees of its markers.
#include "tests/support/fingertip.h"
#include "twin/body_model.h"
#include "twin/renderer.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {

using tractiond::test::fingertip;
using tractiond::test::kTipRadius;
using twin::BodyLoad;
using twin::BodyModel;
using twin::Contact;

TEST(BodyModel, ForceAndMomentOfTheNodesAreThoseOfTheLoad) {
  const BodyModel model(fingertip());
  for (const Contact::Shape shape : {Contact::Shape::kHertz, Contact::Shape::kDisc}) {
    const BodyLoad load = model.load({.shape = shape, .radius = 2e-3, .times = {}, .states = {}},
                                     {{3e-3, -2e-3}, {0.2, -0.1, 1.0}, 4e-4});
    const Eigen::Vector3d normal = (Eigen::Vector3d(0, 0, kTipRadius) - load.place) / kTipRadius;
    EXPECT_TRUE(load.isWithin);
    EXPECT_TRUE(load.place.head<2>().isApprox(Eigen::Vector2d(3e-3, -2e-3), 1e-6));
    EXPECT_LT((load.normal - normal).norm(), 2e-3);
    EXPECT_NEAR(load.force.dot(load.normal), 1.0, 1e-12);
    EXPECT_NEAR(load.force.squaredNorm(), 1.05, 1e-12);
    EXPECT_LT((load.nodeForces.rowwise().sum() - load.force).norm(), 1e-12);
    // What is pressed lies below the centre by the mean sag of the ball; the rest is the torque.
    const Eigen::Vector3d about = model.moment(load.nodeForces) - load.place.cross(load.force);
    EXPECT_NEAR(about.dot(load.normal), 4e-4, 1e-7);
    const double sag = (about - about.dot(load.normal) * load.normal).norm() / std::sqrt(0.05);
    EXPECT_NEAR(sag, shape == Contact::Shape::kHertz ? 0.2 * 0.4 * 1e-3 : 0.2 * 0.5 * 1e-3, 2e-5);
  }
}

TEST(BodyModel, MarkersMoveSmoothlyUnderALoadThatTravels) {
  const BodyModel model(fingertip());
  const auto at = [&](double x) -> sensor::Points {
    return model.displacement(
        model.load({.radius = 1e-3, .times = {}, .states = {}}, {{x, 0.7e-3}, {0.0, 0.0, 1.0}, 0.0}).nodeForces);
  };
  constexpr double kStep = 1e-5;
  sensor::Points before = at(-2e-3), way = at(-2e-3 + kStep) - before;
  double fastest = 0.0, jump = 0.0;
  for (int i = 1; i < 400; ++i) {
    const double x = -2e-3 + i * kStep;
    const sensor::Points next = at(x + kStep) - at(x);
    fastest = std::max(fastest, next.colwise().norm().maxCoeff());
    jump = std::max(jump, (next - way).colwise().norm().maxCoeff());
    way = next;
  }
  EXPECT_LT(jump, 0.03 * fastest);
}

TEST(BodyModel, ALoadBesideTheNodesIsTold) {
  const BodyModel model(fingertip());
  const auto isWithin = [&](double x, double radius) {
    return model.load({.radius = radius, .times = {}, .states = {}}, {{x, 0.0}, {0.0, 0.0, 1.0}, 0.0}).isWithin;
  };
  EXPECT_TRUE(isWithin(5e-3, 2e-3));
  EXPECT_FALSE(isWithin(7.5e-3, 2e-3));  // its rim
  EXPECT_FALSE(isWithin(12e-3, 1e-3));   // all of it
}

TEST(Renderer, MarkersOfABodyAreSeenAsTheyLie) {
  sensor::Sensor sensor = fingertip(2.2e-3);  // the outer ones are seen from the side, or from behind
  sensor.layers[0].colour = sensor::Colour::kGrey;
  twin::Optics optics;
  optics.background = optics.readNoise = 0.0;
  optics.blur_px = 0.5;
  twin::Renderer renderer(sensor, optics, twin::Format::kMono8);
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  std::vector<std::uint8_t> picture(renderer.pictureSize());
  int behind = 0;
  for (const int column : {7, 9, 11, 12, 14}) {
    const int marker = 7 * 15 + column;
    const Eigen::Vector3d place = sensor.body->markers.col(marker);
    Eigen::Matrix2Xd places = Eigen::Matrix2Xd::Constant(2, 225, std::nan(""));
    places.col(marker) = project(place);
    renderer.render(places, 0, picture);
    double sum = 0.0;
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    for (int i = 0; i < 640 * 480; ++i) {
      const double light = picture[static_cast<std::size_t>(i)];
      const Eigen::Vector2d off = Eigen::Vector2d(i % 640, i / 640) - places.col(marker);
      sum += light;
      second += light * off * off.transpose();
    }
    const Eigen::Vector3d outward = (place - Eigen::Vector3d(0, 0, kTipRadius)) / (kTipRadius - 2e-3);
    const Eigen::Vector3d ray = (place - sensor.camera.position).normalized();
    if (outward.dot(ray) <= 0.0) {
      EXPECT_EQ(sum, 0.0) << column;
      ++behind;
      continue;
    }
    const double blur = 0.25 + 1.0 / 12;
    const Eigen::Vector2d variance =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(second / sum).eigenvalues().array() - blur;
    const double radius = 0.15e-3 * sensor.camera.focal_px / (sensor.camera.position.z() - place.z());
    EXPECT_NEAR(2 * std::sqrt(variance[1]), radius, 0.03 * radius) << column;
    EXPECT_NEAR(std::sqrt(variance[0] / variance[1]), outward.dot(ray), 0.04) << column;
  }
  EXPECT_GT(behind, 0);
}

}  // namespace
