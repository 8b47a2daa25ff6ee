#include "client/show/json.h"
#include "client/show/page.h"
#include "tests/unit/client/instrument.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace traction::client::picture_test {
namespace {

using test::fieldOf;
using test::has;
using test::Instrument;
using test::kSecond_ns;

std::vector<std::string> linesOf(std::string text) {
  std::vector<std::string> lines;
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

/// A second of fields, and a description.
Instrument described() {
  Instrument one;
  one.describe();
  for (int i = 0; i < 60; ++i) one.after(1.0 / 60.0).field();
  return one;
}

TEST(Picture, ArrowPointsAlongTheForceAtItsNode) {
  struct Case {
    int column, row;
    std::array<float, 3> force;
    const char* arrow;
  };
  for (const Case& c : {Case{0, 0, {1.0F, 0.0F, 0.0F}, "⇒"}, Case{23, 0, {0.0F, 1.0F, 0.0F}, "⇑"},
                        Case{0, 23, {-1.0F, 0.0F, 0.0F}, "⇐"}, Case{23, 23, {0.0F, -1.0F, 0.0F}, "⇓"},
                        Case{5, 17, {0.7F, 0.7F, 0.0F}, "⇗"}, Case{6, 3, {-0.7F, -0.7F, 0.0F}, "⇙"}}) {
    Instrument one;
    one.describe();
    one.field(fieldOf(c.column, c.row, c.force));
    const auto lines = linesOf(one.picture());
    // The bar and the frame's top stand above the highest row, the frame's left side before the first column.
    EXPECT_EQ(columnOf(lines.at(static_cast<std::size_t>(2 + 23 - c.row)), c.arrow), 1 + 2 * c.column) << c.arrow;
  }
}

TEST(Picture, EverySizeIsFilledAndNothingStandsOutside) {
  const Instrument one = described();
  for (const auto& [width, height] :
       {std::pair{20, 8}, {40, 12}, {44, 40}, {80, 24}, {100, 30}, {250, 80}, {1, 1}, {0, 0}}) {
    const auto lines = linesOf(one.picture(width, height));
    EXPECT_EQ(lines.size(), static_cast<std::size_t>(height));
    for (const std::string& line : lines) EXPECT_EQ(characters(line), width);
  }
}

// Independent of the reason, which may be known later.
TEST(Stale, NumbersLookSoWithinHalfASecond) {
  Instrument one = described();
  EXPECT_TRUE(has(one.after(0.3).picture(), " +3.750 "));
  EXPECT_TRUE(has(one.line(), "force +0.250 -0.500 +3.750 N"));
  one.after(0.2);
  for (const auto& [width, height] : {std::pair{100, 30}, {80, 24}, {44, 40}}) {
    const std::string page = one.picture(width, height);
    EXPECT_FALSE(has(page, " +3.750 ")) << page;
    for (const char* text : {"(+3.750)", "FORCE 0.5 s AGO", "no field for"}) EXPECT_TRUE(has(page, text)) << page;
  }
  EXPECT_TRUE(has(one.picture(20, 8), "no field")) << one.picture(20, 8);
  EXPECT_FALSE(has(one.line(), "3.750")) << one.line();
  EXPECT_TRUE(has(one.line(), "no force: no field for 0.5 s")) << one.line();
  one.field();
  EXPECT_EQ(one.trouble(), "");
  EXPECT_FALSE(has(one.picture(), "AGO"));
}

TEST(Stale, ReasonIsTheCamerasOrTheDaemons) {
  Instrument one = described();
  EXPECT_EQ(one.after(0.3).trouble(), "");
  one.after(0.3).camera(v1::CAMERA_STATE_LOST, 0.0);
  EXPECT_EQ(one.trouble(), "the camera is lost");
  one.camera(v1::CAMERA_STATE_LOST, 0.0, "it fell silent");
  EXPECT_EQ(one.trouble(), "the camera is lost: it fell silent");
  one.after(1.0).camera(v1::CAMERA_STATE_STREAMING, 0.0);
  EXPECT_EQ(one.trouble(), "the camera sends no frames");
  one.after(1.0).camera(v1::CAMERA_STATE_STREAMING);
  EXPECT_EQ(one.trouble(), "no field is made of the frames");
  EXPECT_EQ(one.after(3.0).trouble(), "tractiond is silent");
  one.watched.scene.setConnected(false, one.now);
  EXPECT_EQ(one.trouble(), "tractiond is gone");
  EXPECT_TRUE(has(one.after(10.0).picture(), "tractiond is gone, no field for 16 s")) << one.picture();
}

TEST(Stale, NothingOfAnEarlierStartIsShown) {
  Instrument one = described();
  Scene& scene = one.watched.scene;
  scene.setConnected(false, one.after(0.6).now);
  EXPECT_EQ(one.trouble(), "tractiond is gone");
  EXPECT_TRUE(has(one.picture(), "(+3.750)"));
  one.boot = Id{2};
  scene.setConnected(true, one.after(5.0).now);
  EXPECT_EQ(one.after(1.5).trouble(), "tractiond is starting") << "it is not silent who has not spoken yet";
  one.after(0.1).camera(v1::CAMERA_STATE_WAITING, 0.0);
  EXPECT_EQ(one.trouble(), "tractiond was restarted: tractiond waits for a camera");
  EXPECT_FALSE(has(one.picture(), "3.750")) << one.picture();
  EXPECT_TRUE(has(one.after(3.0).line(), "for 3.0 s")) << one.line();
  one.field();
  EXPECT_EQ(one.trouble(), "");
  EXPECT_TRUE(has(one.line(), "! tractiond restarted")) << one.line();
  one.after(20.0).field();
  EXPECT_FALSE(has(one.line(), "restarted")) << one.line();
}

TEST(Stale, SlowCameraIsNotCalledSoBetweenItsFrames) {
  Instrument one = described();
  for (int i = 0; i < 5; ++i) one.after(0.9).field();
  EXPECT_EQ(one.after(0.9).trouble(), "");
  EXPECT_EQ(one.after(2.0).trouble(), "tractiond is silent");
}

TEST(Picture, ZeroHasNoMinusAndIsNoDeviation) {
  Field field = fieldOf(0, 0, {-0.0001F, 0.0F, -0.2F});
  field.resultantCovariance_N2.noise = {1e-10, 0, 0, 0, 1e-4, 0, 0, 0, 0};
  Instrument one;
  one.describe();
  one.field(field);
  const std::string page = one.picture();
  EXPECT_FALSE(has(page, "-0.00")) << page;
  for (const char* text : {"+0.000 ±2e-05 N", "+0.000 ±0.020 N", "-0.200 N  into"})
    EXPECT_TRUE(has(page, text)) << text << '\n' << page;
  EXPECT_EQ(format("%+.1f %+.1f %d", -0.04, -0.06, -100), "+0.0 -0.1 -100");
  EXPECT_EQ(format("%.1f at 2026-00", -0.04), "0.0 at 2026-00");
}

TEST(Picture, ContactsAreShownWhileTractionTouchRuns) {
  Instrument one = described();
  one.field();
  Contacts contacts;
  TrackedContact& contact = contacts.contacts.emplace_back();
  contact.id = 4711;
  contact.phase = ContactPhase::kMove;
  contact.seen_ns = 2'300'000'000;
  contact.force_N = {0.0, 0.3, 0.4};
  one.boot = Id{77};  // of a daemon before
  one.send(contacts);
  EXPECT_TRUE(has(one.picture(), "   4711    0.500  unknown   2.3 s")) << one.picture();
  EXPECT_TRUE(has(one.line(), "contact 4711 2.3 s 0.500 N stick unknown")) << one.line();
  EXPECT_EQ(one.trouble(), "") << "the field is the present one's";
  contact.slip.emplace().state = SlipState::kIncipient;
  contact.slip->stickRatio.estimate = 0.62;
  one.send(contacts);
  EXPECT_TRUE(has(one.picture(), "   4711    0.500     0.62   2.3 s")) << one.picture();
  one.boot = Id{1};
  one.after(1.1).field();
  EXPECT_FALSE(has(one.picture(), "4711"));
}

TEST(Scene, RateAndLatencyAreOfTheLastTwoSeconds) {
  Instrument one;
  one.describe();
  for (int i = 1; i <= 300; ++i) {
    Field field;
    field.header.received_ns = one.after(0.01).now - (i > 280 ? 5'000'000 : 1'000'000);
    one.field(field);
  }
  const Scene& scene = one.watched.scene;
  EXPECT_NEAR(scene.rate_hz(one.now), 100.0, 0.01);
  ASSERT_TRUE(scene.latency(one.now));
  EXPECT_DOUBLE_EQ(scene.latency(one.now)->p50_ms, 1.0);
  EXPECT_DOUBLE_EQ(scene.latency(one.now)->p99_ms, 5.0);
  EXPECT_LT(scene.rate_hz(one.now + kSecond_ns), 60.0);
  EXPECT_EQ(scene.rate_hz(one.now + 3 * kSecond_ns), 0.0);
  one.describe(false);
  EXPECT_FALSE(scene.latency(one.now)) << "of another host's clock";
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
