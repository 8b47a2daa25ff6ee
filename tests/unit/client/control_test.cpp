// The client library's requests against the daemon's control server, and against forgeries.

#include "daemon/control/control_server.h"
#include "tests/unit/publish/support.h"
#include "traction/control.h"
#include "traction/v1/control.pb.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <csignal>
#include <limits>
#include <mutex>
#include <thread>

namespace traction::control_test {
namespace {

using namespace std::chrono_literals;
using tractiond::test::kHung;

class ControlTest : public testing::Test, tractiond::control::Requests, tractiond::publish::NewestMessages {
 protected:
  ControlTest() {
    auto opened = tractiond::control::ControlServer::open({"tcp://127.0.0.1:*"}, *this);
    if (!opened) throw std::runtime_error(opened.error().message());
    server_ = *std::move(opened);
    thread_ = std::thread([this] {
      while (!stop_) {
        server_->serve(10ms, *this);
        if (server_->takeCameraStep()) answerCamera();
      }
    });
  }
  ~ControlTest() override {
    stop_ = true;
    thread_.join();
  }

  Control control() {
    return Control({.endpoint = server_->endpoints().at(0), .timeout = kHung, .zeroTimeout = kHung});
  }

  void answerZero(tl::expected<tractiond::RestPose, std::string> zero) {
    const std::lock_guard lock(mutex_);
    zero_ = std::move(zero);
  }
  void keepReport(tractiond::CameraReport report) {
    const std::lock_guard lock(mutex_);
    report_ = std::move(report);
  }

  std::string lastStatus() const override {
    v1::Status status;
    status.set_uptime_s(12.0);
    status.set_camera(v1::CAMERA_STATE_WAITING);
    return status.SerializeAsString();
  }
  std::string lastDescription() const override {
    v1::Description description;
    description.set_software_version("0.1.0");
    return description.SerializeAsString();
  }
  void beginZero(const tractiond::ZeroRequest& /*request*/) override {
    const std::lock_guard lock(mutex_);
    server_->answerZero(zero_);
  }
  void beginStep(const tractiond::CalibrationStep& /*step*/) override {
    server_->answerCalibration(tl::unexpected<std::string>("there is no gel"));
  }
  void askSnapshot() override {}
  void answerCamera() {
    const std::lock_guard lock(mutex_);
    server_->answerCamera(report_);
  }

