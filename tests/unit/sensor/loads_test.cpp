#include "sensor/elastic/half_space.h"
#include "sensor/elastic/loads.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace sensor::elastic {
namespace {

const Eigen::Vector2d kCentre = {0.7e-3, 0.4e-3};

Eigen::Vector3d momentAbout(const PatchQuadrature& patch, const Eigen::Vector2d& centre) {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int i = 0; i < patch.points.cols(); ++i) {
    Eigen::Vector3d arm = patch.points.col(i);
    arm.head<2>() -= centre;
    moment += arm.cross(patch.forces.col(i));
  }
  return moment;
}

Eigen::Vector3d displacement(const PatchQuadrature& patch, const Eigen::Vector3d& point) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < patch.points.cols(); ++i)
    sum += halfSpaceDisplacement(point - patch.points.col(i), 0.18e6, 0.49) * patch.forces.col(i);
  return sum;
}

TEST(Loads, ResultantIsTheForceAtTheCentre) {
  const Eigen::Vector3d force(0.3, -0.2, 1.0);
  for (const PatchQuadrature& patch : {hertz(kCentre, 2.5e-3, force), disc(kCentre, 10e-3, force)}) {
    EXPECT_LT((patch.forces.rowwise().sum() - force).norm(), 1e-13);
    EXPECT_LT(momentAbout(patch, kCentre).norm(), 1e-16);
  }
}

TEST(Loads, TwistIsAPureTorqueFromXTowardsY) {
  const PatchQuadrature patch = twist(kCentre, 5e-3, 2e-3);
  EXPECT_LT(patch.forces.rowwise().sum().norm(), 1e-13);
  EXPECT_LT((momentAbout(patch, {-3e-3, 1e-3}) - Eigen::Vector3d(0.0, 0.0, 2e-3)).norm(), 1e-15);
  EXPECT_GT(displacement(patch, {3e-3, 0.4e-3, 6e-3}).y(), 0.0);
}

// Mean square radius: 2/5 of the radius squared under Hertz's pressure, 1/2 under a constant one.
TEST(Loads, PressuresHaveTheirSecondMoments) {
  const double radius = 4e-3;
  const auto meanSquare = [&](const PatchQuadrature& patch) {
    return ((patch.points.topRows<2>().colwise() - kCentre).colwise().squaredNorm() * patch.forces.row(2).transpose())
        .value();
  };
  EXPECT_NEAR(meanSquare(hertz(kCentre, radius, Eigen::Vector3d::UnitZ())) / (radius * radius), 0.4, 1e-12);
  EXPECT_NEAR(meanSquare(disc(kCentre, radius, Eigen::Vector3d::UnitZ())) / (radius * radius), 0.5, 1e-12);
}

TEST(Loads, DefaultRingsResolveTheFieldAtTheMarkers) {
  const Eigen::Vector3d force(0.5, 0.0, 1.0);
  for (const double radius : {1e-3, 2.5e-3, 5e-3, 10e-3, 15e-3}) {
    double error[3] = {}, peak[3] = {};
    for (double x = 0.0; x < 25e-3; x += 0.77e-3) {
      const Eigen::Vector3d point(x, 0.6 * x, 6e-3);
      const auto compare = [&](int which, const PatchQuadrature& coarse, const PatchQuadrature& fine) {
        const Eigen::Vector3d exact = displacement(fine, point);
        error[which] = std::max(error[which], (displacement(coarse, point) - exact).norm());
        peak[which] = std::max(peak[which], exact.norm());
      };
      compare(0, hertz(kCentre, radius, force), hertz(kCentre, radius, force, 20));
      compare(1, disc(kCentre, radius, force), disc(kCentre, radius, force, 20));
      compare(2, twist(kCentre, radius, 1e-3), twist(kCentre, radius, 1e-3, 20));
    }
    for (int i = 0; i < 3; ++i) EXPECT_LT(error[i], 1e-5 * peak[i]) << radius << " " << i;
  }
}

}  // namespace
}  // namespace sensor::elastic
