// The client library's requests where the daemon takes long, or goes. What it makes of answers: tests/conformance.

#include "tests/support/deadline.h"
#include "tests/support/temporary_folder.h"
#include "traction/control.h"
#include "traction/v1/control.pb.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <zmq.hpp>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <string>
#include <thread>

namespace traction::control_test {
namespace {

using namespace std::chrono_literals;
using tractiond::test::kHung;

TEST(Control, AStepWhoseTimeIsNotFiniteIsRefused) {
  using Limits = std::numeric_limits<double>;
  CalibrationStep step;
  for (const double seconds : {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity()}) {
    step.seconds = seconds;
    try {
      Control({.endpoint = "ipc:///nowhere/control"}).calibrate(step);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kRefused);
    }
  }
}

TEST(Control, ADaemonThatStartsLaterIsFound) {
  const tractiond::test::TemporaryFolder folder;
  setenv("XDG_RUNTIME_DIR", folder.path().c_str(), 1);
  const Control control({.instance = "left"});
  const std::filesystem::path at = folder.path() / "tractiond/left";
  std::filesystem::create_directories(at);
  zmq::context_t context;
  zmq::socket_t stream(context, zmq::socket_type::pub);
  stream.bind("ipc://" + (at / "stream").string());
  EXPECT_EQ(control.endpoint(), "ipc://" + (at / "control").string());
  unsetenv("XDG_RUNTIME_DIR");
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
