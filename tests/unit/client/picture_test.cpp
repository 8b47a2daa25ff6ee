#include "client/show/json.h"
#include "client/show/page.h"
#include "client/show/picture.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace traction::client::picture_test {
namespace {

constexpr int kColumns = 24;
constexpr int kRows = 24;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::vector<std::string> linesOf(const Canvas& canvas) {
  std::vector<std::string> lines;
  std::string text = canvas.plain();
  for (std::size_t end; (end = text.find('\n')) != std::string::npos; text.erase(0, end + 1)) {
    lines.push_back(text.substr(0, end));
  }
  return lines;
}

int characters(const std::string& utf8) {
  return static_cast<int>(std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

/// Columns before the first of these.
int columnOf(const std::string& line, const std::string& glyph) {
  const std::size_t at = line.find(glyph);
  return at == std::string::npos ? -1 : characters(line.substr(0, at));
}

Field fieldOf(int column, int row, std::array<float, 3> force) {
  Field field;
  field.valid = true;
  field.force_N.assign(std::size_t{kColumns} * kRows, {0.0F, 0.0F, 0.0F});
  field.nodeValid.assign(field.force_N.size(), 1);
  field.force_N[static_cast<std::size_t>(row * kColumns + column)] = force;
  field.resultant_N = {force[0], force[1], force[2]};
  return field;
}

Scene sceneOf(const Field& field, bool sameHost = true) {
  Description description;
  description.sameHost = sameHost;
  description.nodes = {kColumns, kRows, 3e-3, {}};
  Scene scene;
  Field arrived = field;
  arrived.header.arrived_ns = kSecond_ns;
  scene.add(description);
  scene.add(arrived);
  return scene;
}

std::vector<std::string> drawn(const Scene& scene, int width, int height) {
  Scale scale;
  return linesOf(draw(scene, width, height, scale, kSecond_ns, "ipc:///run/tractiond/default/stream"));
}

/// A field, then what a test does with time.
class Later {
 public:
  Later() {
    scene.setConnected(true, 0);
    for (int i = 0; i < 60; ++i) {
      now += kSecond_ns / 60;
      frame();
    }
  }
  void frame() { scene.add(at(fieldOf(3, 4, {0.1F, 0.2F, 3.0F}))); }
  void status(v1::CameraState camera, double received_hz = 60.0, const std::string& why = "") {
    v1::Status status;
    status.set_camera_why(why);
    status.set_camera(camera);
    status.mutable_rates()->set_received_hz(received_hz);
    scene.add(at(Status{{}, std::make_shared<v1::Status>(status)}));
  }
  void describe() {
    Description description;
    description.nodes = {kColumns, kRows, 3e-3, {}};
    scene.add(at(description));
  }
  Later& after(double seconds) {
    now += std::llround(seconds * 1e9);
    return *this;
  }
  std::string what() const { return scene.trouble(now).what; }
  std::string page(int width = 100, int height = 30) const {
    Scale scale;
    return draw(scene, width, height, scale, now, "").plain();
  }
  std::string line() const { return summary(scene, now); }

  Scene scene;
  std::int64_t now = kSecond_ns;
  Id boot{1};

 private:
  template <typename Any>
  Any at(Any message) const {
    message.header.arrived_ns = now;
    message.header.boot = boot;
    return message;
  }
};

TEST(Picture, ArrowPointsAlongTheForceAtItsNode) {
  struct Case {
    int column, row;
    std::array<float, 3> force;
    const char* arrow;
  };
  for (const Case& c : {Case{0, 0, {1.0F, 0.0F, 0.0F}, "⇒"}, Case{23, 0, {0.0F, 1.0F, 0.0F}, "⇑"},
                        Case{0, 23, {-1.0F, 0.0F, 0.0F}, "⇐"}, Case{23, 23, {0.0F, -1.0F, 0.0F}, "⇓"},
                        Case{5, 17, {0.7F, 0.7F, 0.0F}, "⇗"}, Case{6, 3, {-0.7F, -0.7F, 0.0F}, "⇙"}}) {
    const auto lines = drawn(sceneOf(fieldOf(c.column, c.row, c.force)), 100, 30);
    // The bar and the frame's top stand above the highest row, the frame's left side before the first column.
    EXPECT_EQ(columnOf(lines.at(static_cast<std::size_t>(2 + 23 - c.row)), c.arrow), 1 + 2 * c.column) << c.arrow;
  }
}

TEST(Picture, EverySizeIsFilledAndNothingStandsOutside) {
  const Scene scene = sceneOf(fieldOf(3, 4, {0.1F, 0.2F, 3.0F}));
  for (const auto& [width, height] :
       {std::pair{20, 8}, {40, 12}, {44, 40}, {80, 24}, {100, 30}, {250, 80}, {1, 1}, {0, 0}}) {
    const auto lines = drawn(scene, width, height);
    EXPECT_EQ(lines.size(), static_cast<std::size_t>(height));
    for (const std::string& line : lines) EXPECT_EQ(characters(line), width);
  }
}

// Independent of the reason, which may be known later.
TEST(Stale, NumbersLookSoWithinHalfASecond) {
  Later later;
  later.describe();
  EXPECT_NE(later.after(0.3).page().find(" +3.000 "), std::string::npos);
  EXPECT_NE(later.line().find("force +0.100 +0.200 +3.000 N"), std::string::npos);
  later.after(0.2);
  for (const auto& [width, height] : {std::pair{100, 30}, {80, 24}, {44, 40}}) {
    const std::string page = later.page(width, height);
    EXPECT_EQ(page.find(" +3.000 "), std::string::npos) << page;
    EXPECT_NE(page.find("(+3.000)"), std::string::npos) << page;
    EXPECT_NE(page.find("FORCE 0.5 s AGO"), std::string::npos) << page;
    EXPECT_NE(page.find("no field for"), std::string::npos) << page;
  }
  EXPECT_NE(later.page(20, 8).find("no field"), std::string::npos) << later.page(20, 8);
  EXPECT_EQ(later.line().find("3.000"), std::string::npos) << later.line();
  EXPECT_NE(later.line().find("no force: no field for 0.5 s"), std::string::npos) << later.line();
  later.frame();
  EXPECT_EQ(later.what(), "");
  EXPECT_EQ(later.page().find("AGO"), std::string::npos);
}

TEST(Stale, ReasonIsTheCamerasOrTheDaemons) {
  Later later;
  EXPECT_EQ(later.after(0.3).what(), "");
  later.after(0.3).status(v1::CAMERA_STATE_LOST, 0.0);
  EXPECT_EQ(later.what(), "the camera is lost");
  later.status(v1::CAMERA_STATE_LOST, 0.0, "it fell silent");
  EXPECT_EQ(later.what(), "the camera is lost: it fell silent");
  later.after(1.0).status(v1::CAMERA_STATE_STREAMING, 0.0);
  EXPECT_EQ(later.what(), "the camera sends no frames");
  later.after(1.0).status(v1::CAMERA_STATE_STREAMING, 60.0);
  EXPECT_EQ(later.what(), "no field is made of the frames");
  later.after(3.0);
  EXPECT_EQ(later.what(), "tractiond is silent");
  later.scene.setConnected(false, later.now);
  EXPECT_EQ(later.what(), "tractiond is gone");
  EXPECT_NE(later.after(10.0).page().find("tractiond is gone, no field for 16 s"), std::string::npos) << later.page();
}

TEST(Stale, NothingOfAnEarlierStartIsShown) {
  Later later;
  later.describe();
  later.scene.setConnected(false, later.after(0.6).now);
  EXPECT_EQ(later.what(), "tractiond is gone");
  EXPECT_NE(later.page().find("(+3.000)"), std::string::npos);
  later.boot = Id{2};
  later.scene.setConnected(true, later.after(5.0).now);
  EXPECT_EQ(later.after(1.5).what(), "tractiond is starting") << "it is not silent who has not spoken yet";
  later.after(0.1).status(v1::CAMERA_STATE_WAITING, 0.0);
  EXPECT_EQ(later.what(), "tractiond was restarted: tractiond waits for a camera");
  EXPECT_EQ(later.page().find("3.000"), std::string::npos) << later.page();
  EXPECT_NE(later.after(3.0).line().find("for 3.0 s"), std::string::npos) << later.line();
  later.frame();
  EXPECT_EQ(later.what(), "");
  EXPECT_NE(later.line().find("! tractiond restarted"), std::string::npos) << later.line();
  later.after(20.0).frame();
  EXPECT_EQ(later.line().find("restarted"), std::string::npos) << later.line();
}

TEST(Stale, SlowCameraIsNotCalledSoBetweenItsFrames) {
  Later later;
  for (int i = 0; i < 5; ++i) later.after(0.9).frame();
  EXPECT_EQ(later.after(0.9).what(), "");
  EXPECT_EQ(later.after(2.0).what(), "tractiond is silent");
}

TEST(Picture, ZeroHasNoMinusAndIsNoDeviation) {
  Field field = fieldOf(0, 0, {-0.0001F, 0.0F, -0.2F});
  field.resultantCovariance_N2.noise = {1e-10, 0, 0, 0, 1e-4, 0, 0, 0, 0};
  std::string page;
  for (const std::string& line : drawn(sceneOf(field), 100, 30)) page += line + '\n';
  EXPECT_EQ(page.find("-0.00"), std::string::npos) << page;
  for (const char* text : {"+0.000 ±2e-05 N", "+0.000 ±0.020 N", "-0.200 N  into"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text << '\n' << page;
  }
  EXPECT_EQ(format("%+.1f %+.1f %d", -0.04, -0.06, -100), "+0.0 -0.1 -100");
  EXPECT_EQ(format("%.1f at 2026-00", -0.04), "0.0 at 2026-00");
}

TEST(Picture, InvalidFieldSaysWhy) {
  Field field = fieldOf(3, 4, {0.1F, 0.2F, 3.0F});
  field.valid = false;
  field.header.flags = kGelMismatch;
  Scene scene = sceneOf(field);
  EXPECT_NE(summary(scene, kSecond_ns).find("no force: the gel file does not fit the picture"), std::string::npos);
  const auto message = std::make_shared<v1::Status>();
  message->set_invalid_why("7 of 24 markers\x1b are found");
  scene.status = Status{{}, message};
  EXPECT_NE(summary(scene, kSecond_ns).find("no force: 7 of 24 markers? are found"), std::string::npos)
      << summary(scene, kSecond_ns);
}

TEST(Picture, ContactsAreShownWhileTractionTouchRuns) {
  Later later;
  later.describe();
  later.frame();
  Contacts contacts;
  contacts.header.boot[0] = 77;  // of a daemon before
  contacts.header.arrived_ns = later.now;
  TrackedContact contact;
  contact.id = 4711;
  contact.phase = ContactPhase::kMove;
  contact.seen_ns = 2'300'000'000;
  contact.force_N = {0.0, 0.3, 0.4};
  contacts.contacts.push_back(contact);
  later.scene.add(contacts);
  EXPECT_NE(later.page().find("   4711    0.500  unknown   2.3 s"), std::string::npos) << later.page();
  EXPECT_NE(later.line().find("contact 4711 2.3 s 0.500 N stick unknown"), std::string::npos) << later.line();
  EXPECT_EQ(later.what(), "") << "the field is the present one's";
  contacts.contacts[0].slip.emplace().state = SlipState::kIncipient;
  contacts.contacts[0].slip->stickRatio.estimate = 0.62;
  later.scene.add(contacts);
  EXPECT_NE(later.page().find("   4711    0.500     0.62   2.3 s"), std::string::npos) << later.page();
  later.after(1.1).frame();
  EXPECT_EQ(later.page().find("4711"), std::string::npos);
}

TEST(Scale, RisesAtOnceAndFallsLate) {
  Scale scale;
  EXPECT_DOUBLE_EQ(scale.update(0.0, 0.015, 0), 0.02);
  EXPECT_DOUBLE_EQ(scale.update(0.13, 0.015, 0), 0.2);
  EXPECT_DOUBLE_EQ(scale.update(0.2, 0.015, 0), 0.2);
  EXPECT_DOUBLE_EQ(scale.update(0.03, 0.015, kSecond_ns), 0.2);
  EXPECT_DOUBLE_EQ(scale.update(0.03, 0.015, 3 * kSecond_ns), 0.05);
}

TEST(Scene, RateAndLatencyAreOfTheLastTwoSeconds) {
  Scene scene = sceneOf(fieldOf(0, 0, {}));
  for (int i = 1; i <= 300; ++i) {
    Field field;
    field.header.arrived_ns = kSecond_ns + i * kSecond_ns / 100;
    field.header.received_ns = field.header.arrived_ns - (i > 280 ? 5'000'000 : 1'000'000);
    scene.add(field);
  }
  const std::int64_t now = 4 * kSecond_ns;
  EXPECT_NEAR(scene.rate_hz(now), 100.0, 0.01);
  ASSERT_TRUE(scene.latency(now));
  EXPECT_DOUBLE_EQ(scene.latency(now)->p50_ms, 1.0);
  EXPECT_DOUBLE_EQ(scene.latency(now)->p99_ms, 5.0);
  EXPECT_LT(scene.rate_hz(now + kSecond_ns), 60.0);
  EXPECT_EQ(scene.rate_hz(now + 3 * kSecond_ns), 0.0);
}

TEST(Scene, AnotherHostsClockGivesNoLatency) {
  EXPECT_FALSE(sceneOf(fieldOf(0, 0, {}), false).latency(kSecond_ns));
}

TEST(Json, TextIsEscapedAndNumbersAreExact) {
  Description description;
  description.camera.vendor = "a\"b\\c\n";
  EXPECT_NE(toJson(description).find(R"("gel":null,)"), std::string::npos);  // without layers there is none
  description.layers.resize(1);
  description.gel.poissonRatio = 0.1;
  const std::string json = toJson(description);
  EXPECT_NE(json.find(R"("vendor":"a\"b\\c\u000a")"), std::string::npos);
  EXPECT_NE(json.find(R"("poisson_ratio":0.1,)"), std::string::npos);
}

}  // namespace
}  // namespace traction::client::picture_test
