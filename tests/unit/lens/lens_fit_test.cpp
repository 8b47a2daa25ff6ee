#include "lens/lens_fit.h"
#include "tests/support/seed.h"
#include "tests/unit/lens/random_views.h"

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

namespace lens::lens_fit_test {
namespace {

constexpr int kPictures = 15;
const Board kBoard{10, 7, 10e-3};

/// Errors over their stated deviations: focal length, principal point, k1, k2.
std::array<double, 5> pulls(const LensFit& fit, const TrueCamera& truth) {
  return {(fit.camera.focal_px - truth.focal) / fit.focalDeviation_px,
          (fit.camera.principal_px.x() - truth.u0) / fit.principalDeviation_px.x(),
          (fit.camera.principal_px.y() - truth.v0) / fit.principalDeviation_px.y(),
          (fit.camera.k1 - truth.k1) / fit.k1Deviation, (fit.camera.k2 - truth.k2) / fit.k2Deviation};
}

struct Coverage {
  int lenses = 0;
  std::array<int, 5> inside{};
  std::array<double, 5> squares{};

  void add(const std::array<double, 5>& pulls) {
    ++lenses;
    for (std::size_t i = 0; i < pulls.size(); ++i) {
      inside[i] += std::abs(pulls[i]) <= 1.96 ? 1 : 0;
      squares[i] += pulls[i] * pulls[i];
    }
  }
  double meanSquare() const { return std::accumulate(squares.begin(), squares.end(), 0.0) / (5.0 * lenses); }
};

/// Corners as OpenCV's fisheye shows them, up to 75 degrees from the axis.
TEST(Fisheye, IsFoundWithinItsDeviations) {
  Draw draw(tractiond::test::seed());
  constexpr double kNoise_px = 0.05;
  for (int lens = 0; lens < 4; ++lens) {
    const double focal = draw.between(170, 330), aspect = lens % 2 == 0 ? 1.0 : 1.03;
    const double u0 = draw.between(310, 330), v0 = draw.between(230, 250);
    const std::vector<double> k = {draw.between(-0.03, 0.05), draw.between(-0.01, 0.01), draw.between(-0.003, 0.003),
                                   0.0};
    const cv::Mat matrix = (cv::Mat_<double>(3, 3) << focal, 0, u0, 0, aspect * focal, v0, 0, 0, 1);
    std::normal_distribution<double> noise(0.0, kNoise_px);
    std::vector<Corners> views;
    while (views.size() < kPictures) {
      const Eigen::Vector2d middle(40e-3, 25e-3);
      const double around = draw.between(-M_PI, M_PI), off = draw.between(0.0, 0.8), axis = draw.between(-M_PI, M_PI);
      const Eigen::Matrix3d away =
          Eigen::AngleAxisd(off, Eigen::Vector3d(std::cos(around), std::sin(around), 0)).toRotationMatrix();
      const Eigen::Matrix3d turn = away * Eigen::AngleAxisd(draw.between(kTilted[0], kTilted[1]),
                                                            Eigen::Vector3d(std::cos(axis), std::sin(axis), 0))
                                              .toRotationMatrix();
      const Eigen::Vector3d shift = draw.between(0.08, 0.14) * away.col(2) - turn.leftCols<2>() * middle;
      std::vector<cv::Point3d> board;
      double farthest = 0.0;
      for (int i = 0; i < kBoard.corners(); ++i) {
        const Eigen::Vector2d place = kBoard.corner(i);
        const Eigen::Vector3d seen = turn.leftCols<2>() * place + shift;
        farthest = std::max(farthest, std::atan2(seen.head<2>().norm(), seen.z()));
        board.emplace_back(place.x(), place.y(), 0.0);
      }
      if (farthest > 1.3) continue;
      cv::Mat turnOfCv, rotation;
      cv::eigen2cv(turn, turnOfCv);
      cv::Rodrigues(turnOfCv, rotation);
      std::vector<cv::Point2d> places;
      cv::fisheye::projectPoints(board, places, rotation, cv::Vec3d(shift.x(), shift.y(), shift.z()), matrix, k);
      Corners& view = views.emplace_back();
      view.place_px.resize(2, kBoard.corners());
      for (int i = 0; i < kBoard.corners(); ++i) {
        const cv::Point2d place = places[static_cast<std::size_t>(i)];
        view.place_px.col(i) << place.x + noise(draw.generator), place.y + noise(draw.generator);
      }
    }
    LensFitOptions options;
    options.fisheye = true;
    const LensFit fit = fitLens(views, kBoard, 640, 480, options);
    ASSERT_EQ(fit.outcome, LensFit::Outcome::kDone) << lens;
    EXPECT_TRUE(fit.camera.fisheye);
    EXPECT_FALSE(fit.oddView);
    EXPECT_EQ(fit.scale, lens % 2 == 0 ? Scale::kAsExpected : Scale::kPixels);
    EXPECT_NEAR(fit.residual_px, kNoise_px, 0.1 * kNoise_px);
    EXPECT_LT(fit.focalDeviation_px, 1e-3 * focal);
    const auto near = [&](double found, double truth, double deviation, const char* name) {
      EXPECT_LT(std::abs(found - truth), 5.0 * deviation) << lens << ' ' << name << ' ' << found << " for " << truth;
    };
    near(fit.camera.focal_px, focal, fit.focalDeviation_px, "focal");
    near(fit.camera.principal_px.x(), u0, fit.principalDeviation_px.x(), "u");
    near(fit.camera.principal_px.y(), v0, fit.principalDeviation_px.y(), "v");
    near(fit.camera.k1, k[0], fit.k1Deviation, "k1");
    near(fit.camera.k2, k[1], fit.k2Deviation, "k2");
    near(fit.camera.k3, k[2], fit.k3Deviation, "k3");
    near(fit.camera.k4, k[3], fit.k4Deviation, "k4");
    const LensFit pinhole = fitLens(views, kBoard, 640, 480);
    EXPECT_GT(pinhole.residual_px, 1.5 * fit.residual_px) << "a pinhole does as well";
  }
}

/// Where the edges are, not where the camera's pixels are: without noise, errors are far below what noise does.
TEST(Corners, AreExactToThousandthsOfAPixel) {
  Draw draw(tractiond::test::seed());
  double squares = 0.0, worst_px = 0.0;
  int coordinates = 0;
  for (int i = 0; i < 8; ++i) {
    const TrueCamera truth = draw.camera();
    const BoardPose pose = draw.pose(truth, kBoard, kTilted[0], kTilted[1]);
    const Shot shot{20.0, 220.0, draw.between(0.5, 1.1), 0.3};
    const auto found = findCorners(photograph(truth, kBoard, pose, shot, draw.generator), kBoard);
    ASSERT_TRUE(found) << i << ": " << found.error();
    Eigen::Matrix2Xd places(2, kBoard.corners());
    for (int k = 0; k < kBoard.corners(); ++k) places.col(k) = seenAt(truth, pose, kBoard.corner(k));
    // The board looks the same turned by half.
    const double turned = (found->place_px.rowwise().reverse() - places).norm();
    const Eigen::Matrix2Xd off = turned < (found->place_px - places).norm()
                                     ? Eigen::Matrix2Xd(found->place_px.rowwise().reverse() - places)
                                     : Eigen::Matrix2Xd(found->place_px - places);
    squares += off.squaredNorm();
    coordinates += 2 * kBoard.corners();
    worst_px = std::max(worst_px, off.colwise().norm().maxCoeff());
  }
  std::printf("corners are off by %.4f px, the worst by %.4f px\n", std::sqrt(squares / coordinates), worst_px);
  EXPECT_LE(std::sqrt(squares / coordinates), 3e-3);
  EXPECT_LE(worst_px, 0.02);
}

/// Corners of boards seen at random, each wrong by `error_px` (one deviation, each coordinate).
/// \param turned whether every other board is turned by 90 degrees
std::vector<Corners> seenCorners(Draw& draw, const TrueCamera& truth, const Board& board, double error_px,
                                 bool turned = false) {
  std::vector<Corners> views(kPictures);
  std::normal_distribution<double> normal;
  for (int i = 0; i < kPictures; ++i) {
    BoardPose pose = draw.pose(truth, board, kTilted[0], kTilted[1]);
    if (turned && i % 2 == 1) {
      const Eigen::Vector2d middle = 0.5 * board.corner(board.corners() - 1);
      const Eigen::Vector3d seen = pose.turn.leftCols<2>() * middle + pose.shift;
      pose.turn = pose.turn * Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      pose.shift = seen - pose.turn.leftCols<2>() * middle;
    }
    Corners& view = views[static_cast<std::size_t>(i)];
    view.place_px.resize(2, board.corners());
    for (int k = 0; k < board.corners(); ++k) {
      view.place_px.col(k) = seenAt(truth, pose, board.corner(k)) +
                             error_px * Eigen::Vector2d(normal(draw.generator), normal(draw.generator));
    }
  }
  return views;
}

/// Half of the pictures stored upside down or mirrored: the lens of their mean is that of no camera.
TEST(FlippedPictures, AreNamed) {
  Draw draw(tractiond::test::seed());
  const TrueCamera truth{.u0 = 345.0, .v0 = 215.0, .k1 = -0.2, .k2 = 0.05};
  const Eigen::Vector2d last_px(truth.width - 1, truth.height - 1);
  for (const Eigen::Vector2d& sign : {Eigen::Vector2d(-1, -1), Eigen::Vector2d(-1, 1), Eigen::Vector2d(1, -1)}) {
    for (const std::size_t many : {1, 5, 7}) {
      std::vector<Corners> views = seenCorners(draw, truth, kBoard, 0.05);
      std::vector<bool> isFlipped(views.size(), false);
      for (std::size_t i = 0; i < many; ++i) {
        isFlipped[i] = true;
        Eigen::Matrix2Xd& place_px = views[i].place_px;
        place_px = (sign.asDiagonal() * place_px).colwise() + 0.5 * (last_px - sign.cwiseProduct(last_px));
        for (int row = 0; sign.prod() < 0.0 && row < 6; ++row) {
          place_px.middleCols(9 * row, 9) = place_px.middleCols(9 * row, 9).rowwise().reverse().eval();
        }
      }
      const LensFit fit = fitLens(views, kBoard, truth.width, truth.height);
      EXPECT_EQ(fit.isFlipped, isFlipped) << sign.transpose() << ", " << many;
      EXPECT_EQ(fit.flip, sign) << many;
    }
  }
}

/// A board that is turned by half, or listed from its other end, is a board in another pose.
TEST(FlippedPictures, AreNotThoseOfATurnedBoard) {
  Draw draw(tractiond::test::seed());
  for (int i = 0; i < 5; ++i) {
    const TrueCamera truth = draw.camera();
    std::vector<Corners> views = seenCorners(draw, truth, kBoard, draw.between(0.02, 0.2));
    views.resize(i == 0 ? 5 : views.size());
    const LensFit before = fitLens(views, kBoard, truth.width, truth.height);
    EXPECT_TRUE(before.isFlipped.empty()) << i;
    for (std::size_t k = 0; k < views.size(); k += 2) {
      views[k].place_px = views[k].place_px.rowwise().reverse().eval();
    }
    const LensFit fit = fitLens(views, kBoard, truth.width, truth.height);
    EXPECT_TRUE(fit.isFlipped.empty()) << i;
    EXPECT_NEAR(fit.camera.principal_px.x(), before.camera.principal_px.x(), 0.01);
    EXPECT_NEAR(fit.principalDeviation_px.x(), before.principalDeviation_px.x(),
                0.01 * before.principalDeviation_px.x());
  }
}

TEST(ExactCorners, GiveTheLensExactly) {
  Draw draw(tractiond::test::seed());
  for (int i = 0; i < 5; ++i) {
    const TrueCamera truth = draw.camera();
    const LensFit fit = fitLens(seenCorners(draw, truth, kBoard, 0.0), kBoard, truth.width, truth.height);
    ASSERT_EQ(fit.outcome, LensFit::Outcome::kDone);
    // A picture's place is itself found to 1e-5 px.
    EXPECT_NEAR(fit.camera.focal_px, truth.focal, 1e-3);
    EXPECT_NEAR(fit.camera.principal_px.x(), truth.u0, 1e-3);
    EXPECT_NEAR(fit.camera.principal_px.y(), truth.v0, 1e-3);
    EXPECT_NEAR(fit.camera.k1, truth.k1, 2e-5);
    EXPECT_NEAR(fit.camera.k2, truth.k2, 2e-5);
    EXPECT_LT(fit.residual_px, 5e-5);
    EXPECT_FALSE(fit.oddView) << *fit.oddView;
    EXPECT_FALSE(fit.aspectDeviation) << "square pixels are not estimated";
    EXPECT_EQ(fit.camera.aspect, 1.0);
  }
}

TEST(ExactCorners, GiveTheAspectExactly) {
  Draw draw(tractiond::test::seed());
  for (const double aspect : {1.035, 0.75}) {
    TrueCamera truth = draw.camera();
    truth.aspect = aspect;
    const LensFit fit = fitLens(seenCorners(draw, truth, kBoard, 0.0), kBoard, truth.width, truth.height);
    ASSERT_EQ(fit.outcome, LensFit::Outcome::kDone);
    EXPECT_TRUE(fit.aspectDeviation);
    EXPECT_NEAR(fit.camera.aspect, aspect, 2e-6);
    EXPECT_NEAR(fit.camera.focal_px, truth.focal, 2e-3);
    EXPECT_NEAR(fit.camera.k1, truth.k1, 3e-5);
    EXPECT_LT(fit.residual_px, 5e-5);
  }
}

/// Printed too wide by a share, which nobody says.
class OblongBoard : public testing::TestWithParam<double> {
 protected:
  static constexpr double kError_px = 0.03;
  static void expectTheLens(const LensFit& fit, const TrueCamera& truth) {
    for (const double pull : pulls(fit, truth)) EXPECT_LT(std::abs(pull), 5.0);
  }

