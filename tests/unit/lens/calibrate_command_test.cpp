#include "client/show/png_file.h"
#include "lens/commands.h"
#include "lens/picture_file.h"
#include "sensor/gel_file.h"
#include "tests/support/seed.h"
#include "tests/unit/lens/random_views.h"
#include "tests/unit/lens/workplace.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cstdio>
#include <vector>

namespace lens::calibrate_command_test {
namespace {

constexpr Board kBoard{9, 6, 10e-3};

/// A random lens and six good pictures through it, drawn once for all tests.
struct Pictures {
  Pictures() {
    while (views.size() < 6) {  // a small board in dim focus is none
      const cv::Mat picture =
          photograph(truth, kBoard, draw.pose(truth, kBoard, kTilted[0], kTilted[1]), draw.shot(), draw.generator);
      if (findCorners(picture, kBoard)) views.push_back(picture);
    }
  }
  static const Pictures& drawn() {
    static const Pictures pictures;
    return pictures;
  }

  Draw draw{tractiond::test::seed()};
  TrueCamera truth = draw.camera();
  std::vector<cv::Mat> views;
};

/// The same in files; each test spoils something.
class CalibrateCommand : public Workplace {
 protected:
  CalibrateCommand() {
    options.board = kBoard;
    options.output = path("out.toml");
    for (const cv::Mat& view : Pictures::drawn().views) add(view);
  }
  cv::Mat photograph(double least, double most, const Board& board = kBoard) {
    return lens::photograph(truth, board, draw.pose(truth, board, least, most), draw.shot(), draw.generator);
  }
  void add(const cv::Mat& picture) {
    options.pictures.push_back(path("view" + std::to_string(options.pictures.size()) + ".png"));
    ASSERT_TRUE(writePicture(options.pictures.back(), picture));
  }

  /// Replaces all pictures by six through the lens as it is now.
  void takeAgain() {
    options.pictures.clear();
    while (options.pictures.size() < 6) {
      const cv::Mat picture = photograph(kTilted[0], kTilted[1], options.board);
      if (findCorners(picture, options.board)) add(picture);
    }
  }

  /// Width of the smallest square that is seen [px].
  double squareIn(const cv::Mat& picture) const {
    const auto corners = findCorners(picture, options.board);
    EXPECT_TRUE(corners) << corners.error();
    return corners ? corners->smallestSquare_px : 0.0;
  }

  /// Replaces one, at random.
  std::string spoil(const cv::Mat& picture) {
    const std::string& file = options.pictures[draw.generator() % options.pictures.size()];
    EXPECT_TRUE(writePicture(file, picture));
    return file;
  }

  /// Refused with this one fault, and nothing written.
  void expectRefused(const std::string& where, const std::string& what, int code = EX_DATAERR) {
    const Done done = calibrate(options, report);
    ASSERT_FALSE(done);
    ASSERT_EQ(done.error().size(), 1U) << done.error()[0].message() << " and " << done.error().back().message();
    EXPECT_EQ(done.error()[0].where, where);
    EXPECT_NE(done.error()[0].what.find(what), std::string::npos) << done.error()[0].message();
    EXPECT_EQ(done.error()[0].exitCode, code);
    EXPECT_FALSE(std::filesystem::exists(options.output));
  }

