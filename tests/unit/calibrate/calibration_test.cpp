#include "daemon/calibrate/calibration.h"
#include "sensor/gel_file.h"
#include "tests/support/fingertip.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/calibrate/frames.h"
#include "tests/unit/calibrate/markers.h"
#include "twin/creep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

namespace tractiond::calibrate::calibration_test {
namespace {

using Kind = CalibrationStep::Kind;

class CalibrationTest : public testing::Test {
 protected:
  CalibrationTest() {
    const Seen rest(projected(sensor_, sensor::markerPositions(sensor_.layers)), 0.003, 9);
    zero_.position_px = rest.value_px;
    zero_.present = rest.valid;
  }

  std::optional<Result> begin(const CalibrationStep& step) {
    return calibration_.begin(step, &zero_, "Camera-1", folder_);
  }

  /// Frames of a press until the step is over or the time is.
  std::optional<Result> press(double press_px, double seconds) {
    for (int i = 0; i < seconds * kRate_Hz; ++i) {
      if (auto result = calibration_.add(frames_.next(press_px))) return result;
    }
    return std::nullopt;
  }

  static CalibrationStep weight(double newtons, double patience_s = 60.0) {
    CalibrationStep step;
    step.kind = Kind::kWeight;
    step.weight_N = newtons;
    step.seconds = patience_s;
    return step;
  }

