// The hand file, and fields in, grasps out.
#include "client/touch/grasper.h"
#include "client/touch/hand_file.h"

#include <gtest/gtest.h>
#include <sysexits.h>

#include <array>
#include <string>
#include <utility>

namespace traction::contacts::hand_test {
namespace {

constexpr std::int64_t kFrame_ns = 16'666'667;
std::int64_t clock_ns = 0;  // NOLINT: the clock of a program is one, too

std::string finger(const std::string& instance, const std::string& rest = "") {
  return "[[finger]]\ninstance = \"" + instance + "\"\nposition_mm = [1, 2, 3]\n" +
         (rest.find("rotation") == std::string::npos ? "rpy_deg = [0, 0, 0]\n" : "") + rest + "\n";
}

std::string errorOf(const std::string& text) {
  const auto hand = parseHand(text, "hand.toml");
  if (hand) return "";
  EXPECT_EQ(hand.error().exitCode, EX_CONFIG);
  EXPECT_EQ(hand.error().where.rfind("hand.toml", 0), 0U) << hand.error().where;
  return hand.error().what;
}

TEST(HandFile, SaysWhatIsWrong) {
  const std::string name = "name = \"hand\"\n";
  EXPECT_EQ(errorOf(name + finger("a") + finger("b")), "");
  for (const auto& [text, what] : {
           std::pair<std::string, std::string>{name, "finger must be 1 to 16 tables [[finger]]"},
           {finger("a"), "name must be a name"},
           {"name = \"a hand\"\n" + finger("a"), "name must be a name"},
           {name + finger("a/b"), "finger[0].instance must be a name"},
           {name + finger("a") + finger("a"), "finger[1].instance = \"a\" is that of another finger, too"},
           {name + finger("a", "link = \"b\"") + finger("b"), "finger[1].link = \"b\" is that of another finger, too"},
           {name + "[[finger]]\ninstance = \"a\"\nrpy_deg = [0, 0, 0]", "finger[0].position_mm is missing"},
           {name + "[[finger]]\ninstance = \"a\"\nposition_mm = [0, 0, 0]", "rpy_deg or rotation_xyzw must be there"},
           {name + finger("a", "rotation_xyzw = [0, 0, 0, 1]\nrpy_deg = [0, 0, 0]"), "and not both"},
           {name + finger("a", "rotation_xyzw = [0, 0, 0, 0]"), "has the length 0.000000, and must have 1"},
           {name + finger("a", "rotation_xyzw = [1, 0, 0, 1]"), "has the length 1.414214, and must have 1"},
           {name + finger("a", "rotation_xyzw = [0, 0, nan, 1]"), "finger[0].rotation_xyzw = nan must be between"},
           {name + finger("a", "rotation_xyzw = [0, 0, 1]"), "finger[0].rotation_xyzw must be a list of 4 numbers"},
           {name + finger("a", "sensor = \"b\""), "unknown key 'finger[0].sensor'; the nearest known key"},
       }) {
    EXPECT_NE(errorOf(text).find(what), std::string::npos) << text << "\n" << errorOf(text);
  }
  EXPECT_EQ(loadHand("/nonexistent").error().exitCode, EX_NOINPUT);
}

/// A hand whose second finger is turned about z by a quarter, 10 mm along x.
struct Fingers {
  Fingers()
      : grasper(*parseHand(
                    "name = \"hand\"\n" + finger("a") +
                        "[[finger]]\ninstance = \"b\"\nlink = \"tip\"\nposition_mm = [10, 0, 0]\nrpy_deg = [0, 0, 90]",
                    ""),
                {.boot = {9}, .monotonicClock = [] { return clock_ns; }, .realClock = [] { return 77 * clock_ns; }}) {
    for (std::uint8_t i = 0; i < 2; ++i) {
      Field& field = fields[i];
      field.valid = true;
      field.header.sensor = i == 0 ? "one" : "two";
      field.header.boot = field.header.calibration = {static_cast<std::uint8_t>(i + 1)};
      field.header.captured_ns = 1'000'000'000 + 1000 * i;
      field.header.capturedError_ns = 500;
      field.header.capturedBound = CaptureBound::kBoth;
    }
  }
  /// Frames of both; returns the grasp with the last one.
  const v1::Grasp* take() {
    clock_ns += kFrame_ns;
    const v1::Grasp* grasp = nullptr;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      Header& header = fields[i].header;
      ++header.frameNumber;
      header.captured_ns += kFrame_ns;
      header.received_ns = header.captured_ns + 5'000'000 + static_cast<std::int64_t>(i);
      header.receivedReal_ns = 3'000'000'000 + header.received_ns;
      header.arrived_ns = clock_ns;
      grasp = grasper.take(i, fields[i]);
    }
    return grasp;
  }

