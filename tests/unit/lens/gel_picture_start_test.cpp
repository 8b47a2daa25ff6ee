// Starts from which the pose is fitted: none at all, or several.
#include "daemon/calibrate/geometry_fit.h"
#include "lens/first_pose.h"
#include "tests/support/fingertip.h"
#include "tests/unit/lens/gel_picture_bench.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cstdio>
#include <limits>

namespace lens::gel_picture_commands_test {
namespace {

/// However far off: solvePnP is told of no start at all.
TEST_F(GelPictureCommands, SolvedPoseNeedsNoStart) {
  for (int trial = 0; trial < 20; ++trial) {
    truth.camera.position = Eigen::Vector3d(0, 0, 157e-3) + within(40e-3);
    truth.camera.rotation = within(0.2);
    photograph();
    RestMarkers markers;
    for (Eigen::Index i = 0; i < places.size(); ++i) markers.place_px.push_back(static_cast<float>(places.data()[i]));
    markers.present.assign(static_cast<std::size_t>(places.cols()), 1);
    sensor::Sensor believed = truth;
    believed.camera.position = {0, 0, 157e-3};
    believed.camera.rotation.setZero();
    const auto solved = solvePose(believed, markers);
    ASSERT_TRUE(solved);
    // What refraction off the axis does is for the refinement.
    EXPECT_LT((solved->position - truth.camera.position).norm(), 10e-3);
    EXPECT_LT((solved->rotation - truth.camera.rotation).norm(), 0.1);
    const auto refined = firstPose(believed, markers);
    ASSERT_EQ(refined.outcome, tractiond::calibrate::Geometry::Outcome::kConverged);
    EXPECT_LT(refined.residual_px, 1e-3);
  }
}

class PoseOfABody : public GelPictureCommands {
 protected:
  /// Finds the truth's pose in a picture of it, within four stated deviations and these limits.
  void expectPose(const cv::Mat& picture, const sensor::Sensor& file, double most_m, double most_rad) {
    const auto seen = findMarkers(picture, file);
    ASSERT_TRUE(seen) << seen.error().what;
    const RestMarkers markers = counted(file, *seen);
    const auto found = firstPose(file, markers);
    ASSERT_EQ(found.outcome, tractiond::calibrate::Geometry::Outcome::kConverged);
    const Eigen::Vector3d place = found.camera.position - truth.camera.position,
                          rotation = found.camera.rotation - truth.camera.rotation;
    std::printf("%d markers: residual %.3f px, place off by %.3f mm +- %.3f, rotation by %.3f deg\n", markers.count(),
                found.residual_px, 1e3 * place.norm(), 1e3 * found.uncertainty.position.norm(),
                180 / 3.14159 * rotation.norm());
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LT(std::abs(place[axis]), 4 * found.uncertainty.position[axis]);
      EXPECT_LT(std::abs(rotation[axis]), 4 * found.uncertainty.rotation[axis]);
    }
    EXPECT_LT(place.norm(), most_m);
    EXPECT_LT(rotation.norm(), most_rad);
    found_ = markers.count();
  }

