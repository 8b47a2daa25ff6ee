// The client library against the daemon's publisher, and against forgeries.

#include "tests/support/seed.h"
#include "tests/unit/publish/support.h"
#include "traction/subscriber.h"
#include "traction/v1/field.pb.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <random>
#include <thread>

namespace traction::subscriber_test {
namespace {

using namespace std::chrono_literals;
using tractiond::publish::Description;
using tractiond::publish::idOf;
using tractiond::publish::TestClock;
using tractiond::test::eventually;
using tractiond::test::kHung;
using tractiond::test::kHung_ms;

constexpr int kMarkerCount = 1152;
constexpr int kNodeCount = 576;

SubscriberOptions at(const std::string& endpoint, unsigned topics = kAllTopics, Mode mode = Mode::kStream) {
  SubscriberOptions options;
  options.endpoint = endpoint;
  options.topics = topics;
  options.mode = mode;
  options.monotonicClock = TestClock::monotonic;
  return options;
}

void expectConnected(Subscriber& subscriber, bool connected) {
  EXPECT_TRUE(eventually([&] {
    TestClock::advance(10ms);
    subscriber.receive(10ms);
    return subscriber.isConnected() == connected;
  }));
}

class SubscriberTest : public testing::Test {
 protected:
  SubscriberTest() { open(tractiond::publish::description()); }

  void open(const Description& description, const std::string& stream = "tcp://127.0.0.1:*") {
    publisher_.reset();
    auto opened = tractiond::publish::Publisher::open(tractiond::publish::options({stream}), description, ledger_, {});
    if (!opened) throw std::runtime_error(opened.error().message());
    publisher_ = *std::move(opened);
    stream_ = publisher_->streamEndpoints().at(0);
    latest_ = publisher_->latestEndpoints().at(0);
  }

  /// Publishes until a message of this kind arrives.
  template <typename Kind>
  Kind await(Subscriber& subscriber) {
    std::optional<Kind> found;
    const bool arrived = eventually([&] {
      TestClock::advance(50ms);
      publisher_->wait(-1, 0ms);
      publisher_->publish(field_);
      while (auto message = subscriber.receive(5ms)) {
        if (auto* kind = std::get_if<Kind>(&*message)) {
          found = std::move(*kind);
          break;
        }
      }
      return found.has_value();
    });
    if (!arrived) throw std::runtime_error("nothing arrived");
    return *std::move(found);
  }