  sensor::Sensor sensor_ = coarse();
  RestPose zero_;
  const test::TemporaryFolder temporary_;
  const std::filesystem::path& folder_ = temporary_.path();
  Calibration calibration_{sensor_};
  Frames frames_{sensor_};
};

TEST_F(CalibrationTest, AWeightIsReadOnceItStandsStillAndIsNotTheOneBefore) {
  EXPECT_FALSE(begin(weight(1.0)));
  EXPECT_TRUE(calibration_.running());
  EXPECT_FALSE(press(0.0, 3.0));
  for (double force = 0.0; force < 1.0; force += 0.02) EXPECT_FALSE(calibration_.add(frames_.next(force)));
  EXPECT_FALSE(press(1.0, 1.4));  // it settles
  const auto first = press(1.0, 2.0);
  ASSERT_TRUE(first);
  ASSERT_TRUE(*first) << first->error();
  EXPECT_FALSE(calibration_.running());
  // The same weight is not the next one; a heavier one is.
  EXPECT_FALSE(begin(weight(2.0)));
  EXPECT_FALSE(press(1.0, 10.0));
  const auto second = press(2.0, 4.0);
  ASSERT_TRUE(second);
  EXPECT_TRUE(*second) << second->error();
  // Nor is the same again, unless it was taken off.
  EXPECT_FALSE(begin(weight(2.0)));
  EXPECT_FALSE(press(2.0, 4.0));
  EXPECT_FALSE(press(0.0, 1.0));
  const auto third = press(2.0, 4.0);
  ASSERT_TRUE(third);
  EXPECT_TRUE(*third) << third->error();
}

TEST_F(CalibrationTest, PatienceEndsWithTheReason) {
  EXPECT_FALSE(begin(weight(1.0, 3.0)));
  const auto none = press(0.0, 5.0);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->error(), "no weight was put on the gel");
  EXPECT_FALSE(begin(weight(1.0, 3.0)));
  std::optional<Result> swaying;
  for (int i = 0; i < 300 && !swaying; ++i) swaying = calibration_.add(frames_.next(1.0 + 0.5 * std::sin(0.1 * i)));
  ASSERT_TRUE(swaying);
  EXPECT_EQ(swaying->error(), "the weight did not come to rest");
}

TEST_F(CalibrationTest, WhatCannotBeIsRefused) {
  CalibrationStep step;
  step.kind = Kind::kFinish;
  EXPECT_EQ(begin(step)->error(), "nothing has been measured since the start of the daemon");
  step.kind = Kind::kStiffness;
  EXPECT_EQ(begin(step)->error(), "no weight has been read");
  step.kind = Kind::kGeometry;
  EXPECT_FALSE(*calibration_.begin(step, nullptr, "Camera-1", folder_));
  EXPECT_FALSE(*begin(weight(-1.0)));
  EXPECT_FALSE(*begin(weight(std::nan(""))));
  for (const double newtons : {1.1e6, 1e300, std::numeric_limits<double>::infinity()}) {  // no gel file can hold it
    const auto heavy = begin(weight(newtons));
    ASSERT_TRUE(heavy);
    EXPECT_EQ(heavy->error(), "a weight is at most 1,000,000 N");
  }
}

TEST_F(CalibrationTest, TheFileSaysWhatWasMeasuredAndIsVerified) {
  CalibrationStep step;
  step.kind = Kind::kGeometry;
  const auto geometry = begin(step);
  ASSERT_TRUE(geometry);
  ASSERT_TRUE(*geometry) << geometry->error();
  EXPECT_NE((*geometry)->remarks.front().find("two layers"), std::string::npos);
  step.kind = Kind::kNoise;
  step.seconds = 1.0;
  EXPECT_FALSE(begin(step));
  const auto noise = press(0.0, 3.0);
  ASSERT_TRUE(noise);
  ASSERT_TRUE(*noise) << noise->error();
  step.kind = Kind::kFinish;
  step.name = "left";
  const auto one = begin(step), again = begin(step);
  ASSERT_TRUE(one && *one && again);
  ASSERT_FALSE(*again);
  EXPECT_EQ(again->error(), "nothing has been measured since " + (*one)->path + " was written");
  CalibrationStep geometryAgain;
  geometryAgain.kind = Kind::kGeometry;
  ASSERT_TRUE(*begin(geometryAgain));
  const auto two = begin(step);
  ASSERT_TRUE(two && *two);
  EXPECT_NE((*one)->path, (*two)->path);

  const auto written = sensor::loadGel((*one)->path);
  ASSERT_TRUE(written) << written.error().what;
  ASSERT_TRUE(written->calibration);
  EXPECT_EQ(written->calibration->camera, "Camera-1");
  EXPECT_NE(written->calibration->geometry, "");
  EXPECT_NE(written->calibration->noise, "");
  EXPECT_EQ(written->calibration->stiffness, "");
  EXPECT_NEAR(written->calibration->noise_px, kNoise_px, 0.001);
  EXPECT_NEAR(written->calibration->residual_px, 0.003, 0.0005);
  EXPECT_DOUBLE_EQ(written->gel.youngsModulus, sensor_.gel.youngsModulus);
  EXPECT_TRUE(verifyCalibration(*written, "gel.toml"));
  const std::string text = sensor::gelText(*written);
  for (std::size_t size = 0; size < text.size(); ++size) {
    const auto cut = sensor::parseGel(text.substr(0, size), "gel.toml");
    EXPECT_FALSE(cut && verifyCalibration(*cut, "gel.toml") && sensor::gelText(*cut) != text)
        << "taken, cut short after:\n"
        << text.substr(0, size);
  }
  sensor::Sensor changed = *written;
  changed.gel.youngsModulus *= 1.01;
  EXPECT_FALSE(verifyCalibration(changed, "gel.toml"));
  changed.calibration.reset();
  EXPECT_TRUE(verifyCalibration(changed, "gel.toml"));
}

TEST(BodyCalibration, TheHashIsOfTheInfluencesContent) {
  sensor::Sensor sensor = coarse();
  sensor::Body body = test::bodyOn(sensor, Eigen::MatrixXd::Identity(4, 4));
  sensor.body = std::make_shared<const sensor::Body>(body);
  const std::string hash = calibrationHash(sensor);
  body.influence(1, 2) = 1e-9;
  sensor.body = std::make_shared<const sensor::Body>(body);
  EXPECT_NE(calibrationHash(sensor), hash);
}

/// A gel that yields by 2 % within seconds and by 3 % within ten, under a load that comes and goes.
class CreepingGel : public CalibrationTest {
 protected:
  std::optional<Result> under(double press_px, double seconds) {
    for (int i = 0; i < seconds * kRate_Hz; ++i) {
      time_s_ += 1.0 / kRate_Hz;
      creep_.advance(time_s_, sensor::Points::Constant(3, 1, press_px));
      if (auto result = calibration_.add(frames_.next(press_px + creep_.now()(0, 0)))) return result;
    }
    return std::nullopt;
  }

