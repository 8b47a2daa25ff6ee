// Pictures that are turned, mirrored, or have red and blue exchanged: what the pose says, and that what it says mends
// it.
#include "lens/picture_file.h"
#include "tests/unit/lens/gel_picture_bench.h"

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace lens::gel_picture_commands_test {
namespace {

struct Change {
  const char *done, *name;
  std::array<double, 4> matrix;  ///< of the picture about its middle, u and v, row by row
};

constexpr std::array<Change, 8> kChanges = {
    {{"nothing", "", {1, 0, 0, 1}},
     {"turned by 90° clockwise", "turned by 90° clockwise", {0, -1, 1, 0}},
     {"turned by 180°", "turned by 180°", {-1, 0, 0, -1}},
     {"turned by 90° anticlockwise", "turned by 90° anticlockwise", {0, 1, -1, 0}},
     {"mirrored left to right", "mirrored left to right", {-1, 0, 0, 1}},
     {"mirrored top to bottom", "mirrored top to bottom", {1, 0, 0, -1}},
     {"transposed", "mirrored about a diagonal", {0, 1, 1, 0}},
     {"transposed the other way", "mirrored about a diagonal", {0, -1, -1, 0}}}};

class GelPictureLook : public GelPictureCommands {
 protected:
  GelPictureLook() {
    truth.camera.width = truth.camera.height = 600;
    truth.camera.principal_px = {299.5, 299.5};
    truth.camera.position += within(2e-3);
    truth.camera.rotation = within(0.01);
    file = truth;
    file.camera.position = {0, 0, 157e-3};
    file.camera.rotation.setZero();
  }

  /// Returns where the changed picture has what the camera sees at `place`.
  Eigen::Vector2d changed(const Eigen::Vector2d& place, const Change& change) const {
    const Eigen::Map<const Eigen::Matrix<double, 2, 2, Eigen::RowMajor>> matrix(change.matrix.data());
    return matrix * (place - truth.camera.principal_px) + truth.camera.principal_px;
  }

  cv::Mat changed(const cv::Mat& picture, const Change& change) const {
    cv::Mat result(picture.size(), picture.type());
    for (int v = 0; v < picture.rows; ++v) {
      for (int u = 0; u < picture.cols; ++u) {
        const Eigen::Vector2d to = changed(Eigen::Vector2d(u, v), change);
        result.at<cv::Vec3b>(static_cast<int>(std::lround(to.y())), static_cast<int>(std::lround(to.x()))) =
            picture.at<cv::Vec3b>(v, u);
      }
    }
    return result;
  }

  /// Has the pose found; on success expects that its camera sees displacements of the gel as the picture has them.
  /// \param seen pixels of the picture, from those of the true camera
  template <typename Seen>
  void expectTrue(const Seen& seen) {
    options.force = true;
    report = {};
    const Done done = pose(options, report);
    ASSERT_TRUE(done) << done.error()[0].message();
    const auto found = sensor::loadGel(options.output);
    ASSERT_TRUE(found) << found.error().what;
    const sensor::Projection project(found->camera, found->gel.size.z()), truly(truth.camera, truth.gel.size.z());
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d from = Eigen::Vector3d(0, 0, 7e-3) + within(30e-3).cwiseProduct(Eigen::Vector3d(1, 1, 0));
      const Eigen::Vector3d to = from + within(1e-3);
      EXPECT_LT((project(to) - project(from) - (seen(truly(to)) - seen(truly(from)))).norm(), 0.02);
    }
  }

  void writeFile() { write(options.gel, sensor::gelText(file)); }

  sensor::Sensor file;
};

/// A regular gel looks turned where it is mirrored, so both are named; one whose layers are shifted by two lengths does
/// not.
TEST_F(GelPictureLook, IsNamedAndWhatIsSaidMendsIt) {
  for (const double shift : {1.5e-3, 0.9e-3}) {
    truth.layers[1].centre.y() = file.layers[1].centre.y() = shift;
    const bool isRegular = shift == 1.5e-3;
    const cv::Mat picture = photograph();
    for (const Change& change : kChanges) {
      SCOPED_TRACE(std::string(change.done) + (isRegular ? ", regular" : ""));
      ASSERT_TRUE(writePicture(options.picture, changed(picture, change)));
      writeFile();
      const auto asSeen = [&](const Eigen::Vector2d& place) { return changed(place, change); };
      const bool isStraight = *change.name == 0;
      options.force = true;
      report = {};
      const Done done = pose(options, report);
      const std::string printed = report.text();
      std::printf("  picture %s%s: %s; right: %s\n", change.done, isRegular ? " of a regular gel" : "",
                  done ? "a pose" : done.error()[0].message().c_str(), isStraight ? "a pose" : change.name);
      if (isStraight || (isRegular && change.matrix[1] == -1 && change.matrix[2] == -1)) {
        // One of them is wrong, and no picture tells.
        ASSERT_TRUE(done) << done.error()[0].message();
        EXPECT_EQ(printed.find("press near its corners") != std::string::npos, isRegular) << printed;
        continue;
      }
      ASSERT_FALSE(done);
      const std::string said = done.error()[0].message();
      EXPECT_NE(said.find(change.name), std::string::npos) << said;
      EXPECT_EQ(said.find("centre_mm"), std::string::npos) << said;
      EXPECT_EQ(said.find("--force"), std::string::npos) << said;
      EXPECT_EQ(said.find(" or mirrored") != std::string::npos, isRegular) << said;
      const bool isMirrored = std::string(change.name).starts_with("mirrored");
      if (isMirrored) {
        const bool isDown = said.find("change ReverseY") != std::string::npos;
        EXPECT_NE(isDown, said.find("change ReverseX") != std::string::npos) << said;
        const Change& reverse = kChanges[isDown ? 5 : 4];
        ASSERT_TRUE(writePicture(options.picture, changed(changed(picture, change), reverse)));
        if (std::string(change.name) != "mirrored about a diagonal") {
          expectTrue([](const Eigen::Vector2d& place) { return place; });
        }
        continue;
      }
      const std::size_t at = said.find("rotation_rad = [");
      ASSERT_NE(at, std::string::npos) << said;
      sensor::Sensor turned = file;
      Eigen::Vector3d& by = turned.camera.rotation;
      ASSERT_EQ(std::sscanf(said.c_str() + at, "rotation_rad = [%lf, %lf, %lf]", &by[0], &by[1], &by[2]), 3) << said;
      write(options.gel, sensor::gelText(turned));
      expectTrue(asSeen);
    }
  }
}

TEST_F(GelPictureLook, ExchangedColoursAreNamed) {
  cv::Mat picture = photograph();
  cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
  ASSERT_TRUE(writePicture(options.picture, picture));
  writeFile();
  const Done done = pose(options, report);
  ASSERT_FALSE(done);
  const std::string said = done.error()[0].message();
  std::printf("  picture with red and blue exchanged: %s; right: exchange colour\n", said.c_str());
  EXPECT_NE(said.find("exchange colour of the two [[layers]]"), std::string::npos) << said;
  EXPECT_EQ(said.find("centre_mm"), std::string::npos) << said;
  std::swap(file.layers[0].colour, file.layers[1].colour);
  writeFile();
  expectTrue([](const Eigen::Vector2d& place) { return place; });
}

}  // namespace
}  // namespace lens::gel_picture_commands_test