  Draw draw = Pictures::drawn().draw;
  TrueCamera truth = Pictures::drawn().truth;
  CalibrateOptions options;
};

/// The viewer's page draws it around the pictures that were taken.
TEST_F(CalibrateCommand, OneBoardIsToldWithItsOutline) {
  const Done done = findBoard(options.pictures[0], kBoard, report);
  const std::string told = report.text();
  ASSERT_TRUE(done);
  const auto corners = findCorners(Pictures::drawn().views[0], kBoard);
  ASSERT_TRUE(corners);
  const auto number = [&told](const std::string& name) {
    double value = 0.0;
    const std::size_t at = told.find("  " + name + " ");
    EXPECT_NE(at, std::string::npos) << name;
    if (at != std::string::npos) std::sscanf(told.c_str() + at + 2 + name.size(), "%lf", &value);
    return value;
  };
  const int outline[] = {0, 7, 39, 32};  // of 8 x 5 corners, around the board
  for (int i = 0; i < 4; ++i) {
    const std::string name = "corner" + std::to_string(i + 1);
    EXPECT_NEAR(number(name + "_u_px"), corners->place_px(0, outline[i]), 1e-3);
    EXPECT_NEAR(number(name + "_v_px"), corners->place_px(1, outline[i]), 1e-3);
  }
  EXPECT_NEAR(number("edge_px"), corners->edgeWidth_px, 1e-3);

  const std::string empty = spoil(cv::Mat(480, 640, CV_8UC1, cv::Scalar(90)));
  const Done none = findBoard(empty, kBoard, report);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error()[0].exitCode, EX_DATAERR);
  EXPECT_EQ(none.error()[0].where, empty);
}

TEST_F(CalibrateCommand, PicturesOfTwoCamerasAreToldApart) {
  const auto take = [](const std::string& file, const cv::Mat& view, const std::string& with) {
    traction::client::writePng(file, static_cast<std::uint32_t>(view.cols), static_cast<std::uint32_t>(view.rows), 1,
                               view.data, with);
  };
  const std::vector<cv::Mat>& views = Pictures::drawn().views;
  for (std::size_t i = 0; i < views.size(); ++i) take(options.pictures[i], views[i], "Maker-A (640 x 480 px)");
  take(options.pictures[1], views[1], "Maker-A (640 x 480 px, ReverseX = true)");
  expectRefused(options.pictures[1], "is of Maker-A (640 x 480 px, ReverseX = true), where others are of Maker-A (640");
  take(options.pictures[1], views[1], "");  // of another program: nothing is known of it
  ASSERT_TRUE(calibrate(options, report));
  EXPECT_EQ(sensor::loadGel(options.output)->measuredWith, "Maker-A (640 x 480 px)");
}

TEST_F(CalibrateCommand, WritesTheLensIntoTheGelFile) {
  sensor::Sensor before;
  before.gel.youngsModulus = 1.3e5;
  before.camera.width = truth.width;
  before.camera.height = truth.height;
  before.calibration = sensor::Calibration{};
  options.gel = path("in.toml");
  write(options.gel, sensor::gelText(before));
  ASSERT_TRUE(calibrate(options, report));
  const auto after = sensor::loadGel(options.output);
  ASSERT_TRUE(after) << after.error().what;
  EXPECT_EQ(after->gel.youngsModulus, before.gel.youngsModulus);
  EXPECT_EQ(after->camera.position, before.camera.position);
  EXPECT_FALSE(after->calibration);
  const sensor::Camera& found = after->camera;
  EXPECT_EQ(found.width, truth.width);
  EXPECT_EQ(found.height, truth.height);
  // Five deviations: a test of the file, not of the fit.
  EXPECT_NEAR(found.focal_px / truth.focal, 1.0, 5 * after->uncertainty.focal);
  EXPECT_NEAR(found.principal_px.x(), truth.u0, 5 * after->uncertainty.principal_px);
  EXPECT_NEAR(found.principal_px.y(), truth.v0, 5 * after->uncertainty.principal_px);
  EXPECT_NEAR(found.k1, truth.k1, 5 * after->uncertainty.k1);
  EXPECT_NEAR(found.k2, truth.k2, 5 * after->uncertainty.k2);
  EXPECT_LT(after->uncertainty.focal, 2e-3);
  EXPECT_LT(after->uncertainty.principal_px, 1.0);
}

TEST_F(CalibrateCommand, TakesThePictureSizeThatTheFileLeavesOut) {
  options.gel = path("plan.toml");
  write(options.gel, "format = 1\n[gel]\nyoungs_modulus_pa = 130000\n");
  const Done done = calibrate(options, report);
  ASSERT_TRUE(done) << done.error()[0].message();
  const auto after = sensor::loadGel(options.output);
  ASSERT_TRUE(after) << after.error().what;
  EXPECT_EQ(after->gel.youngsModulus, 1.3e5);
  EXPECT_EQ(after->camera.width, truth.width);
  EXPECT_EQ(after->camera.height, truth.height);
  // What it says must still be the pictures'.
  std::filesystem::remove(options.output);
  write(options.gel, "format = 1\n[camera]\nheight_px = 17\n");
  expectRefused(options.gel, "has a camera of " + std::to_string(truth.width) + " x 17 px");
}

/// Pixels that are not square, or pictures that were resized. The pictures are taken again.
TEST_F(CalibrateCommand, FindsAScaleThatDiffers) {
  truth.aspect = 1.035;
  takeAgain();
  options.force = true;
  for (const double believed : {1.035, 1.1}) {
    options.gel = path("in.toml");
    write(options.gel, "format = 1\n[camera]\naspect = " + std::to_string(believed) + "\n");
    report = {};
    const Done done = calibrate(options, report);
    const std::string printed = report.text();
    ASSERT_TRUE(done) << done.error()[0].message();
    const char* said = believed == 1.1 ? "5.9 % smaller than camera.aspect = 1.1 says" : "residual_px";
    EXPECT_NE(printed.find(said), std::string::npos) << printed;
    EXPECT_EQ(printed.find("scale differs") == std::string::npos, believed == truth.aspect) << printed;
    const auto after = sensor::loadGel(options.output);
    ASSERT_TRUE(after) << after.error().what;
    const sensor::Camera& found = after->camera;
    if (believed == truth.aspect) {
      EXPECT_EQ(found.aspect, believed) << "held";
    } else {
      EXPECT_NEAR(found.aspect, truth.aspect, 1e-3);
      EXPECT_NE(found.aspect, truth.aspect) << "estimated";
    }
    EXPECT_NEAR(found.focal_px / truth.focal, 1.0, 5 * after->uncertainty.focal);
    EXPECT_NEAR(found.aspect * found.focal_px / (truth.aspect * truth.focal), 1.0, 5 * after->uncertainty.focal);
    EXPECT_NEAR(found.principal_px.y(), truth.v0, 5 * after->uncertainty.principal_px);
    EXPECT_NEAR(found.k1, truth.k1, 5 * after->uncertainty.k1);
    EXPECT_LT(after->uncertainty.focal, 2e-3);
  }
}

/// A board with as many columns as rows may lie either way, which tells nothing of its squares.
TEST_F(CalibrateCommand, WritesNoAspectThatMayBeTheBoards) {
  truth.aspect = 1.035;
  options.board = {7, 7, 10e-3};
  takeAgain();
  const Done done = calibrate(options, report);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error()[0].what.find("do not tell whether the board's squares are oblong"), std::string::npos);
  EXPECT_NE(done.error()[0].what.find("(aspect 1.03"), std::string::npos) << done.error()[0].message();
  EXPECT_NE(done.error()[0].remedy.find("measure ten squares along both sides"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(options.output));
  options.boardIsMeasured = true;
  ASSERT_TRUE(calibrate(options, report));
  EXPECT_NEAR(sensor::loadGel(options.output)->camera.aspect, truth.aspect, 1e-3);
}

TEST_F(CalibrateCommand, RefusesABoardOfAnotherSize) {
  const cv::Mat other = photograph(kTilted[0], kTilted[1], {9, 7, 10e-3});
  expectRefused(spoil(other), "shows no chessboard of 9x6 squares");
}

TEST_F(CalibrateCommand, RefusesABlurredPicture) {
  constexpr double kBlur_px = 4.0;
  cv::Mat picture;
  do {  // squares of fewer than five times the blur may melt: the test below
    picture = photograph(kTilted[0], kTilted[1]);
  } while (squareIn(picture) < 5.0 * kBlur_px);
  cv::GaussianBlur(picture, picture, {}, kBlur_px);
  expectRefused(spoil(picture), "is blurred");
}

TEST_F(CalibrateCommand, RefusesAPictureWithoutABoard) {
  cv::Mat noise(truth.height, truth.width, CV_8UC1);
  cv::theRNG().state = draw.generator();
  cv::randu(noise, cv::Scalar(0), cv::Scalar(255));
  expectRefused(spoil(noise), "shows no chessboard of 9x6 squares: it must lie");
}

TEST_F(CalibrateCommand, RefusesAPictureOfAnotherSize) {
  cv::Mat picture = photograph(kTilted[0], kTilted[1]);
  cv::resize(picture, picture, {}, 1.25, 1.25, cv::INTER_AREA);
  expectRefused(spoil(picture), "where the others have");
}

TEST_F(CalibrateCommand, RefusesAPictureThroughAnotherLens) {
  TrueCamera other = truth;
  other.focal *= 1.3;
  other.k1 -= 0.1;
  const Board board = options.board;
  const cv::Mat picture =
      lens::photograph(other, board, draw.pose(other, board, 0.6, 0.8), draw.shot(), draw.generator);
  expectRefused(spoil(picture), "does not fit the others");
}

TEST_F(CalibrateCommand, RefusesTooFew) {
  options.pictures.resize(4);
  expectRefused("", "4 different pictures are too few");
}

/// The same view again, with other noise, tells nothing new.
TEST_F(CalibrateCommand, CountsEqualPicturesOnce) {
  ASSERT_TRUE(calibrate(options, report));
  const sensor::Uncertainty once = sensor::loadGel(options.output)->uncertainty;
  for (const cv::Mat& view : Pictures::drawn().views) {
    add(view);
    cv::Mat noise(view.size(), CV_8UC1), again;
    cv::theRNG().state = draw.generator();
    cv::randn(noise, cv::Scalar(4), cv::Scalar(1.5));
    cv::add(view, noise, again);
    add(again);
  }
  options.force = true;
  const Done done = calibrate(options, report);
  const std::string printed = report.text();
  ASSERT_TRUE(done) << done.error()[0].message();
  EXPECT_NE(printed.find("view17.png is left out: it shows the board where"), std::string::npos) << printed;
  const sensor::Uncertainty thrice = sensor::loadGel(options.output)->uncertainty;
  std::printf("  six board pictures given three times: principal point +- %.3f px; right: %.3f\n", thrice.principal_px,
              once.principal_px);
  EXPECT_EQ(thrice.principal_px, once.principal_px);
  EXPECT_EQ(thrice.focal, once.focal);
  options.pictures.erase(options.pictures.begin() + 4, options.pictures.begin() + 6);
  options.pictures.erase(options.pictures.begin() + 8, options.pictures.end());
  options.output = path("few.toml");
  expectRefused("", "4 different pictures are too few");
}

TEST_F(CalibrateCommand, RefusesPicturesThatAreUpsideDown) {
  truth.u0 = 0.5 * (truth.width - 1) + 0.04 * truth.width;
  truth.k1 = truth.k2 = 0.0;
  takeAgain();
  for (std::size_t i = 0; i < 3; ++i) {
    cv::Mat half = *readPicture(options.pictures[i]);
    cv::rotate(half, half, cv::ROTATE_180);
    ASSERT_TRUE(writePicture(options.pictures[i], half));
  }
  const Done done = calibrate(options, report);
  ASSERT_FALSE(done);
  std::printf("  half of the board pictures turned by 180°: %s; right: refused\n", done.error()[0].message().c_str());
  EXPECT_NE(done.error()[0].what.find("are turned by 180 degrees against the others"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(options.output));
}

TEST_F(CalibrateCommand, RefusesViewsFromTheFrontAlone) {
  for (const std::string& file : options.pictures) ASSERT_TRUE(writePicture(file, photograph(0.0, 0.02)));
  const Done done = calibrate(options, report);
  ASSERT_FALSE(done);
  std::printf("%s\n", done.error()[0].message().c_str());
  EXPECT_NE(done.error()[0].what.find("do not tell the focal length"), std::string::npos);
  EXPECT_NE(done.error()[0].where.find(options.pictures[5]), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(options.output));
}

TEST_F(CalibrateCommand, NamesEveryPictureThatDoesNotServe) {
  const std::string whole = content(options.pictures[2]);
  write(options.pictures[2], whole.substr(0, draw.generator() % whole.size()));
  std::filesystem::remove(options.pictures[5]);
  write(options.output, "what was there");
  options.force = true;
  const Done done = calibrate(options, report);
  ASSERT_FALSE(done);
  for (const auto& fault : done.error()) std::printf("%s\n", fault.message().c_str());
  ASSERT_EQ(done.error().size(), 2U);
  EXPECT_EQ(done.error()[0].where, options.pictures[2]);
  EXPECT_EQ(done.error()[1].where, options.pictures[5]);
  EXPECT_EQ(done.error()[1].exitCode, EX_NOINPUT);
  EXPECT_EQ(content(options.output), "what was there");
}

TEST_F(CalibrateCommand, RefusesAGelFileOfAnotherCamera) {
  options.gel = path("in.toml");
  sensor::Sensor other;
  other.camera.width = 1280;
  other.camera.height = 1024;
  write(options.gel, sensor::gelText(other));
  expectRefused(options.gel, "has a camera of 1280 x 1024 px");
}

TEST_F(CalibrateCommand, SaysWhenItCannotWrite) {
  options.output = path("no/such/folder/out.toml");
  const Done done = calibrate(options, report);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error()[0].exitCode, EX_CANTCREAT);
}

}  // namespace
}  // namespace lens::calibrate_command_test
