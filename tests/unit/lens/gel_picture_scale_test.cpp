// A gel of one's own, whose file says little that is right of the camera's pose; and gel files of another gel.
#include "lens/picture_file.h"
#include "tests/unit/lens/gel_picture_bench.h"

namespace lens::gel_picture_commands_test {
namespace {

/// 20 x 20 black dots in one layer behind a monochrome camera of 1280 x 1024 px.
class OwnGel : public GelPictureCommands {
 protected:
  OwnGel() {
    truth = {};
    truth.gel.size = {100e-3, 100e-3, 15e-3};
    truth.layers.resize(1);
    sensor::MarkerLayer& layer = truth.layers[0];
    layer.colour = sensor::Colour::kGrey;
    layer.darker = true;
    layer.columns = layer.rows = 20;
    layer.pitch = 2.5e-3;
    layer.diameter = 1e-3;
    layer.depth = 5e-3;
    layer.centre.setZero();
    sensor::Camera& camera = truth.camera;
    camera.width = 1280;
    camera.height = 1024;
    camera.focal_px = 1600.0;
    camera.principal_px = {645.0, 508.0};
    camera.k1 = -0.08;
    camera.position = {1.5e-3, -2e-3, 104e-3};
    camera.rotation = {0.02, -0.015, 0.03};
    truth.uncertainty.focal = 5e-4;
    truth.uncertainty.principal_px = 0.5;
    truth.uncertainty.k1 = 2e-3;
    truth.uncertainty.k2 = 2e-2;
  }
};

TEST_F(OwnGel, PoseIsFoundAtWhateverDistanceTheFileHasTheCamera) {
  ASSERT_TRUE(writePicture(options.picture, photographGrey()));
  for (const double distance : {30e-3, 80e-3, 400e-3}) {
    sensor::Sensor file = truth;
    file.camera.position = {0.0, 0.0, distance};
    file.camera.rotation.setZero();
    write(options.gel, sensor::gelText(file));
    expectPosed(1e-3);
  }
}

TEST_F(OwnGel, PoseIsFoundForACameraThatIsTurnedAndBeside) {
  truth.camera.rotation = {0.02, -0.015, 0.5};
  ASSERT_TRUE(writePicture(options.picture, photographGrey()));
  sensor::Sensor file = truth;
  file.camera.position = {30e-3, -20e-3, 200e-3};
  file.camera.rotation = {0.2, 0.1, -0.1};
  write(options.gel, sensor::gelText(file));
  expectPosed(1e-3);
}

TEST_F(OwnGel, OtherColumnsAndRowsAreRefusedUnlessForced) {
  ASSERT_TRUE(writePicture(options.picture, photographGrey()));
  for (const auto& [columns, rows] : {std::pair(19, 20), std::pair(20, 21)}) {
    sensor::Sensor file = truth;
    file.layers[0].columns = columns;
    file.layers[0].rows = rows;
    file.camera.position.z() = 157e-3;
    write(options.gel, sensor::gelText(file));
    options.force = false;
    const Done done = pose(options, report);
    ASSERT_FALSE(done) << columns << " x " << rows;
    const std::string has = "the file has " + std::to_string(columns) + " x " + std::to_string(rows) + " grey markers";
    EXPECT_NE(done.error()[0].what.find(has), std::string::npos) << done.error()[0].message();
    EXPECT_NE(done.error()[0].what.find("the picture shows 20 x 20"), std::string::npos) << done.error()[0].message();
    EXPECT_FALSE(std::filesystem::exists(options.output));
  }
  options.force = true;
  const Done done = pose(options, report);
  EXPECT_NE(report.text().find("warning: the picture shows another gel"), std::string::npos);
  EXPECT_TRUE(done) << done.error()[0].message();
}

/// The distance between two layers is seen; that from the camera is not, but its change is told.
TEST_F(GelPictureCommands, AnotherDepthOfOneLayerIsRefused) {
  ASSERT_TRUE(writePicture(options.picture, photograph()));
  sensor::Sensor file = truth;
  file.layers[1].depth += 1.5e-3;
  write(options.gel, sensor::gelText(file));
  const Done done = pose(options, report);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error()[0].what.find("check depth_mm"), std::string::npos) << done.error()[0].message();
}

TEST_F(OwnGel, APitchThatMovesTheCameraIsToBeMeasured) {
  ASSERT_TRUE(writePicture(options.picture, photographGrey()));
  sensor::Sensor file = truth;
  file.layers[0].pitch *= 1.1;
  write(options.gel, sensor::gelText(file));
  const Done done = pose(options, report);
  const std::string printed = report.text();
  ASSERT_TRUE(done) << done.error()[0].message();
  EXPECT_NE(printed.find("note: the camera is 10 mm farther than in the gel file"), std::string::npos) << printed;
}

/// What was edited in a gel file is not lost, by whatever command.
TEST_F(OwnGel, AnExistingGelFileIsReplacedOnlyIfForced) {
  ASSERT_TRUE(writePicture(options.picture, photographGrey()));
  write(options.gel, sensor::gelText(truth));
  write(options.output, "# by hand\n");
  const Done done = pose(options, report);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error()[0].exitCode, EX_CANTCREAT);
  EXPECT_NE(done.error()[0].remedy.find("--force"), std::string::npos);
  EXPECT_EQ(content(options.output), "# by hand\n");
  EXPECT_EQ(calibrate({.pictures = {}, .board = {}, .gel = {}, .output = options.output}, report).error()[0].exitCode,
            EX_CANTCREAT);
  options.force = true;
  EXPECT_TRUE(pose(options, report));
  EXPECT_TRUE(sensor::loadGel(options.output));
}

TEST_F(OwnGel, ADarkPictureIsCalledDark) {
  write(options.gel, sensor::gelText(truth));
  ASSERT_TRUE(writePicture(options.picture, cv::Mat(1024, 1280, CV_8UC1, cv::Scalar(12))));
  const Done done = pose(options, report);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error()[0].what.find("the picture is dark"), std::string::npos) << done.error()[0].message();
}

}  // namespace
}  // namespace lens::gel_picture_commands_test