  std::unique_ptr<tractiond::control::ControlServer> server_;
  std::mutex mutex_;  // of the answers
  tl::expected<tractiond::RestPose, std::string> zero_;
  tractiond::CameraReport report_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST_F(ControlTest, StatusAndDescriptionAreTheDaemons) {
  EXPECT_EQ(control().status()->uptime_s(), 12.0);
  EXPECT_EQ(control().status()->camera(), v1::CAMERA_STATE_WAITING);
  EXPECT_EQ(control().description().softwareVersion, "0.1.0");
}

TEST_F(ControlTest, StepWhoseTimeIsNotFiniteIsRefused) {
  using Limits = std::numeric_limits<double>;
  CalibrationStep step;
  for (const double seconds : {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity()}) {
    step.seconds = seconds;
    try {
      control().calibrate(step);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kRefused);
      EXPECT_STREQ(error.what(), "the seconds of a step must be finite");
    }
  }
}

TEST_F(ControlTest, ZeroTellsWhatWasTaken) {
  answerZero(tractiond::publish::restPose());
  const ZeroResult result = control().zero();
  EXPECT_EQ(result.zero.id, tractiond::publish::idOf(50));
  EXPECT_EQ(result.markersPresent, 1U);
  EXPECT_EQ(result.markersExpected, 2U);
  EXPECT_EQ(result.noise_levels, 2.5);
}

TEST_F(ControlTest, RefusalIsTheDaemonsSentence) {
  answerZero(tl::make_unexpected(std::string("only 12 of 1152 markers were found")));
  try {
    control().zero();
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kRefused);
    EXPECT_STREQ(error.what(), "only 12 of 1152 markers were found");
  }
}

TEST_F(ControlTest, CameraTellsFeaturesWordByWord) {
  using Theirs = tractiond::CameraFeature;
  tractiond::CameraReport report;
  for (int kind = 0; kind <= static_cast<int>(Theirs::Kind::kRegister); ++kind) {
    report.features.push_back({.name = "F" + std::to_string(kind),
                               .kind = static_cast<Theirs::Kind>(kind),
                               .access = static_cast<Theirs::Access>(kind % 4)});
  }
  Theirs& whole = report.features[2];
  whole.value = "4000.5";
  whole.unit = "us";
  whole.minimum = 10.0;
  whole.maximum = std::numeric_limits<double>::quiet_NaN();
  whole.increment = 0.5;
  whole.entries = {"A", "B"};
  whole.description = "words";
  whole.configured = "5000";
  whole.first = "6000";
  whole.category = "AcquisitionControl";
  whole.selected = {"S=A"};
  report.remarks = {"one", "two"};
  report.camera = "Acme-42";
  keepReport(report);
  const CameraReport told = control().camera({});
  ASSERT_EQ(told.features.size(), report.features.size());
  for (std::size_t i = 0; i < told.features.size(); ++i) {
    EXPECT_EQ(told.features[i].name, report.features[i].name);
    EXPECT_EQ(static_cast<int>(told.features[i].kind), static_cast<int>(report.features[i].kind));
    EXPECT_EQ(static_cast<int>(told.features[i].access), static_cast<int>(report.features[i].access));
  }
  const CameraFeature& feature = told.features[2];
  EXPECT_EQ(feature.value, "4000.5");
  EXPECT_EQ(feature.unit, "us");
  EXPECT_EQ(feature.minimum, 10.0);
  EXPECT_FALSE(feature.maximum) << "no number on the wire is NaN";
  EXPECT_EQ(feature.increment, 0.5);
  EXPECT_EQ(feature.entries, (std::vector<std::string>{"A", "B"}));
  EXPECT_EQ(feature.description, "words");
  EXPECT_EQ(feature.configured, "5000");
  EXPECT_EQ(feature.first, "6000");
  EXPECT_EQ(feature.category, "AcquisitionControl");
  EXPECT_EQ(feature.selected, std::vector<std::string>{"S=A"});
  EXPECT_EQ(told.remarks, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(told.camera, "Acme-42");
}

TEST(Control, AZeroIsWaitedForAsLongAsTheDaemonSaysThatItMayTake) {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::rep);
  socket.bind("tcp://127.0.0.1:*");
  std::thread daemon([&] {
    zmq::message_t request;
    for (bool zero = false; !zero && socket.recv(request);) {
      v1::Request asked;
      asked.ParseFromArray(request.data(), static_cast<int>(request.size()));
      v1::Reply reply;
      reply.set_version(1);
      zero = asked.has_zero();
      if (zero) {
        std::this_thread::sleep_for(300ms);  // six times what the client would wait by itself
        reply.mutable_zero()->set_markers_present(7);
      } else {
        reply.mutable_status()->set_zero_within_s(60.0);
      }
      socket.send(zmq::buffer(reply.SerializeAsString()), zmq::send_flags::none);
    }
  });
  const Control control({.endpoint = socket.get(zmq::sockopt::last_endpoint), .timeout = kHung, .zeroTimeout = 50ms});
  EXPECT_NO_THROW(EXPECT_EQ(control.zero().markersPresent, 7U));
  daemon.join();
}

ErrorCode failureOf(const ControlOptions& options) {
  try {
    Control(options).status();
  } catch (const Error& error) {
    return error.code();
  }
  throw std::runtime_error("no error");
}

TEST(Control, NobodyIsTold) {
  EXPECT_EQ(failureOf({.endpoint = "ipc:///nowhere/control"}), ErrorCode::kNoAnswer);
  zmq::context_t context;
  zmq::socket_t silent(context, zmq::socket_type::rep);
  silent.bind("tcp://127.0.0.1:*");
  EXPECT_EQ(failureOf({.endpoint = silent.get(zmq::sockopt::last_endpoint), .timeout = 50ms}), ErrorCode::kNoAnswer);
  EXPECT_EQ(failureOf({.endpoint = "nonsense"}), ErrorCode::kBadEndpoint);
}

/// A deadline of days: a client that waits for it hangs.
TEST(Control, WhoGoesBeforeTheAnswerIsNotWaitedFor) {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::rep);
  socket.bind("tcp://127.0.0.1:*");
  const std::string endpoint = socket.get(zmq::sockopt::last_endpoint);
  std::thread server([&] {
    zmq::message_t request;
    EXPECT_TRUE(socket.recv(request));
    socket.set(zmq::sockopt::linger, 0);
    socket.close();
  });
  try {
    Control({.endpoint = endpoint, .timeout = 240h}).status();
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNoAnswer);
    EXPECT_NE(std::string(error.what()).find("has gone"), std::string::npos) << error.what();
  }
  server.join();
}

std::atomic<int> signalsSeen;

/// Handlers of signals run before each step of a request.
TEST(Control, SignalsDoNotEndARequest) {
  struct sigaction handler = {};
  struct sigaction before = {};
  handler.sa_handler = [](int) { ++signalsSeen; };
  ASSERT_EQ(sigaction(SIGUSR1, &handler, &before), 0);
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::rep);
  socket.bind("tcp://127.0.0.1:*");
  v1::Reply reply;
  reply.set_version(1);
  reply.mutable_status()->set_uptime_s(3.0);
  const std::string answer = reply.SerializeAsString();
  const std::jthread server([&, client = pthread_self()] {
    zmq::message_t request;
    ASSERT_TRUE(socket.recv(request));
    for (int i = 0; i < 100; ++i) {
      const int seen = signalsSeen;
      pthread_kill(client, SIGUSR1);
      while (signalsSeen == seen) std::this_thread::yield();
    }
    socket.send(zmq::buffer(answer), zmq::send_flags::none);
  });
  EXPECT_EQ(Control({.endpoint = socket.get(zmq::sockopt::last_endpoint), .timeout = kHung}).status()->uptime_s(), 3.0);
  sigaction(SIGUSR1, &before, nullptr);
}

}  // namespace
}  // namespace traction::control_test
