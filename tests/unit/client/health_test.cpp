#include "client/show/health.h"
#include "client/show/metrics.h"
#include "tests/unit/client/instrument.h"

#include <gtest/gtest.h>

#include <functional>
#include <iostream>
#include <memory>

namespace traction::client::health_test {
namespace {

v1::Status measuring() {
  v1::Status status;
  status.set_camera(v1::CAMERA_STATE_STREAMING);
  status.mutable_rates()->set_received_hz(60.0);
  status.mutable_rates()->set_published_hz(60.0);
  status.mutable_markers()->add_layers();
  return status;
}

TEST(Health, IsThatOfTheWorstProblemOfAStatusAlsoAsAMetric) {
  struct Case {
    std::function<void(v1::Status&)> change;
    Health health;
    std::vector<std::string> problems;
  };
  const std::vector<Case> cases = {
      {[](v1::Status&) {}, Health::kMeasuring, {}},
      {[](v1::Status& s) { s.set_camera(v1::CAMERA_STATE_LOST), s.set_camera_why("it is silent"); },
       Health::kNoFields,
       {"camera lost, being looked for (it is silent)"}},
      {[](v1::Status& s) { s.mutable_markers()->clear_layers(), s.mutable_markers()->set_remark("no gel"); },
       Health::kNoFields,
       {"no gel"}},
      {[](v1::Status& s) { s.mutable_rates()->Clear(); }, Health::kNoFields, {"the camera sends no frames"}},
      {[](v1::Status& s) { s.mutable_rates()->Clear(), s.set_camera_why("it waits for triggers"); },
       Health::kNoFields,
       {"the camera sends no frames: it waits for triggers"}},
      {[](v1::Status& s) { s.mutable_rates()->set_published_hz(0.0), s.set_camera_why("it repeats one picture"); },
       Health::kNoFields,
       {"the camera sends nothing new: it repeats one picture"}},
      {[](v1::Status& s) { s.set_camera_why("it repeats one picture"); },
       Health::kDoubtful,
       {"the camera sends nothing new: it repeats one picture"}},
      {[](v1::Status& s) { s.mutable_rates()->set_published_hz(0.0); },
       Health::kNoFields,
       {"no field is made of the frames"}},
      {[](v1::Status& s) { s.set_invalid_why("too few"), s.mutable_markers()->set_remark("a hand"); },
       Health::kNoForces,
       {"no valid forces: too few", "a hand"}},
      {[](v1::Status& s) { s.mutable_markers()->set_remark("a hand"); }, Health::kDoubtful, {"a hand"}},
      {[](v1::Status& s) { s.mutable_scheduling()->set_asked_lock(true); },
       Health::kDoubtful,
       {"real time is not granted: memory"}},
  };
  for (const Case& one : cases) {
    const auto status = std::make_shared<v1::Status>(measuring());
    one.change(*status);
    const std::vector<Problem> found = problems(*status);
    std::vector<std::string> sentences;
    for (const Problem& problem : found) sentences.push_back(sentence(problem));
    EXPECT_EQ(sentences, one.problems);
    EXPECT_EQ(healthOf(found), one.health);
    const std::string text = metricsText({{"left", Status{{}, status}}});
    EXPECT_NE(text.find(std::string("traction_health{instance=\"left\",state=\"") + nameOf(one.health) + "\"} 1\n"),
              std::string::npos)
        << text;
  }
}

TEST(Health, WatchAndTopShowTheSameProblems) {
  test::Instrument one;
  one.status = measuring();
  one.status.mutable_markers()->set_remark("something hides blue markers");
  one.status.mutable_scheduling()->set_asked_lock(true);
  one.sendStatus();
  one.flags = kTorn;
  one.field();
  one.flags = 0;
  one.after(1.0).field();  // of late one was torn
  const auto bothShow = [&](const std::string& text) {
    EXPECT_TRUE(test::has(one.line(), text)) << text << " in " << one.line();
    const std::string line = boardLine(one.watched, one.now);
    EXPECT_TRUE(test::has(line, text)) << text << " in " << line;
  };
  const auto health = [&] { return healthOf(problems(one.watched.scene, one.now)); };
  EXPECT_EQ(health(), Health::kDoubtful);
  for (const char* text : {"picture torn", "something hides blue markers", "real time is not granted: memory"})
    bothShow(text);

  one.flags = kFewMarkers;
  one.field(Field());
  EXPECT_EQ(health(), Health::kNoForces);
  bothShow("too few markers are seen");
  one.status.set_invalid_why("12 of 400 markers");
  one.sendStatus();
  bothShow("12 of 400 markers");
  one.status.set_camera(v1::CAMERA_STATE_LOST);
  one.sendStatus();
  one.after(5.0);
  EXPECT_EQ(health(), Health::kNoFields);
}

// It is so after each first start: no line of a newcomer's first demo warns of it.
TEST(Health, AZeroThatNobodyRequestedIsANoteAndNoWarning) {
  test::Instrument one;
  one.status = measuring();
  one.sendStatus();
  one.flags = kZeroUnverified;
  one.field();
  const std::vector<Problem> found = problems(one.watched.scene, one.now);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().what, "zero not verified");
  EXPECT_EQ(healthOf(found), Health::kMeasuring);
  EXPECT_FALSE(test::has(one.line(), "!")) << one.line();
  std::cout << "  a zero that nobody requested: " << one.line() << "; right: a note, no warning\n";
}

}  // namespace
}  // namespace traction::client::health_test
