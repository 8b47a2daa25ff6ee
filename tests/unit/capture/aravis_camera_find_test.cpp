// Finding the camera: by its names, among others, later, or held by another client.
#include "daemon/capture/camera_list.h"
#include "tests/unit/capture/aravis_camera_bench.h"

#include <future>
#include <map>
#include <utility>

namespace tractiond::capture::aravis_camera_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class AravisCameraNames : public AravisCameraTest, public testing::WithParamInterface<const char*> {};

TEST_P(AravisCameraNames, OpenTheCamera) {
  fake();
  options_.id = GetParam();
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->name.id, "Aravis-Fake-GV01");
  EXPECT_EQ(camera_->info()->name.address, "127.0.0.1");
  stream(3);
}

INSTANTIATE_TEST_SUITE_P(Kinds, AravisCameraNames,
                         testing::Values("", "Aravis-Fake-GV01", "Aravis-GV01", "127.0.0.1", "00:00:00:00:00:00"));

TEST_F(AravisCameraTest, ListsWhatIsThere) {
  fake();
  const FakeCamera other(FakeCamera::Options{.address = "127.0.0.2", .serial = "GV02"});
  const std::vector<CameraName> all = listCameras();
  std::map<std::string, CameraName> byAddress;
  for (const CameraName& name : all) byAddress[name.address] = name;
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(byAddress["127.0.0.1"].id, "Aravis-Fake-GV01");
  EXPECT_EQ(byAddress["127.0.0.2"].serial, "GV02");
  EXPECT_EQ(byAddress["127.0.0.2"].vendor, "Aravis");
  EXPECT_EQ(byAddress["127.0.0.2"].model, "Fake");
  EXPECT_EQ(byAddress["127.0.0.2"].protocol, "GigEVision");
}

TEST_F(AravisCameraTest, TellsTwoCamerasApart) {
  fake();
  const FakeCamera other(FakeCamera::Options{.address = "127.0.0.2", .serial = "GV02"});
  options_.id = "Aravis-GV02";
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->name.address, "127.0.0.2");
  stream(3);
}

TEST_F(AravisCameraTest, NamesTheCamerasInSightWhenItsOwnIsNot) {
  fake();
  options_.id = "Nobody-123";
  const Error error = openFails();
  EXPECT_EQ(error.exitCode, EX_UNAVAILABLE);
  EXPECT_THAT(error.message(), HasSubstr("Nobody-123"));
  EXPECT_THAT(error.message(), HasSubstr("Aravis-Fake-GV01"));
}

TEST_F(AravisCameraTest, WaitsForACameraThatComesLater) {
  options_.wait = true;
  std::vector<std::string> said;
  auto opened = openWith(ledger_, [&](LogLevel, const std::string& line) { said.push_back(line); });
  ASSERT_TRUE(opened) << opened.error().message();
  camera_ = std::move(*opened);
  EXPECT_THAT(said, ElementsAre(HasSubstr("waiting for a camera")));
  fake();
  stream(3);
  EXPECT_EQ(camera_->state(), CameraState::kStreaming);
}

TEST_F(AravisCameraTest, SaysThatAnotherClientHoldsTheCamera) {
  fake();
  ASSERT_NO_FATAL_FAILURE(open());
  Ledger other;
  const auto second = openWith(other);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().exitCode, EX_TEMPFAIL);
  EXPECT_THAT(second.error().message(), HasSubstr("held by another client"));
  stream(20);  // and the first one goes on
}

TEST_F(AravisCameraTest, TakesTheCameraOverWhenItsHolderLeaves) {
  fake();
  ASSERT_NO_FATAL_FAILURE(open());
  Ledger other;
  std::promise<void> held;
  auto second = std::async(std::launch::async, [&] {
    return openWith(other, [&, told = false](LogLevel, const std::string&) mutable {
      if (!std::exchange(told, true)) held.set_value();
    });
  });
  held.get_future().wait();
  camera_.reset();
  auto opened = second.get();
  ASSERT_TRUE(opened) << opened.error().message();
}

}  // namespace
}  // namespace tractiond::capture::aravis_camera_test