  std::optional<Result> begin(Kind kind, double seconds = 0.0) {
    CalibrationStep step;
    step.kind = kind;
    step.seconds = seconds;
    return CalibrationTest::begin(step);
  }

  static std::string refusal(const std::optional<Result>& result) {
    return result && !*result ? result->error() : "nothing was refused";
  }

  twin::Creep creep_{{{.share = 0.02, .time_s = 1.0}, {.share = 0.03, .time_s = 10.0}}, 1};
  double time_s_ = 0.0;
};

double figure(const Result& result, const std::string& name) {
  const auto& figures = result->figures;
  return std::ranges::find(figures, name, &CalibrationReport::Figure::name)->value;
}

TEST_F(CreepingGel, ReadsWeightsAsHeavyAtOnceAsLaterOnceItsCreepIsMeasured) {
  EXPECT_FALSE(begin(Kind::kCreep, 20.0));
  EXPECT_FALSE(under(0.0, 2.0));
  const auto held = under(1.0, 21.0);
  ASSERT_TRUE(held && *held) << refusal(held);
  EXPECT_FALSE(under(1.0, 0.5));  // until the next request comes
  EXPECT_FALSE(begin(Kind::kRecovery));
  EXPECT_FALSE(under(1.0, 2.0));
  const auto recovered = under(0.0, 21.0);
  ASSERT_TRUE(recovered && *recovered) << refusal(recovered);
  EXPECT_LT(figure(*recovered, "error"), 2e-3);
  const auto written = begin(Kind::kFinish);
  ASSERT_TRUE(written && *written) << refusal(written);
  EXPECT_EQ(sensor::loadGel((*written)->path)->creep.size(), 5U);
  EXPECT_TRUE((*written)->remarks.front().starts_with("Young's modulus is that of some seconds after a touch"));

  EXPECT_FALSE(CalibrationTest::begin(weight(1.0)));
  const auto atOnce = under(1.0, 5.0);
  ASSERT_TRUE(atOnce && *atOnce) << refusal(atOnce);
  EXPECT_FALSE(under(1.5, 20.0));
  EXPECT_FALSE(CalibrationTest::begin(weight(1.5)));
  const auto later = under(1.5, 5.0);
  ASSERT_TRUE(later && *later) << refusal(later);
  EXPECT_NEAR(figure(*later, "reading_gf") / figure(*atOnce, "reading_gf"), 1.5, 0.005 * 1.5);
}

TEST_F(CreepingGel, ALoadThatLeavesTooEarlyOrNeverCameIsRefused) {
  EXPECT_FALSE(begin(Kind::kCreep, 20.0));
  EXPECT_FALSE(under(0.0, 2.0));
  EXPECT_FALSE(under(1.0, 12.0));
  EXPECT_EQ(refusal(under(0.0, 1.0)), "the load left after 12 s; it must stay for 20 s");
  EXPECT_EQ(refusal(begin(Kind::kRecovery)),
            "there is no load whose end could be watched: it must have stayed for a step \"creep\" just before");
  EXPECT_FALSE(begin(Kind::kCreep, 20.0));
  EXPECT_EQ(refusal(under(0.0, 70.0)), "no load was put on the gel");
  EXPECT_FALSE(begin(Kind::kCreep, 20.0));
  EXPECT_TRUE(refusal(under(1.0, 1.0)).starts_with("something touches the gel already"));
}

TEST_F(CalibrationTest, NoiseUnderATouchIsRefused) {
  CalibrationStep step;
  step.kind = Kind::kNoise;
  step.seconds = 1.0;
  EXPECT_FALSE(begin(step));
  const auto noise = press(0.3, 3.0);
  ASSERT_TRUE(noise);
  ASSERT_FALSE(*noise);
  EXPECT_TRUE(noise->error().starts_with("something seems to touch the gel near")) << noise->error();
}

/// A thin gel that is 0.4 mm thicker than its file says, which is as uncertain as that, with markers whose measured
/// motion errs by a hundredth of a pixel each.
class Weights : public testing::Test {
 protected:
  Weights() {
    file_.gel.size.z() = 15e-3;
    truth_ = file_;
    truth_.gel.size.z() += 0.4e-3;
    truth_.gel.youngsModulus *= 1.3;
    world_ = std::make_unique<ContactFit>(truth_);
    std::mt19937 generator(8);
    std::normal_distribution<double> normal(0.0, 0.01);
    own_px_ = Eigen::VectorXd::NullaryExpr(2 * truth_.markerCount(), [&] { return normal(generator); });
  }

