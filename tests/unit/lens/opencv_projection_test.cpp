// The daemon's projection beside OpenCV's: the same numbers in a gel file and in a camera matrix.
#include "sensor/projection.h"
#include "tests/support/seed.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include <cmath>
#include <random>

namespace lens::opencv_projection_test {
namespace {

constexpr double kThickness = 40e-3;

TEST(Projection, IsThatOfOpenCv) {
  std::mt19937 generator(tractiond::test::seed());
  const auto between = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(generator);
  };
  const auto within = [&](double most) -> Eigen::Vector3d {
    return {between(-most, most), between(-most, most), between(-most, most)};
  };
  for (int trial = 0; trial < 50; ++trial) {
    sensor::Camera camera;
    camera.focal_px = between(500, 2000);
    camera.aspect = trial == 0 ? 1.0 : between(0.5, 2.0);
    camera.principal_px = {between(200, 400), between(150, 300)};
    camera.k1 = between(-0.3, 0.3);
    camera.k2 = between(-0.3, 0.3);
    camera.position = Eigen::Vector3d(0, 0, 0.16) + within(10e-3);
    camera.rotation = within(0.3);
    // seen = turn (point - position)
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(camera.rotation.norm(), camera.rotation.normalized()).toRotationMatrix() *
        Eigen::Vector3d(1, -1, -1).asDiagonal();
    const Eigen::Vector3d shift = -turn * camera.position;
    cv::Mat turnOfCv, rotation, translation, jacobian;
    cv::eigen2cv(turn, turnOfCv);
    cv::Rodrigues(turnOfCv, rotation);
    cv::eigen2cv(shift, translation);
    const cv::Mat matrix = (cv::Mat_<double>(3, 3) << camera.focal_px, 0, camera.principal_px.x(), 0,
                            camera.aspect * camera.focal_px, camera.principal_px.y(), 0, 0, 1);
    const cv::Mat distortion = (cv::Mat_<double>(4, 1) << camera.k1, camera.k2, 0, 0);
    const Eigen::Vector3d point(between(-30e-3, 30e-3), between(-30e-3, 30e-3), between(0, 30e-3));
    std::vector<cv::Point2d> seen;
    cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, rotation, translation, matrix,
                      distortion, seen, jacobian);
    const sensor::Projection project(camera, kThickness);
    const Eigen::Vector2d place = project(point);
    EXPECT_NEAR(place.x(), seen[0].x, 1e-8) << trial;
    EXPECT_NEAR(place.y(), seen[0].y, 1e-8) << trial;
    // OpenCV differentiates by the translation, which a turned step of the point is.
    Eigen::Matrix<double, 2, 3> byTranslation;
    for (int row = 0; row < 2; ++row) {
      for (int k = 0; k < 3; ++k) byTranslation(row, k) = jacobian.at<double>(row, 3 + k);
    }
    EXPECT_LT((project.jacobian(point) - byTranslation * turn).norm(), 1e-9 * byTranslation.norm()) << trial;
  }
}

/// Fields of view of 100 to 160 degrees.
TEST(Projection, IsThatOfOpenCvsFisheye) {
  std::mt19937 generator(tractiond::test::seed());
  const auto between = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(generator);
  };
  for (int trial = 0; trial < 200; ++trial) {
    sensor::Camera camera;
    camera.fisheye = true;
    camera.focal_px = between(150, 400);
    camera.aspect = between(0.5, 2.0);
    camera.k1 = between(-0.05, 0.1);
    camera.k2 = between(-0.02, 0.02);
    camera.k3 = between(-0.01, 0.01);
    camera.k4 = between(-0.002, 0.002);
    camera.position = {0, 0, 0.06};
    const double theta = between(0.0, 80.0) * M_PI / 180.0, around = between(-M_PI, M_PI);
    const Eigen::Vector3d seen =
        0.055 * Eigen::Vector3d(std::tan(theta) * std::cos(around), std::tan(theta) * std::sin(around), 1.0);
    const cv::Mat matrix = (cv::Mat_<double>(3, 3) << camera.focal_px, 0, camera.principal_px.x(), 0,
                            camera.aspect * camera.focal_px, camera.principal_px.y(), 0, 0, 1);
    const std::vector<double> distortion = {camera.k1, camera.k2, camera.k3, camera.k4};
    const cv::Vec3d none(0, 0, 0);
    std::vector<cv::Point2d> places;
    cv::Mat jacobian;
    cv::fisheye::projectPoints(std::vector<cv::Point3d>{{seen.x(), seen.y(), seen.z()}}, places, none, none, matrix,
                               distortion, 0.0, jacobian);
    const Eigen::Vector3d point = camera.position + Eigen::Vector3d(seen.x(), -seen.y(), -seen.z());
    const sensor::Projection project(camera, kThickness);
    EXPECT_LT((project(point) - Eigen::Vector2d(places[0].x, places[0].y)).norm(), 1e-8) << trial;
    Eigen::Matrix<double, 2, 3> byTranslation;  // after fx, fy, cx, cy, k1 ... k4 and the rotation
    for (int row = 0; row < 2; ++row) {
      for (int k = 0; k < 3; ++k) byTranslation(row, k) = jacobian.at<double>(row, 11 + k);
    }
    const Eigen::Matrix3d turn = Eigen::Vector3d(1, -1, -1).asDiagonal();
    EXPECT_LT((project.jacobian(point) - byTranslation * turn).norm(), 1e-8 * byTranslation.norm()) << trial;
  }
}

}  // namespace
}  // namespace lens::opencv_projection_test