  Draw draw{tractiond::test::seed()};
  Board asGiven{10, 7, 10e-3}, printed{10, 7, GetParam() * 10e-3, 1.0 / GetParam()};
};

TEST_P(OblongBoard, IsNeverTakenForOtherPixels) {
  std::array<int, 4> told{};
  for (int i = 0; i < 4; ++i) {
    const TrueCamera truth = draw.camera();
    const bool turned = i % 2 == 1;
    const auto views = seenCorners(draw, truth, printed, kError_px, turned);
    const LensFit fit = fitLens(views, asGiven, truth.width, truth.height);
    ASSERT_EQ(fit.outcome, LensFit::Outcome::kDone);
    EXPECT_EQ(fit.camera.aspect, 1.0);
    EXPECT_FALSE(fit.aspectDeviation);
    ++told[static_cast<std::size_t>(fit.scale)];
    if (turned) {
      EXPECT_EQ(fit.scale, Scale::kBoard);
    }
    if (fit.scale != Scale::kBoard) continue;
    EXPECT_NEAR(fit.tall, printed.tall, 5 * fit.tallDeviation);
    EXPECT_LT(fit.tallDeviation, 2e-3);
    expectTheLens(fit, truth);
    // With the sides as they were measured, nothing is doubted.
    LensFitOptions options;
    options.boardIsMeasured = true;
    const LensFit measured = fitLens(views, printed, truth.width, truth.height, options);
    EXPECT_EQ(measured.scale, Scale::kAsExpected);
    expectTheLens(measured, truth);
  }
  std::printf("board %d, pixels %d, either %d, neither %d\n", told[2], told[1], told[3], told[0]);
}

TEST_P(OblongBoard, IsNotWhatOtherPixelsAreTakenFor) {
  std::array<int, 4> told{};
  for (int i = 0; i < 4; ++i) {
    TrueCamera truth = draw.camera();
    truth.aspect = 1.0 / GetParam();
    const bool turned = i % 2 == 1;
    const LensFit fit =
        fitLens(seenCorners(draw, truth, asGiven, kError_px, turned), asGiven, truth.width, truth.height);
    ASSERT_EQ(fit.outcome, LensFit::Outcome::kDone);
    EXPECT_NE(fit.scale, Scale::kBoard);
    ++told[static_cast<std::size_t>(fit.scale)];
    if (turned) {
      EXPECT_EQ(fit.scale, Scale::kPixels);
    }
    if (fit.scale != Scale::kPixels) continue;
    EXPECT_NEAR(fit.camera.aspect, truth.aspect, 5 * *fit.aspectDeviation);
    expectTheLens(fit, truth);
  }
  std::printf("board %d, pixels %d, either %d, neither %d\n", told[2], told[1], told[3], told[0]);
}

INSTANTIATE_TEST_SUITE_P(Shares, OblongBoard, testing::Values(1.005, 1.05));

/// Boards that stand upright and hardly tilted: what is wide in them is wide in all.
TEST(AnyBoard, SeenAlikeInAllPicturesTellsNotWhichOfTheTwoIsOblong) {
  Draw draw(tractiond::test::seed());
  const Board asGiven{10, 7, 10e-3};
  TrueCamera truth;
  truth.aspect = 0.99;
  std::vector<Corners> views;
  std::normal_distribution<double> normal(0.0, 0.05);
  for (int i = 0; i < kPictures; ++i) {
    const double tilt = (i % 3 - 1) * 0.25;
    BoardPose pose;
    pose.turn = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
    pose.shift = Eigen::Vector3d(-0.04 + 2e-3 * i, -0.025, 0.3 + 5e-3 * (i % 4));
    Corners view;
    view.place_px.resize(2, asGiven.corners());
    for (int k = 0; k < asGiven.corners(); ++k) {
      view.place_px.col(k) =
          seenAt(truth, pose, asGiven.corner(k)) + Eigen::Vector2d(normal(draw.generator), normal(draw.generator));
    }
    views.push_back(view);
  }
  const LensFit fit = fitLens(views, asGiven, truth.width, truth.height);
  EXPECT_EQ(fit.scale, Scale::kEither);
  EXPECT_EQ(fit.camera.aspect, 1.0);
  std::printf("scale %d, tall %.4f, aspect %.4f\n", static_cast<int>(fit.scale), fit.tall, fit.otherAspect);
}

/// One picture of a sharp set that is less sharp is none through another lens.
TEST(ExactCorners, OneViewOfThreeTimesTheErrorIsNotOdd) {
  Draw draw(tractiond::test::seed());
  for (int i = 0; i < 5; ++i) {
    const TrueCamera truth = draw.camera();
    auto views = seenCorners(draw, truth, kBoard, 0.02);
    views[3] = seenCorners(draw, truth, kBoard, 0.1)[0];
    const LensFit fit = fitLens(views, kBoard, truth.width, truth.height);
    EXPECT_FALSE(fit.oddView) << fit.viewResidual_px[3];
  }
}

/// Corners of real pictures err alike where they are near each other: the board is not flat, the light comes from one
/// side.
TEST(CorrelatedErrors, AreInTheDeviations) {
  Draw draw(tractiond::test::seed());
  std::normal_distribution<double> normal;
  Coverage coverage;
  constexpr int kLenses = 20;
  for (int i = 0; i < kLenses; ++i) {
    const TrueCamera truth = draw.camera();
    std::vector<Corners> views = seenCorners(draw, truth, kBoard, 0.02);
    for (Corners& view : views) {
      Eigen::Matrix<double, 2, 6> bend;
      for (double& coefficient : bend.reshaped()) coefficient = 0.1 * normal(draw.generator);
      const Eigen::Vector2d middle = kBoard.corner(kBoard.corners() / 2).head<2>();
      for (int k = 0; k < kBoard.corners(); ++k) {
        const Eigen::Vector2d at = (kBoard.corner(k).head<2>() - middle) / 40e-3;
        view.place_px.col(k) +=
            bend * Eigen::Vector<double, 6>(1, at.x(), at.y(), at.x() * at.y(), at.x() * at.x(), at.y() * at.y());
      }
    }
    const LensFit fit = fitLens(views, kBoard, truth.width, truth.height);
    ASSERT_EQ(fit.outcome, LensFit::Outcome::kDone);
    EXPECT_TRUE(fit.isFlipped.empty()) << i;
    coverage.add(pulls(fit, truth));
  }
  std::printf("mean square of error / deviation %.2f\n", coverage.meanSquare());
  EXPECT_LT(coverage.meanSquare(), 3.0);  // 20 where errors are taken to be independent
  EXPECT_GT(coverage.meanSquare(), 0.5);
}

/// The same with corners that err as these do, without pictures: many lenses.
TEST(LensFit, DeviationsAreTrue) {
  Draw draw(tractiond::test::seed());
  constexpr int kLenses = 150;
  Coverage coverage;
  for (int i = 0; i < kLenses; ++i) {
    const TrueCamera truth = draw.camera();
    const double error_px = draw.between(0.01, 0.1);
    const LensFit fit = fitLens(seenCorners(draw, truth, kBoard, error_px), kBoard, truth.width, truth.height);
    ASSERT_EQ(fit.outcome, LensFit::Outcome::kDone);
    EXPECT_TRUE(fit.isFlipped.empty()) << i;
    coverage.add(pulls(fit, truth));
  }
  std::printf(
      "inside the 95 %% interval, of %d lenses: focal %.1f %%, u0 %.1f %%, v0 %.1f %%, k1 %.1f %%, k2 %.1f %%\n",
      kLenses, 100.0 * coverage.inside[0] / kLenses, 100.0 * coverage.inside[1] / kLenses,
      100.0 * coverage.inside[2] / kLenses, 100.0 * coverage.inside[3] / kLenses, 100.0 * coverage.inside[4] / kLenses);
  std::printf("mean square of error / deviation %.2f\n", coverage.meanSquare());
  // Five numbers outside 3.5 deviations, of a chi-squared with as many degrees of freedom as lenses: one run in 400.
  const double most = 3.5 * std::sqrt(2.0 / kLenses);
  // The larger of two estimates is stated: where the errors are independent, variances are a sixth too large.
  constexpr double kLarger = 0.85;
  for (const double squares : coverage.squares) EXPECT_NEAR(squares / kLenses, kLarger, most);
  EXPECT_NEAR(coverage.meanSquare(), kLarger, 0.3);
}

}  // namespace
}  // namespace lens::lens_fit_test