  /// Displacements by 1 N on a ball's contact.
  Eigen::VectorXd pressAt(double x, double y) const {
    return world_->fields(truth_.camera, {x, y, 3e-3}) * Eigen::Vector3d::UnitZ();
  }

  /// Reads a weight under which the markers have these displacements, and their own errors.
  CalibrationReport weigh(Calibration& calibration, const Eigen::VectorXd& moved, double weight_N) const {
    RestPose zero;
    zero.present.assign(static_cast<std::size_t>(file_.markerCount()), 1);
    CalibrationStep step;
    step.kind = Kind::kWeight;
    step.weight_N = weight_N;
    EXPECT_FALSE(calibration.begin(step, &zero, "Camera-1", ""));
    Frames frames(file_);
    std::optional<Result> read;
    for (int i = 0; i < 400 && !read; ++i) read = calibration.add(frames.next(Eigen::VectorXd(moved + own_px_)));
    EXPECT_TRUE(read && *read);
    return read && *read ? **read : CalibrationReport{};
  }

  static bool doubtsTheContact(const CalibrationReport& report) {
    return std::ranges::any_of(report.remarks, [](const std::string& remark) {
      return remark.find("does not stand on one round contact") != std::string::npos;
    });
  }

  sensor::Sensor file_ = coarse(), truth_;
  std::unique_ptr<ContactFit> world_;
  Eigen::VectorXd own_px_;
};

TEST_F(Weights, OneRoundContactIsNotDoubtedAndTwoAre) {
  Calibration calibration(file_);
  EXPECT_FALSE(doubtsTheContact(weigh(calibration, pressAt(3e-3, -2e-3), 1.0)));
  EXPECT_TRUE(doubtsTheContact(weigh(calibration, pressAt(-15e-3, 0.0) + pressAt(15e-3, 5e-3), 2.0)));
}

TEST_F(Weights, TheModulusIsAsUncertainAsWhatItTakesUp) {
  Calibration calibration(file_);
  weigh(calibration, 2.0 * pressAt(3e-3, -2e-3), 2.0);
  CalibrationStep step;
  step.kind = Kind::kStiffness;
  const auto result = calibration.begin(step, nullptr, "Camera-1", "");
  ASSERT_TRUE(result && *result);
  const auto& modulus = (*result)->figures.front();
  ASSERT_EQ(modulus.name, "youngs_modulus_pa");
  const double off = std::abs(modulus.value - truth_.gel.youngsModulus);
  std::printf("%.0f of %.0f Pa, +- %.0f\n", modulus.value, truth_.gel.youngsModulus, modulus.deviation);
  EXPECT_GT(off, 5e-3 * truth_.gel.youngsModulus);  // else this gel shows nothing
  EXPECT_LT(off, 1.5 * modulus.deviation);          // more than two of those of a press
  EXPECT_LT(modulus.deviation, 0.02 * modulus.value);
}

}  // namespace
}  // namespace tractiond::calibrate::calibration_test