  int found_ = 0;  ///< markers of the last picture
};

/// A fingertip of which a housing hides a part, with dirt that looks like markers: no rim of the grid tells where its
/// columns begin, and a turn of two degrees moves the picture by more than the markers' distance.
TEST_F(PoseOfABody, NeedsNoRimOfItsGrid) {
  const sensor::Sensor file = tractiond::test::fingertip();
  truth = file;
  for (int trial = 0; trial < 2; ++trial) {
    truth.camera = file.camera;
    truth.camera.position += within(0.6e-3);
    truth.camera.rotation = within(0.04);
    cv::Mat picture = photograph();
    const cv::Scalar background = picture.at<cv::Vec3b>(2, 2), marker(120, 40, 40);
    for (int i = 0; i < 10; ++i) {
      cv::circle(picture, cv::Point2d(between(180, 400), between(90, 390)), 3, marker, cv::FILLED, cv::LINE_AA);
    }
    const int hidden = 380 + 40 * trial;
    if (trial == 0) {
      picture.colRange(hidden, picture.cols).setTo(background);
    } else {
      picture.rowRange(hidden - 80, picture.rows).setTo(background);
    }
    expectPose(picture, file, 0.3e-3, 3e-3);
  }
}

/// Dots at random in place of a grid, as printed by hand: their places alone tell which is which.
TEST_F(PoseOfABody, IsFoundByDotsWithoutAGrid) {
  sensor::Sensor file = tractiond::test::fingertip();
  sensor::Body dots = *file.body;
  const sensor::Points flat = sensor::markerPositions(tractiond::test::flatTip().layers);
  for (Eigen::Index i = 0; i < flat.cols(); ++i) {
    const auto draw = [&] {
      const Eigen::Vector3d beside(between(-0.5e-3, 0.5e-3), between(-0.5e-3, 0.5e-3), 0.0);
      dots.markers.col(i) = tractiond::test::onTip(flat.col(i) + beside);
    };
    const auto isFree = [&] {
      return i == 0 || (dots.markers.leftCols(i).colwise() - dots.markers.col(i)).colwise().norm().minCoeff() > 0.6e-3;
    };
    draw();
    for (int attempt = 0; attempt < 200 && !isFree(); ++attempt) draw();
  }
  ASSERT_TRUE(sensor::setBody(file, std::move(dots)));
  truth = file;
  truth.camera.position += within(1.5e-3);
  truth.camera.rotation = within(0.06);
  expectPose(photograph(), file, 0.3e-3, 3e-3);
  EXPECT_GT(found_, 190);
}

/// A camera in a fingertip's hollow bone, between whose surfaces and the gel light is refracted twice.
TEST_F(PoseOfABody, IsFoundThroughACurvedWindow) {
  sensor::Sensor file = tractiond::test::fingertip(0.7e-3);
  file.camera.focal_px = 420;
  file.camera.position = {0, 0, 14e-3};
  file.camera.gelIndex = 1.41;
  file.camera.surfaces = {{{0, 0, 10e-3}, {6e-3, 6e-3, 6e-3}, 1.5}, {{0, 0, 10e-3}, {4.5e-3, 4.5e-3, 4.5e-3}, 1.0}};
  truth = file;
  truth.camera.position += within(0.4e-3);
  truth.camera.rotation = within(0.04);
  expectPose(photograph(), file, 0.1e-3, 5e-3);
}

/// Few dots of one plane behind a lens with strong barrel distortion that the file knows nothing of. Their pitch in y
/// is not quite that in x, so that the fit has several minima; the start from the file's lens does not always lead into
/// the lowest.
class FewDots : public GelPictureCommands {
 protected:
  struct View {
    sensor::Sensor file;
    RestMarkers markers;
  };

  View draw(int trial);
};

FewDots::View FewDots::draw(int trial) {
  constexpr double kPitch = 2e-3, kDepth = 1e-3;
  View view;
  sensor::Sensor& file = view.file;
  file.gel.size = {25e-3, 22e-3, 4e-3};
  file.layers.resize(1);
  sensor::MarkerLayer& layer = file.layers[0];
  layer.colour = sensor::Colour::kGrey;
  layer.columns = 10;
  layer.rows = trial % 2 == 0 ? 8 : 7;
  layer.pitch = kPitch;
  layer.depth = kDepth;
  layer.centre.setZero();
  file.uncertainty.principal_px = 20.0;
  sensor::Camera& camera = file.camera;
  camera.width = 320;
  camera.height = 240;
  camera.focal_px = between(0.7, 2.0) * camera.width;
  camera.principal_px = {159.5, 119.5};
  const double distance = camera.focal_px * kPitch / between(30, 33);
  camera.position = {0, 0, kDepth + distance};
  truth = file;
  sensor::Camera& seen = truth.camera;
  seen.aspect = between(0.98, 1.02);
  seen.principal_px += Eigen::Vector2d(between(-20, 20), between(-20, 20));
  seen.rotation = {between(-0.05, 0.05), between(-0.05, 0.05), between(-0.05, 0.05)};
  seen.position += Eigen::Vector3d(between(-1e-3, 1e-3), between(-1e-3, 1e-3), 0.0);
  const double corner2 = (0.25 * 320 * 320 + 0.25 * 240 * 240) / (seen.focal_px * seen.focal_px);
  seen.k1 = -between(0.15, 0.3) / corner2;
  view.markers = noisyMarkers(0.1);
  return view;
}

TEST_F(FewDots, OneOfSeveralStartsLeadsToTheLeastResidual) {
  using tractiond::calibrate::fitGeometryFrom, tractiond::calibrate::Geometry;
  const auto residual = [](const Geometry& fit) {
    return fit.outcome == Geometry::Outcome::kConverged ? fit.residual_px : std::numeric_limits<double>::infinity();
  };
  int others = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const auto [file, markers] = draw(trial);
    const double found = residual(firstPose(file, markers));
    const auto start = solvePose(file, markers);
    ASSERT_TRUE(start);
    const double alone = residual(fitGeometryFrom(*start, file, markers.place_px, markers.present));
    const double fromTruth = residual(fitGeometryFrom(truth.camera, file, markers.place_px, markers.present));
    EXPECT_LT(found, 1.03 * std::min(alone, fromTruth)) << trial;
    others += alone > 1.03 * found ? 1 : 0;
  }
  EXPECT_GT(others, 0) << "the first start leads there for all of these cameras: they show nothing";
}

}  // namespace
}  // namespace lens::gel_picture_commands_test
