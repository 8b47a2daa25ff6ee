#include "daemon/control/control_server.h"
#include "tests/unit/publish/support.h"
#include "traction/v1/control.pb.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace tractiond::control::control_server_test {
namespace {

namespace pb = traction::v1;
using namespace std::chrono_literals;

class ControlTest : public testing::Test, Requests, publish::NewestMessages {
 protected:
  ControlTest() {
    pb::Status status;
    status.set_uptime_s(12.0);
    status_ = status.SerializeAsString();
    pb::Description description;
    description.set_software_version("0.1.0");
    description_ = description.SerializeAsString();
    open("tcp://127.0.0.1:*");
  }

  void open(const std::string& endpoint) {
    auto opened = ControlServer::open({endpoint}, *this);
    if (!opened) throw std::runtime_error(opened.error().message());
    server_ = *std::move(opened);
  }

  std::string lastStatus() const override { return status_; }
  std::string lastDescription() const override { return description_; }
  void beginZero(const ZeroRequest& request) override {
    ++zeros_;
    zero_ = request;
  }
  void beginStep(const CalibrationStep& step) override { steps_.push_back(step); }
  void askSnapshot() override { ++snapshots_; }

  void serve() {
    server_->serve(10ms, *this);
    while (const auto step = server_->takeCameraStep()) camera(*step);
  }

  zmq::socket_t connect(zmq::socket_type type) {
    zmq::socket_t socket(context_, type);
    socket.set(zmq::sockopt::linger, 0);
    socket.connect(server_->endpoints().at(0));
    return socket;
  }

  static std::string request(void (*choose)(pb::Request&), std::uint32_t version = 1) {
    pb::Request request;
    request.set_version(version);
    choose(request);
    return request.SerializeAsString();
  }
  static std::string statusRequest() {
    return request([](pb::Request& r) { r.mutable_status(); });
  }
  static std::string zeroRequest() {
    return request([](pb::Request& r) { r.mutable_zero(); });
  }
  static std::string undoRequest() {
    return request([](pb::Request& r) { r.mutable_zero()->set_undo(true); });
  }

  template <typename Condition>
  void serveUntil(Condition condition) {
    EXPECT_TRUE(test::eventually([&] {
      serve();
      return condition();
    }));
  }

  /// Serves until the asker has its reply.
  pb::Reply await(zmq::socket_t& socket) {
    pb::Reply reply;
    zmq::message_t message;
    serveUntil([&] { return bool(socket.recv(message, zmq::recv_flags::dontwait)); });
    if (message.size() == 0 && message.more()) (void)socket.recv(message, zmq::recv_flags::dontwait);  // a DEALER
    EXPECT_TRUE(reply.ParseFromArray(message.data(), static_cast<int>(message.size())));
    return reply;
  }

  /// Returns a client that has sent a request.
  zmq::socket_t asking(const std::string& bytes) {
    auto socket = connect(zmq::socket_type::req);
    socket.send(zmq::buffer(bytes), zmq::send_flags::none);
    return socket;
  }
  /// Returns a client whose request for a zero has arrived.
  zmq::socket_t askingForAZero(const std::string& bytes = zeroRequest()) {
    auto socket = asking(bytes);
    serveUntil([&, before = zeros_] { return zeros_ > before; });
    return socket;
  }
  static void send(zmq::socket_t& dealer, const std::string& bytes) {
    dealer.send(zmq::message_t(), zmq::send_flags::sndmore);
    dealer.send(zmq::buffer(bytes), zmq::send_flags::none);
  }

  static std::vector<std::string> receiveParts(zmq::socket_t& socket) {
    std::vector<std::string> parts;
    socket.set(zmq::sockopt::rcvtimeo, test::kHung_ms);
    for (bool more = true; more;) {
      zmq::message_t part;
      if (!socket.recv(part)) break;
      parts.push_back(part.to_string());
      more = part.more();
    }
    return parts;
  }

  pb::Reply ask(const std::string& bytes) {
    auto socket = asking(bytes);
    return await(socket);
  }

  /// A trigger is answered at once, everything else when the test says so.
  static CameraReport reportOf(const std::string& camera) {
    CameraReport report;
    report.set_camera(camera);
    return report;
  }
  void camera(const CameraStep& step) {
    cameraSteps_.push_back(step);
    if (step.has_trigger()) server_->answerCamera(reportOf("triggered"));
  }
  static std::string read(const std::string& name) {
    pb::Request request;
    request.set_version(1);
    request.mutable_camera()->mutable_read()->set_name(name);
    return request.SerializeAsString();
  }

