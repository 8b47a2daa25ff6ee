#include "client/show/board.h"
#include "client/show/health.h"
#include "client/show/metrics.h"
#include "client/show/picture.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>

namespace traction::client::health_test {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

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
  Watched one;
  one.name = "left";
  Scene& scene = one.scene;
  scene.setConnected(true, kSecond_ns);
  const auto add = [&](std::uint32_t flags, bool valid, std::int64_t at_ns) {
    Field field;
    field.valid = valid;
    field.header.flags = flags;
    field.header.arrived_ns = at_ns;
    scene.add(field);
  };
  const auto message = std::make_shared<v1::Status>(measuring());
  message->mutable_markers()->set_remark("something hides blue markers");
  message->mutable_scheduling()->set_asked_lock(true);
  Status status{{}, message};
  status.header.arrived_ns = 2 * kSecond_ns;
  scene.add(status);
  const std::int64_t now_ns = 3 * kSecond_ns;
  add(kTorn, true, now_ns - kSecond_ns);
  add(0, true, now_ns);  // of late one was torn
  const auto bothShow = [&](const std::string& text) {
    EXPECT_NE(summary(scene, now_ns).find(text), std::string::npos) << text << " in " << summary(scene, now_ns);
    EXPECT_NE(boardLine(one, now_ns).find(text), std::string::npos) << text << " in " << boardLine(one, now_ns);
  };
  EXPECT_EQ(healthOf(problems(scene, now_ns)), Health::kDoubtful);
  for (const char* text : {"picture torn", "something hides blue markers", "real time is not granted: memory"})
    bothShow(text);

  add(kFewMarkers, false, now_ns);
  EXPECT_EQ(healthOf(problems(scene, now_ns)), Health::kNoForces);
  bothShow("too few markers are seen");
  message->set_invalid_why("12 of 400 markers");
  bothShow("12 of 400 markers");
  message->set_camera(v1::CAMERA_STATE_LOST);
  EXPECT_EQ(healthOf(problems(scene, now_ns + 5 * kSecond_ns)), Health::kNoFields);
}

}  // namespace
}  // namespace traction::client::health_test