  std::array<Field, 2> fields;
  Grasper grasper;
};

TEST(Grasper, StatesTheWrenchOfTheFieldsInTheFrameOfTheHand) {
  Fingers fingers;
  Field& turned = fingers.fields[1];
  turned.resultant_N = {1.0, 0.0, 0.0};
  turned.moment_Nm = {0.0, 0.0, 0.25};
  turned.resultantCovariance_N2.noise = {4.0, 0, 0, 0, 1.0, 0, 0, 0, 9.0};
  turned.resultantMomentCovariance_N2m.systematic = {0, 0, 3.0, 0, 0, 0, 0, 0, 0};  // of x with the moment about z
  turned.momentCovariance_N2m2.noise = {0, 0, 0, 0, 0, 0, 0, 0, 1.0};
  turned.header.flags = kTorn;
  fingers.fields[0].header.flags = kZeroUnverified;
  fingers.take();
  const v1::Grasp* grasp = fingers.take();
  ASSERT_NE(grasp, nullptr);
  EXPECT_TRUE(grasp->valid());
  EXPECT_NEAR(grasp->force_n().y(), 1.0, 1e-12);
  EXPECT_NEAR(grasp->moment_nm().z(), 0.25 + 0.01 * 1.0, 1e-12);
  EXPECT_NEAR(grasp->force_covariance_n2().noise(0), 1.0, 1e-12);
  EXPECT_NEAR(grasp->force_covariance_n2().noise(4), 4.0, 1e-12);
  EXPECT_NEAR(grasp->moment_covariance_n2m2().noise(8), 1.0 + 0.01 * 0.01 * 4.0, 1e-12);
  EXPECT_NEAR(grasp->force_moment_covariance_n2m().systematic(5), 3.0, 1e-12) << "of y with the moment about z";
  EXPECT_NEAR(grasp->force_moment_covariance_n2m().noise(5), 0.01 * 4.0, 1e-12);

  const v1::Header& header = grasp->header();
  EXPECT_EQ(header.sensor(), "hand");
  EXPECT_EQ(header.sequence(), 2U) << "the first came as soon as an interval was known";
  EXPECT_EQ(header.boot()[0], 9);
  EXPECT_EQ(header.flags(), std::uint32_t{kTorn} | kZeroUnverified);
  EXPECT_EQ(header.captured_ns(), turned.header.captured_ns - 500);
  EXPECT_EQ(header.captured_error_ns(), 1000);
  EXPECT_EQ(header.captured_bound(), v1::CAPTURE_BOUND_BOTH);
  EXPECT_EQ(header.received_ns(), turned.header.received_ns);
  EXPECT_EQ(grasp->timestamp(), 1e-9 * static_cast<double>(turned.header.receivedReal_ns));
  ASSERT_EQ(grasp->fingers_size(), 2);
  EXPECT_EQ(grasp->fingers(0).link(), "a");
  EXPECT_EQ(grasp->fingers(1).instance(), "b");
  EXPECT_EQ(grasp->fingers(1).link(), "tip");
  EXPECT_EQ(grasp->fingers(1).sensor(), "two");
  EXPECT_EQ(grasp->fingers(1).state(), v1::FINGER_STATE_MATCHED);
  EXPECT_EQ(grasp->fingers(1).frame_number(), turned.header.frameNumber);
  EXPECT_NEAR(grasp->fingers(1).force_n().y(), 1.0, 1e-12);

  turned.header.capturedBound = CaptureBound::kLatest;
  EXPECT_EQ(fingers.take()->header().captured_bound(), v1::CAPTURE_BOUND_LATEST);
}

}  // namespace
}  // namespace traction::contacts::hand_test