  std::string status_, description_;
  std::vector<CameraStep> cameraSteps_;
  zmq::context_t context_;
  int zeros_ = 0;
  ZeroRequest zero_;
  int snapshots_ = 0;
  std::vector<CalibrationStep> steps_;
  std::unique_ptr<ControlServer> server_;
};

TEST_F(ControlTest, ZeroIsAnsweredWhenItIsTakenForAllWhoAsked) {
  auto one = askingForAZero(), two = connect(zmq::socket_type::dealer);
  send(two, zeroRequest());
  send(two, statusRequest());
  EXPECT_EQ(await(two).status().uptime_s(), 12.0);  // and what was sent before has come
  EXPECT_EQ(zeros_, 1);
  RestPose pose;
  pose.present = {1, 1, 0};
  server_->answerZero(pose);
  EXPECT_EQ(await(one).zero().markers_present(), 2U);
  EXPECT_EQ(await(two).zero().markers_expected(), 3U);
}

TEST_F(ControlTest, WhoAsksForAnotherZeroMeanwhileIsSentAway) {
  auto one = askingForAZero();
  EXPECT_FALSE(zero_.anyway || zero_.undo);
  EXPECT_EQ(zero_.asker, "127.0.0.1");
  EXPECT_EQ(ask(request([](pb::Request& r) { r.mutable_zero()->set_anyway(true); })).error(),
            "a zero is being taken; ask again");
  EXPECT_EQ(ask(undoRequest()).error(), "a zero is being taken; ask again");
  server_->answerZero(RestPose{});
  EXPECT_TRUE(await(one).error().empty());
  const auto two = askingForAZero(undoRequest());
  EXPECT_TRUE(zero_.undo);
}

TEST_F(ControlTest, ALocalAskerIsNamedByItsProcess) {
  open("ipc://@tractiond-control-test-" + std::to_string(getpid()));
  const auto socket = askingForAZero();
  EXPECT_EQ(zero_.asker, "uid " + std::to_string(getuid()) + ", pid " + std::to_string(getpid()));
}

TEST_F(ControlTest, WhoPassesRequestsOnNamesTheAskerAndIsNamed) {
  auto gateway = connect(zmq::socket_type::dealer);
  pb::Request asked;
  asked.set_version(1);
  asked.mutable_zero();
  asked.set_on_behalf_of("\"ada\" at 192.0.2.7\nforged: line \x1b[2J" + std::string(1000, 'x'));
  for (const char* asker : {"one", "two"}) {
    for (const std::string& part : {std::string(asker), std::string()}) {
      gateway.send(zmq::buffer(part), zmq::send_flags::sndmore);
    }
    gateway.send(zmq::buffer(asked.SerializeAsString()), zmq::send_flags::none);
  }
  // What was sent before the status has come when that is answered.
  gateway.send(zmq::buffer(std::string("three")), zmq::send_flags::sndmore);
  send(gateway, statusRequest());
  serveUntil([&] { return (gateway.get(zmq::sockopt::events) & ZMQ_POLLIN) != 0; });
  EXPECT_EQ(receiveParts(gateway).at(0), "three");
  EXPECT_TRUE(zero_.asker.starts_with("\"ada\" at 192.0.2.7?forged: line ?[2Jxx")) << zero_.asker;
  EXPECT_TRUE(zero_.asker.ends_with("xx through 127.0.0.1")) << zero_.asker;
  EXPECT_LT(zero_.asker.size(), 200U);
  EXPECT_EQ(zeros_, 1);
  server_->answerZero(RestPose{});
  for (const char* asker : {"one", "two"}) {
    const std::vector<std::string> parts = receiveParts(gateway);
    ASSERT_EQ(parts.size(), 3U);
    EXPECT_EQ(parts[0], asker);
    EXPECT_EQ(parts[1], "");
    pb::Reply reply;
    EXPECT_TRUE(reply.ParseFromString(parts[2]) && reply.has_zero());
  }
}

TEST_F(ControlTest, NoPeerWritesTheLog) {
  std::string bytes = read("Gain");
  bytes[bytes.find("Gain")] = '\xff';  // no UTF-8
  testing::internal::CaptureStderr();
  EXPECT_FALSE(ask(bytes).error().empty());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(ControlTest, PictureIsForAllWhoAsked) {
  const std::string wanted = request([](pb::Request& r) { r.mutable_snapshot(); });
  auto one = asking(wanted), two = connect(zmq::socket_type::dealer);
  serveUntil([&] { return snapshots_ > 0; });
  send(two, wanted);
  send(two, statusRequest());
  EXPECT_EQ(await(two).status().uptime_s(), 12.0);  // and what was sent before has come
  EXPECT_EQ(snapshots_, 1);
  server_->answerSnapshot(tl::make_unexpected(std::string("no frames come from the camera")), {});
  EXPECT_EQ(await(one).error(), "no frames come from the camera");
  EXPECT_EQ(await(two).error(), "no frames come from the camera");
}

TEST_F(ControlTest, StepOfACalibrationIsAnsweredWhenItIsDone) {
  auto socket = asking(request([](pb::Request& r) { r.mutable_calibrate()->mutable_noise()->set_duration_s(3.0); }));
  serveUntil([&] { return !steps_.empty(); });
  EXPECT_EQ(steps_[0].seconds, 3.0);
  // Another request ends the step that runs.
  auto other = asking(request([](pb::Request& r) { r.mutable_calibrate()->mutable_geometry(); }));
  EXPECT_EQ(await(socket).error(), "another step of the calibration was asked for");
  EXPECT_EQ(steps_.size(), 2U);
  server_->answerCalibration(
      CalibrationReport{.figures = {{"k1", -0.1, 0.01}}, .remarks = {}, .path = "", .gelFile = ""});
  EXPECT_EQ(await(other).calibrate().figures(0).name(), "k1");
  server_->answerCalibration(CalibrationReport{});  // nobody waits any more
}

TEST_F(ControlTest, OneGelFileAtATimeIsAdopted) {
  const auto adopt = [](const char* gelFile) {
    pb::Request wanted;
    wanted.set_version(1);
    wanted.mutable_adopt()->set_gel_file(gelFile);
    return wanted.SerializeAsString();
  };
  auto first = asking(adopt("one"));
  std::optional<std::string> taken;
  serveUntil([&] { return (taken = server_->takeGelFile()).has_value(); });
  EXPECT_EQ(taken, "one");
  EXPECT_EQ(server_->takeGelFile(), std::nullopt);
  EXPECT_EQ(ask(adopt("other")).error(), "another gel file is being adopted");
  EXPECT_EQ(server_->takeGelFile(), std::nullopt);
  server_->answerAdoption({});
  EXPECT_EQ(await(first).reply_case(), pb::Reply::kAdopt);

  first.send(zmq::buffer(adopt("wrong")), zmq::send_flags::none);
  serveUntil([&] { return server_->takeGelFile() == "wrong"; });
  server_->answerAdoption(tl::unexpected<std::string>("it is wrong"));
  EXPECT_EQ(await(first).error(), "it is wrong");
}

TEST_F(ControlTest, CameraIsAskedOneThingAfterAnother) {
  const std::string trigger = request([](pb::Request& r) { r.mutable_camera()->mutable_trigger(); });
  EXPECT_EQ(ask(trigger).camera().camera(), "triggered");
  auto one = asking(read("One")), others = connect(zmq::socket_type::dealer);
  serveUntil([&] { return cameraSteps_.size() >= 2; });
  for (const std::string& bytes : {read("Two"), trigger, statusRequest()}) send(others, bytes);
  EXPECT_EQ(await(others).status().uptime_s(), 12.0);         // and what was sent before has come
  EXPECT_EQ(ask(statusRequest()).status().uptime_s(), 12.0);  // nobody else waits
  EXPECT_EQ(cameraSteps_.size(), 2U);
  server_->answerCamera(reportOf("one"));
  EXPECT_EQ(await(one).camera().camera(), "one");
  serveUntil([&] { return cameraSteps_.size() >= 3; });
  EXPECT_EQ(cameraSteps_[2].read().name(), "Two");
  server_->answerCamera(tl::make_unexpected(std::string("no such feature")));
  EXPECT_EQ(await(others).error(), "no such feature");
  EXPECT_EQ(await(others).camera().camera(), "triggered");
  server_->answerCamera(CameraReport{});  // nobody waits any more
  EXPECT_EQ(cameraSteps_.size(), 4U);
}

TEST_F(ControlTest, UnknownAndMalformedRequestsGetAnError) {
  for (const std::string& bytes : {std::string(), std::string("\x08\x01"), std::string("no protobuf \xff\xff\xff"),
                                   std::string("\x08\x01\xba\x3e\x00", 5), std::string(60'000, '\xff'),
                                   request([](pb::Request& r) { r.mutable_status(); }, 2)}) {
    EXPECT_FALSE(ask(bytes).error().empty());
  }
  EXPECT_TRUE(ask(statusRequest()).error().empty());
}

TEST_F(ControlTest, TooLargeARequestIsCutOff) {
  auto socket = connect(zmq::socket_type::req);
  socket.send(zmq::message_t(64 * 1024 + 1), zmq::send_flags::none);
  EXPECT_EQ(ask(statusRequest()).status().uptime_s(), 12.0);
  zmq::message_t message;
  EXPECT_FALSE(socket.recv(message, zmq::recv_flags::dontwait));
}

TEST_F(ControlTest, AskerThatGoesAwayIsForgotten) {
  askingForAZero().close();
  server_->answerZero(RestPose{});
  EXPECT_EQ(ask(statusRequest()).status().uptime_s(), 12.0);
}

}  // namespace
}  // namespace tractiond::control::control_server_test