  tractiond::TractionField field_ = tractiond::publish::traction(kMarkerCount, kNodeCount, 70'000);
  tractiond::Ledger ledger_;
  std::unique_ptr<tractiond::publish::Publisher> publisher_;
  std::string stream_, latest_;
};

void expectHeader(const Header& header) {
  EXPECT_GT(header.sequence, 0U);
  EXPECT_EQ(header.sensor, "gel-1");
  EXPECT_EQ(header.boot, idOf(10));
  EXPECT_EQ(header.calibration, idOf(20));
  EXPECT_EQ(header.zero, idOf(100));
  EXPECT_EQ(header.cameraFrameId, 70'000 % 65535 + 1U);
  EXPECT_EQ(header.frameNumber, 70'000U);
  EXPECT_EQ(header.deviceTime_ns, 777'070'000);
  EXPECT_EQ(header.exposure_s, 0.004);
  EXPECT_EQ(header.receivedReal_ns, 1'700'000'000'000'000'001);
  EXPECT_EQ(header.captured_ns, 990'000'000);
  EXPECT_EQ(header.capturedError_ns, 12'345);
  EXPECT_EQ(header.capturedBound, CaptureBound::kBoth);
  EXPECT_EQ(header.received_ns, 1'000'000'000);
  EXPECT_EQ(header.tracked_ns, 1'000'200'000);
  EXPECT_EQ(header.solved_ns, 1'000'350'000);
  EXPECT_GT(header.sent_ns, 0);
  EXPECT_EQ(header.arrived_ns, TestClock::now_ns);
}

TEST_F(SubscriberTest, FieldArrivesNumberByNumber) {
  Subscriber subscriber(at(stream_));
  const Field field = await<Field>(subscriber);
  expectHeader(field.header);
  EXPECT_EQ(field.header.flags, kZeroUnverified);
  EXPECT_TRUE(field.valid);
  ASSERT_EQ(field.force_N.size(), std::size_t{kNodeCount});
  EXPECT_EQ(field.force_N[1], (std::array{3.125F, 4.125F, 5.125F}));
  EXPECT_EQ(field.nodeValid, std::vector<std::uint8_t>(kNodeCount, 1));
  EXPECT_EQ(field.resultant_N, (Vector3{1.0, 2.0, 3.0}));
  EXPECT_EQ(field.moment_Nm, (Vector3{4.0, 5.0, 6.0}));
  EXPECT_EQ(field.centreOfPressure_m, (Vector2{7.0, 8.0}));
  EXPECT_TRUE(field.centreOfPressureValid);
  EXPECT_EQ(field.resultantCovariance_N2.noise, (Matrix3{11, 12, 13, 21, 22, 23, 31, 32, 33}));
  EXPECT_EQ(field.resultantCovariance_N2.systematic, (Matrix3{111, 112, 113, 121, 122, 123, 131, 132, 133}));
  EXPECT_EQ(field.momentCovariance_N2m2.noise, (Matrix3{44, 45, 46, 54, 55, 56, 64, 65, 66}));
  EXPECT_EQ(field.momentCovariance_N2m2.systematic, (Matrix3{144, 145, 146, 154, 155, 156, 164, 165, 166}));
  EXPECT_EQ(field.resultantMomentCovariance_N2m.noise, (Matrix3{14, 15, 16, 24, 25, 26, 34, 35, 36}));
  EXPECT_EQ(field.resultantMomentCovariance_N2m.systematic, (Matrix3{114, 115, 116, 124, 125, 126, 134, 135, 136}));
  EXPECT_EQ(field.residual_px, 9.0);
  EXPECT_EQ(field.validMarkers, kMarkerCount - 1U);
  EXPECT_EQ(field.nodeDeviation_N[1], (std::array{3.0625F, 4.0625F, 5.0625F}));
  EXPECT_EQ(field.method, Method::kBlend);
  EXPECT_EQ(field.regularisation_px_per_N, 10.0);
  EXPECT_EQ(field.pictureMotion.shift_px, (Vector2{11.0, 12.0}));
  EXPECT_EQ(field.pictureMotion.scale, 13.0);
  EXPECT_EQ(field.pictureMotion.roll_rad, 14.0);
  ASSERT_EQ(field.contacts.size(), 2U);
  EXPECT_EQ(field.contacts[1].position_m, (Vector2{13.0, 14.0}));
  EXPECT_EQ(field.contacts[1].positionDeviation_m, (Vector2{15.0, 16.0}));
  EXPECT_EQ(field.contacts[1].force_N, (Vector3{17.0, 18.0, 19.0}));
  EXPECT_EQ(field.contacts[1].forceDeviation_N, (Vector3{20.0, 21.0, 22.0}));
  EXPECT_EQ(field.contacts[1].area_m2, 23.0);
  EXPECT_EQ(field.contacts[1].areaDeviation_m2, 24.0);
}

TEST_F(SubscriberTest, MarkersArriveNumberByNumber) {
  Subscriber subscriber(at(stream_));
  const Markers markers = await<Markers>(subscriber);
  expectHeader(markers.header);
  EXPECT_EQ(markers.header.flags, std::uint32_t{kZeroUnverified | kReacquiring});
  ASSERT_EQ(markers.displacement_px.size(), std::size_t{kMarkerCount});
  EXPECT_EQ(markers.displacement_px[1], (std::array{2.5F, 3.5F}));
  EXPECT_EQ(markers.variance_px2[2], 2.25F);
  EXPECT_EQ(markers.valid[0], 1);
  EXPECT_EQ(markers.valid[kMarkerCount - 1], 0);
  EXPECT_EQ(markers.validMarkers, kMarkerCount - 1U);
}

/// Two nodes and one marker.
std::shared_ptr<const sensor::Body> smallBody() {
  sensor::Body body;
  body.nodes = (sensor::Points(3, 2) << 1, 4, 2, 5, 3, 6).finished();
  body.normals = sensor::Points(Eigen::Vector3d::UnitZ().replicate(1, 2));
  body.areas = Eigen::Vector2d(0.25, 0.5);
  body.markers = Eigen::Vector3d(7, 8, 9);
  return std::make_shared<const sensor::Body>(body);
}

TEST_F(SubscriberTest, DescriptionWithoutAGelSaysSo) {
  Description told = tractiond::publish::description();
  told.sensor.reset();
  told.width_px = 333;
  open(told);
  Subscriber subscriber(at(stream_));
  const auto description = await<traction::Description>(subscriber);
  EXPECT_FALSE(description.hasGel());
  EXPECT_EQ(description.nodes.columns, 0U);
  EXPECT_EQ(description.camera.width_px, 333U);
  EXPECT_EQ(description.camera.aspect, 1.0) << "what does not travel is square pixels, as of older daemons";
  EXPECT_EQ(description.camera.model, "Eye");
}

TEST_F(SubscriberTest, DescriptionArrivesFirstAndNumberByNumber) {
  Description told = tractiond::publish::description();
  told.sensor->body = smallBody();
  told.host = tractiond::publish::hostId();
  told.zero = tractiond::publish::restPose();
  told.sensor->camera.aspect = 1.035;
  open(told);
  Subscriber subscriber(at(stream_));
  std::optional<Message> first;
  while (!first) {
    TestClock::advance(50ms);
    publisher_->wait(-1, 5ms);
    first = subscriber.receive(5ms);
  }
  ASSERT_TRUE(std::holds_alternative<traction::Description>(*first));
  const auto& description = std::get<traction::Description>(*first);
  EXPECT_EQ(description.header.sensor, "gel-1");
  EXPECT_EQ(description.softwareVersion, "0.1.0");
  EXPECT_TRUE(description.sameHost);
  EXPECT_EQ(description.topics.size(), 5U);
  EXPECT_TRUE(description.hasGel());
  EXPECT_EQ(description.gel.youngsModulus_Pa, 0.18e6);
  EXPECT_EQ(description.gel.poissonRatio, 0.49);
  EXPECT_EQ(description.gel.size_m, (Vector3{0.1, 0.1, 0.04}));
  ASSERT_EQ(description.layers.size(), 2U);
  EXPECT_EQ(description.layers[0].colour, Colour::kGreen);
  EXPECT_TRUE(description.layers[0].darker);
  EXPECT_EQ(description.layers[1].colour, Colour::kRed);
  EXPECT_FALSE(description.layers[1].darker);
  EXPECT_EQ(description.layers[1].depth_m, 8e-3);
  EXPECT_EQ(description.layers[1].diameter_m, 0.6e-3);
  EXPECT_EQ(description.layers[1].grid.centre_m, (Vector2{1.5e-3, 1.5e-3}));
  EXPECT_EQ(description.nodes.columns, 24U);
  EXPECT_EQ(description.nodes.rows, 24U);
  EXPECT_DOUBLE_EQ(description.nodes.position_m(0, 0)[0], -34.5e-3);
  EXPECT_DOUBLE_EQ(description.nodes.position_m(0, 23)[1], 34.5e-3);
  EXPECT_EQ(description.camera.vendor, "Acme");
  EXPECT_EQ(description.camera.pixelFormat, "RGB8");
  EXPECT_EQ(description.camera.width_px, 640U);
  EXPECT_EQ(description.camera.aspect, 1.035);
  EXPECT_EQ(description.camera.principal_px, (Vector2{319.5, 239.5}));
  EXPECT_EQ(description.camera.position_m[2], 157e-3);
  ASSERT_TRUE(description.body);
  EXPECT_EQ(description.body->nodePositions_m, (std::vector<std::array<float, 3>>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(description.body->nodeNormals, (std::vector<std::array<float, 3>>{{0, 0, 1}, {0, 0, 1}}));
  EXPECT_EQ(description.body->nodeAreas_m2, (std::vector<float>{0.25F, 0.5F}));
  EXPECT_EQ(description.body->markerPositions_m, (std::vector<std::array<float, 3>>{{7, 8, 9}}));
  EXPECT_EQ(description.solver.mechanics, "block");
  EXPECT_EQ(description.solver.strength, 1e-3);
  EXPECT_EQ(description.calibration.id, idOf(20));
  EXPECT_EQ(description.calibration.time_ns, told.calibrated_ns);
  ASSERT_TRUE(description.zero);
  EXPECT_EQ(description.zero->id, idOf(50));
  EXPECT_TRUE(description.zero->requested);
  EXPECT_EQ(description.zero->restPosition_px[1], (std::array{3.0F, 4.0F}));
  EXPECT_EQ(description.zero->markerPresent, (std::vector<std::uint8_t>{1, 0}));
}

TEST_F(SubscriberTest, StatusArrivesWithTheLedger) {
  ledger_.received.add(100);
  ledger_.published.add(90);
  ledger_.stale.add(7);
  ledger_.missing.add(5);
  Subscriber subscriber(at(stream_, kStatus));
  const Status status = await<Status>(subscriber);
  EXPECT_EQ(status.camera, CameraState::kUnknown);
  EXPECT_EQ(status.ledger.received, 100U);
  EXPECT_EQ(status.ledger.published, 90U);
  EXPECT_EQ(status.ledger.stale, 7U);
  EXPECT_EQ(status.ledger.losses(), 7U);
  EXPECT_EQ(status.ledger.inFlight, 3U);
  EXPECT_EQ(status.ledger.missing, 5U);
  EXPECT_DOUBLE_EQ(status.track.p50_s, 200e-6);
  EXPECT_GT(status.published_hz, 0.0);
}

TEST_F(SubscriberTest, OtherTopicsAreLeftOut) {
  Subscriber subscriber(at(stream_, kMarkers));
  await<Markers>(subscriber);
  for (int i = 0; i < 3; ++i) publisher_->publish(field_);
  for (int i = 0; i < 3; ++i) {
    const auto message = subscriber.receive(kHung);
    ASSERT_TRUE(message);
    EXPECT_TRUE(std::holds_alternative<Markers>(*message));
  }
}

TEST_F(SubscriberTest, PreviewsAreMadeForWhoWantsThem) {
  {
    Subscriber subscriber(at(stream_));
    await<Field>(subscriber);
    EXPECT_FALSE(publisher_->previewWanted());
  }
  Subscriber subscriber(at(stream_, kPreview));
  std::optional<Message> message;
  for (int i = 0; i < 1000 && !message; ++i) {
    publisher_->wait(-1, 0ms);
    publisher_->publish(field_);
    if (publisher_->previewWanted()) {
      publisher_->offerPreview(
          {.picture = {1, 2, 3, {1, 2, 3, 4, 5, 6}}, .factor = 2, .info = {}, .flags = 0, .zero = {}});
    }
    message = subscriber.receive(5ms);
  }
  ASSERT_TRUE(message && std::holds_alternative<Preview>(*message));
  const auto& preview = std::get<Preview>(*message);
  EXPECT_EQ(preview.header.sensor, "gel-1");
  EXPECT_EQ(preview.width, 1U);
  EXPECT_EQ(preview.height, 2U);
  EXPECT_EQ(preview.channels, 3U);
  EXPECT_EQ(preview.pixels, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(preview.scale, 2.0);
  EXPECT_EQ(preview.origin_px, (Vector2{0.5, 0.5}));
}

TEST_F(SubscriberTest, LatestGivesFields) {
  Subscriber subscriber(at(latest_, kAllTopics, Mode::kLatest));
  expectHeader(await<Field>(subscriber).header);
  EXPECT_EQ(subscriber.lost(), 0U);
}

TEST_F(SubscriberTest, NothingComesAfterTheTimeout) {
  Subscriber subscriber(at(stream_, kField));
  EXPECT_FALSE(subscriber.receive(1ms));
}

TEST_F(SubscriberTest, ConnectionIsTold) {
  Subscriber alone(at("ipc://@traction-nobody-is-here"));
  EXPECT_FALSE(alone.isConnected());
  Subscriber subscriber(at(stream_));
  expectConnected(subscriber, true);
}

/// Returns a socket that listens at a path.
int listenAt(const std::string& path) {
  std::filesystem::remove(path);  // ZeroMQ leaves it there
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const auto* any = reinterpret_cast<const sockaddr*>(&address);
  if (bind(listener, any, sizeof address) != 0 || listen(listener, 8) != 0) throw std::runtime_error("no socket");
  return listener;
}

/// Listens where a publisher might, and is none: each that connects is sent some bytes and hung up on.
class Stranger {
 public:
  Stranger(std::string socket, std::vector<std::string> greetings)
      : socket_(std::move(socket))
      , greetings_(std::move(greetings))
      , listener_(listenAt(socket_))
      , thread_([this] { run(); }) {}
  ~Stranger() {
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    close(listener_);
    std::filesystem::remove(socket_);
  }
  std::size_t met() const { return met_; }

 private:
  void run() {
    for (int peer; (peer = accept(listener_, nullptr, nullptr)) >= 0; close(peer)) {
      const std::string& greeting = greetings_[met_ % greetings_.size()];
      (void)!write(peer, greeting.data(), greeting.size());
      std::this_thread::sleep_for(5ms);
      ++met_;
    }
  }

  std::string socket_;  ///< a path
  std::vector<std::string> greetings_;
  std::atomic<std::size_t> met_{0};
  int listener_;
  std::thread thread_;
};

/// As ZMTP 3.1 begins: signature, version, mechanism.
std::string greeting(const std::string& mechanism) {
  std::string text("\xff\0\0\0\0\0\0\0\1\x7f\3\1", 12);
  text += mechanism;
  text.resize(64, '\0');
  return text;
}

/// A folder for a socket, whose name nobody else can take meanwhile as they could a port.
class SocketTest : public testing::Test {
 protected:
  ~SocketTest() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ = []() -> std::filesystem::path {  // made before `pattern` ends
    std::string pattern = testing::TempDir() + "traction-XXXXXX";
    return mkdtemp(pattern.data());
  }();
  const std::string path_ = folder_ / "stream", endpoint_ = "ipc://" + path_;
};

TEST_F(SocketTest, HandshakesThatFailAreNoConnectionsAndAreNotHeldAgainstALaterOne) {
  std::mt19937 random(tractiond::test::seed());
  std::vector<std::string> greetings = {
      "", "HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\nConnection: close\r\n\r\n", greeting("NULL"),
      greeting("PLAIN"), greeting("NULL") + std::string("\4\5\5READY")};
  std::shuffle(greetings.begin(), greetings.end(), random);
  auto stranger = std::make_unique<Stranger>(path_, greetings);
  Subscriber subscriber(at(endpoint_));
  const std::size_t handshakes = 2 + random() % 6;
  while (stranger->met() < handshakes) {
    TestClock::advance(10ms);
    subscriber.receive(10ms);
    ASSERT_FALSE(subscriber.isConnected());
  }
  stranger.reset();

  for (int i = 0; i < 2; ++i) {
    zmq::context_t context;
    zmq::socket_t publisher(context, zmq::socket_type::xpub);
    publisher.set(zmq::sockopt::linger, 0);
    publisher.bind(endpoint_);
    expectConnected(subscriber, true);
    publisher.close();
    context.close();
    expectConnected(subscriber, false);
  }
}

TEST_F(SocketTest, PeerOfAnotherKindIsNoConnectionAndMayBeFollowedByAPublisher) {
  zmq::context_t context;
  zmq::socket_t replier(context, zmq::socket_type::rep);  // the control endpoint, say
  replier.bind(endpoint_);
  Subscriber subscriber(at(endpoint_));
  for (int i = 0; i < 50; ++i) {
    subscriber.receive(10ms);
    EXPECT_FALSE(subscriber.isConnected());
  }
  replier.close();
  context.close();
  zmq::context_t other;
  zmq::socket_t publisher(other, zmq::socket_type::xpub);
  publisher.bind(endpoint_);
  expectConnected(subscriber, true);
}

TEST_F(SocketTest, EndpointThatWasGivenUpIsTriedAgainAfterAWhile) {
  Stranger stranger(path_, {greeting("NULL") + std::string("\4\5\5READY")});
  Subscriber subscriber(at(endpoint_));
  for (std::size_t met = 1; met < 4; ++met) {
    ASSERT_TRUE(eventually([&] {
      subscriber.receive(10ms);
      return stranger.met() == met;
    }));
    for (int i = 0; i < 30; ++i) subscriber.receive(10ms);
    EXPECT_EQ(stranger.met(), met);  // as long as time stands still
    TestClock::advance(200ms);
  }
}

/// Publishes for as long as it lives.
std::jthread publishing(tractiond::publish::Publisher& publisher, const tractiond::TractionField& field) {
  return std::jthread([&](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(5ms)) {
      TestClock::advance(5ms);
      publisher.wait(-1, 0ms);
      publisher.publish(field);
    }
  });
}

TEST_F(SubscriberTest, StreamReadFromTheLatestEndpointIsToldInsteadOfWaitedFor) {
  Subscriber subscriber(at(latest_, kField));
  const auto fields = publishing(*publisher_, field_);
  try {
    subscriber.receive(kHung);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kBadEndpoint);
    for (const std::string& word : {latest_, std::string("'stream'"), std::string("'latest'")}) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
}

// ZeroMQ 4.3.4 aborts the process when a message in parts reaches a socket that conflates.
TEST_F(SubscriberTest, LatestReadFromTheStreamEndpointDoesNoHarm) {
  Subscriber subscriber(at(stream_, kField, Mode::kLatest));
  const auto fields = publishing(*publisher_, field_);
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(subscriber.receive(10ms));
  expectConnected(subscriber, true);
}

TEST_F(SubscriberTest, RestartOfTheDaemonIsNoLoss) {
  std::string pattern = testing::TempDir() + "traction-XXXXXX";
  const std::string folder = mkdtemp(pattern.data());
  Description description = tractiond::publish::description();
  open(description, "ipc://" + folder + "/stream");
  Subscriber subscriber(at(stream_, kField));
  for (int i = 0; i < 3; ++i) await<Field>(subscriber);
  description.identity.boot = idOf(90);
  open(description, stream_);
  while (await<Field>(subscriber).header.boot != idOf(90)) {
  }
  EXPECT_EQ(subscriber.lost(), 0U);
  publisher_.reset();
  std::filesystem::remove_all(folder);
}

TEST(Subscriber, BadEndpointsAndNamesAreRefused) {
  for (const std::string endpoint : {"nonsense", "tcp://", "http://localhost"}) {
    EXPECT_THROW(Subscriber{at(endpoint)}, Error) << endpoint;
  }
  SubscriberOptions options;
  options.instance = "../etc";
  try {
    const Subscriber subscriber(options);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kBadEndpoint);
  }
}

/// Publishes whatever it is told to.
class Forger {
 public:
  /// The end of a forger waits until all is with the system that it has sent.
  explicit Forger(const std::string& endpoint = "tcp://127.0.0.1:*") {
    socket_.bind(endpoint);
    subscriber_ = std::make_unique<Subscriber>(at(socket_.get(zmq::sockopt::last_endpoint)));
    zmq::message_t subscription;
    [[maybe_unused]] const auto received = socket_.recv(subscription);
  }

  void send(const std::vector<std::string>& parts) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      socket_.send(zmq::buffer(parts[i]), i + 1 < parts.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
    }
  }
  void field(std::uint64_t sequence, char boot = 'b') {
    v1::Field field;
    field.mutable_header()->set_sequence(sequence);
    field.mutable_header()->set_boot(std::string(16, boot));
    send({"traction/v1/gel/field/", field.SerializeAsString(), "0.0"});
  }
  std::optional<ErrorCode> failure() {
    try {
      subscriber_->receive(kHung);
      return std::nullopt;
    } catch (const Error& error) {
      return error.code();
    }
  }
  Subscriber& subscriber() { return *subscriber_; }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::xpub};
  std::unique_ptr<Subscriber> subscriber_;
};

TEST_F(SocketTest, WhatCameBeforeTheEndOfADaemonIsReadAfterIt) {
  constexpr int kFields = 100;
  auto forger = std::make_unique<Forger>(endpoint_);
  Subscriber subscriber = std::move(forger->subscriber());
  for (int i = 1; i <= kFields; ++i) forger->field(static_cast<std::uint64_t>(i));
  ASSERT_TRUE(subscriber.receive(kHung));
  forger.reset();
  ASSERT_TRUE(eventually([&] {
    std::this_thread::sleep_for(1ms);
    return !subscriber.isConnected();
  }));
  const int listener = listenAt(path_);
  pollfd comes{listener, POLLIN, 0};
  ASSERT_EQ(poll(&comes, 1, kHung_ms), 1);  // ZeroMQ tries the endpoint again by itself
  TestClock::advance(300ms);                // longer than an endpoint is left alone that was given up
  for (int i = 2; i <= kFields; ++i) ASSERT_TRUE(subscriber.receive(0ms)) << i;
  close(listener);
}

TEST(Subscriber, GapsOfTheSequenceAreLosses) {
  Forger forger;
  const auto lostAfter = [&](std::uint64_t sequence, char boot = 'b') {
    forger.field(sequence, boot);
    EXPECT_TRUE(forger.subscriber().receive(kHung));
    return forger.subscriber().lost();
  };
  EXPECT_EQ(lostAfter(7), 0U);  // joined late
  EXPECT_EQ(lostAfter(8), 0U);
  EXPECT_EQ(lostAfter(10), 1U);
  EXPECT_EQ(lostAfter(20), 10U);
  EXPECT_EQ(lostAfter(3, 'c'), 10U);  // a new start of the daemon
  EXPECT_EQ(lostAfter(5, 'c'), 11U);
}

TEST(Subscriber, PublisherOfSomethingElseIsTold) {
  Forger forger;
  forger.send({"truth/", "{}"});
  EXPECT_EQ(forger.failure(), ErrorCode::kVersion);
  forger.send({"\1\x1b[2J", "{}"});
  EXPECT_EQ(forger.failure(), ErrorCode::kVersion);
}

TEST(Subscriber, OtherVersionIsTold) {
  Forger forger;
  forger.send({"traction/v2/gel/field/", "", "0.0"});
  EXPECT_EQ(forger.failure(), ErrorCode::kVersion);
}

TEST(Subscriber, MalformedMessagesAreToldAndTheNextIsRead) {
  Forger forger;
  v1::Field field;
  field.mutable_header()->set_boot("short");
  const std::string badId = field.SerializeAsString();
  field.Clear();
  field.add_force_n(1.0F);
  const std::string incompleteVector = field.SerializeAsString();
  field.add_force_n(1.0F);
  field.add_force_n(1.0F);
  const std::string noMask = field.SerializeAsString();
  const std::vector<std::string> bad = {"\xff\xff\xff\xff", badId, incompleteVector, noMask};
  for (const std::string& payload : bad) {
    forger.send({"traction/v1/gel/field/", payload, "0.0"});
    EXPECT_EQ(forger.failure(), ErrorCode::kMalformed);
  }
  forger.send({"traction/v1/gel/field/"});
  EXPECT_EQ(forger.failure(), ErrorCode::kMalformed);
  forger.send({"traction/v1/gel/field/", "", "0.0", "more", "and more"});
  EXPECT_EQ(forger.failure(), std::nullopt);
}

TEST(Subscriber, TopicsOfALaterDaemonArePassedOver) {
  Forger forger;
  for (const std::string topic :
       {"traction/v1/gel/contacts/", "traction/v1/gel", "traction/v1//", "traction/v1/gel/field"}) {
    forger.send({topic, "\xff", "0.0"});
  }
  forger.field(1);
  EXPECT_TRUE(std::holds_alternative<Field>(forger.subscriber().receive(kHung).value()));
}

}  // namespace
}  // namespace traction::subscriber_test
