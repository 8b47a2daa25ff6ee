// Fields in, contacts out, and what arrives of them at a subscriber.
#include "client/src/sources.h"
#include "client/touch/follower.h"
#include "client/touch/publisher.h"
#include "tests/support/deadline.h"
#include "traction/subscriber.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace traction::contacts {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kInterval_ns = 16'666'667;
std::int64_t clock_ns = 0;  // NOLINT: the clock of a program is one, too

Id idOf(std::uint8_t byte) {
  Id id{};
  id[0] = byte;
  return id;
}

/// A sensor with its daemon: the field of each of its frames, as the client library returns it, and as it was sent.
struct Sensor {
  Field field;
  std::string bytes;

  Sensor() {
    field.valid = true;
    field.header.sensor = "gel";
    field.header.boot = idOf(1);
    field.header.captured_ns = 5'000'000'000;
  }
  void press(double x_m, double normal_N = 2.0) {
    field.contacts.push_back({{x_m, 0.0}, {2e-5, 2e-5}, {0.0, 0.0, normal_N}, {0.01, 0.01, 0.01}, 5e-5, 1e-6});
  }
  void nextFrame() {
    field.header.captured_ns += kInterval_ns;
    field.header.received_ns = field.header.captured_ns + 5'000'000;
    field.header.arrived_ns = clock_ns += kInterval_ns;
    ++field.header.frameNumber;
    v1::Field message;
    message.mutable_header()->set_sensor(field.header.sensor);
    message.mutable_header()->set_frame_number(field.header.frameNumber);
    message.mutable_header()->set_sequence(1000 + field.header.frameNumber);
    message.SerializeToString(&bytes);
  }
};

v1::Contacts taken(Follower& follower, Sensor& sensor) {
  sensor.nextFrame();
  return follower.take(sensor.field, sensor.bytes);
}

Follower follower(std::uint8_t run = 7) {
  return Follower({.run = idOf(run), .monotonicClock = [] { return clock_ns; }, .realClock = [] { return clock_ns; }});
}

TEST(Follower, GivesAPressOneIdFromItsBeginToItsEnd) {
  Sensor sensor;
  Follower follower = contacts::follower();
  EXPECT_EQ(taken(follower, sensor).contacts_size(), 0);
  sensor.press(0.004);
  const v1::Contacts begin = taken(follower, sensor);
  ASSERT_EQ(begin.contacts_size(), 1);
  EXPECT_EQ(begin.contacts(0).phase(), v1::CONTACT_PHASE_BEGIN);
  EXPECT_EQ(begin.contacts(0).position_m().x(), 0.004);
  EXPECT_EQ(begin.contacts(0).force_n().z(), 2.0);
  EXPECT_EQ(begin.contacts(0).begun_ns(), sensor.field.header.captured_ns);
  EXPECT_EQ(begin.header().sensor(), "gel");
  EXPECT_EQ(begin.header().frame_number(), sensor.field.header.frameNumber);
  EXPECT_EQ(begin.header().sequence(), 2U) << "of this topic";
  EXPECT_EQ(begin.run().size(), 16U);
  sensor.field.header.flags = kTorn;
  const v1::Contacts move = taken(follower, sensor);
  EXPECT_EQ(move.contacts(0).phase(), v1::CONTACT_PHASE_MOVE);
  EXPECT_TRUE(move.contacts(0).doubted());
  sensor.field.contacts.clear();
  v1::Contacts end;
  for (int frame = 0; frame < 6; ++frame) end = taken(follower, sensor);
  ASSERT_EQ(end.contacts_size(), 1);
  EXPECT_EQ(end.contacts(0).phase(), v1::CONTACT_PHASE_END);
  EXPECT_EQ(end.contacts(0).id(), begin.contacts(0).id());
  EXPECT_FALSE(follower.hasContacts());
}

TEST(Follower, StatesTheWrenchOfTheField) {
  Sensor sensor;
  sensor.press(0.004);
  sensor.press(-0.02, 1.0);
  double number = 0.0;
  for (Contact& contact : sensor.field.contacts) {
    contact.force_N[0] = 0.5;
    contact.moment_Nm = {++number, ++number, ++number};
    contact.positionZ_m = ++number;
    for (Covariance* each :
         {&contact.forceCovariance_N2, &contact.momentCovariance_N2m2, &contact.forceMomentCovariance_N2m}) {
      each->noise.fill(++number);
      each->systematic.fill(++number);
    }
    contact.halfAxes_m = {++number, ++number};
    contact.halfAxesDeviation_m = {++number, ++number};
    contact.orientation_rad = 0.1;
    contact.orientationDeviation_rad = 0.01;
  }
  Follower follower = contacts::follower();
  const auto told = [&] {
    const auto message = decode(Raw{"traction/v1/gel/contacts/", taken(follower, sensor).SerializeAsString()});
    return std::get<Contacts>(message.value()).contacts;
  };
  const std::vector<TrackedContact> seen = told();
  ASSERT_EQ(seen.size(), 2U);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    SCOPED_TRACE(i);
    const Contact& is = sensor.field.contacts[i];
    const auto expectSame = [](const Covariance& covariance, const Covariance& expected) {
      EXPECT_EQ(covariance.noise, expected.noise);
      EXPECT_EQ(covariance.systematic, expected.systematic);
    };
    EXPECT_EQ(seen[i].force_N, is.force_N);
    EXPECT_EQ(seen[i].moment_Nm, is.moment_Nm);
    EXPECT_EQ(seen[i].positionZ_m, is.positionZ_m);
    expectSame(seen[i].forceCovariance_N2, is.forceCovariance_N2);
    expectSame(seen[i].momentCovariance_N2m2, is.momentCovariance_N2m2);
    expectSame(seen[i].forceMomentCovariance_N2m, is.forceMomentCovariance_N2m);
    EXPECT_EQ(seen[i].halfAxes_m, is.halfAxes_m);
    EXPECT_EQ(seen[i].halfAxesDeviation_m, is.halfAxesDeviation_m);
    EXPECT_EQ(seen[i].orientation_rad, is.orientation_rad);
    EXPECT_EQ(seen[i].orientationDeviation_rad, is.orientationDeviation_rad);
    EXPECT_GT(seen[i].angularVelocityDeviation_rad_s, 0.0);
    EXPECT_EQ(seen[i].slip.value().model, SlipModel::kBound);
  }
  sensor.field.valid = false;
  const TrackedContact unknown = told()[0];
  EXPECT_EQ(unknown.moment_Nm, Vector3{});
  EXPECT_EQ(unknown.forceCovariance_N2.noise, Matrix3{});
  EXPECT_EQ(unknown.halfAxes_m, sensor.field.contacts[0].halfAxes_m) << "as last seen";
}

TEST(Field, StatesTheShearOfANodeOverItsNormalForce) {
  Field field;
  field.force_N = {{0.03F, 0.04F, 0.1F}, {0.03F, 0.04F, 0.01F}};
  field.nodeDeviation_N = {{0.01F, 0.01F, 0.02F}, {0.01F, 0.01F, 0.02F}};
  const ShearRatio known = shearRatio(field, 0).value();
  EXPECT_NEAR(known.ratio, 0.5, 1e-6);
  EXPECT_NEAR(known.deviation, std::hypot(0.1, 0.5 * 0.2), 1e-6);
  EXPECT_FALSE(shearRatio(field, 1));
  EXPECT_FALSE(shearRatio(field, 2));
}

TEST(Follower, ListsTheCriticalPointsOfFieldsOnADescribedGrid) {
  Sensor sensor;
  Description description;
  description.nodes = {7, 7, 3e-3, {0.01, 0.0}};
  description.calibration.id = sensor.field.header.calibration = idOf(3);
  for (int i = 0; i < 49; ++i) {
    const float x = static_cast<float>(i % 7 - 3), y = static_cast<float>(i / 7 - 3);
    sensor.field.force_N.push_back({-0.1F * (y + 0.5F), 0.1F * x, 1.0F});
    sensor.field.nodeDeviation_N.push_back({0.01F, 0.01F, 0.01F});
  }
  Follower follower = contacts::follower();
  EXPECT_EQ(taken(follower, sensor).critical_points_size(), 0) << "where the nodes are is not known";
  follower.describe(description);
  const v1::Contacts first = taken(follower, sensor);
  ASSERT_EQ(first.critical_points_size(), 1);
  EXPECT_EQ(first.critical_points(0).kind(), v1::CRITICAL_POINT_KIND_VORTEX);
  EXPECT_EQ(first.critical_points(0).index(), 1);
  EXPECT_NEAR(first.critical_points(0).position_m().x(), 0.01, 1e-6);
  EXPECT_NEAR(first.critical_points(0).position_m().y(), -1.5e-3, 1e-6);
  EXPECT_GT(first.critical_points(0).angle_rad(), 1.5);
  EXPECT_EQ(taken(follower, sensor).critical_points(0).id(), first.critical_points(0).id());
  EXPECT_EQ(follower.wait(clock_ns).critical_points_size(), 0);
  description.body.emplace();
  follower.describe(description);
  EXPECT_EQ(taken(follower, sensor).critical_points_size(), 0) << "its nodes are no flat grid";
}

TEST(Follower, EndsContactsWhereNoFieldComesOrAnotherZeroHolds) {
  Sensor sensor;
  sensor.press(0.0);
  Follower follower = contacts::follower();
  taken(follower, sensor);
  EXPECT_EQ(follower.wait(clock_ns + 50'000'000).contacts(0).phase(), v1::CONTACT_PHASE_UNKNOWN);
  EXPECT_EQ(taken(follower, sensor).contacts(0).phase(), v1::CONTACT_PHASE_MOVE);
  EXPECT_EQ(follower.silence_ns(), 100'000'000);
  EXPECT_EQ(follower.wait(clock_ns + 999'000'000).contacts(0).phase(), v1::CONTACT_PHASE_UNKNOWN);
  const v1::Contacts silent = follower.wait(clock_ns + 1'000'001'000);
  EXPECT_FALSE(silent.valid());
  EXPECT_EQ(silent.contacts(0).phase(), v1::CONTACT_PHASE_END);
  EXPECT_EQ(silent.contacts(0).end_cause(), v1::END_CAUSE_NOT_SEEN);
  EXPECT_FALSE(follower.hasContacts());

  EXPECT_EQ(taken(follower, sensor).contacts(0).id(), 2U);
  sensor.field.header.zero = idOf(9);
  const v1::Contacts other = taken(follower, sensor);
  ASSERT_EQ(other.contacts_size(), 2);
  EXPECT_EQ(other.contacts(0).end_cause(), v1::END_CAUSE_ZERO);
  EXPECT_EQ(other.contacts(1).phase(), v1::CONTACT_PHASE_BEGIN);
  EXPECT_EQ(other.contacts(1).id(), 3U);
  EXPECT_EQ(follower.endAll().contacts(0).end_cause(), v1::END_CAUSE_STOPPED);
}

TEST(Sources, TheFirstOfAlternatingSourcesHasTheName) {
  Sources sources;
  const auto take = [&](std::uint8_t boot, std::int64_t now_ns = 0) {
    Field field;
    field.header.sensor = "gel";
    field.header.boot = idOf(boot);
    return sources.take(field, now_ns);
  };
  EXPECT_TRUE(take(1) && take(2) && take(2) && take(3)) << "restarts";
  EXPECT_EQ(sources.trouble(), "");
  EXPECT_TRUE(take(4) && take(5) && take(3)) << "three at once; the first comes again";
  EXPECT_FALSE(take(4) || take(5));
  EXPECT_TRUE(take(3));
  EXPECT_NE(sources.trouble().find("'gel' at once (boot or run 03000000... and 04000000...)"), std::string::npos);
  EXPECT_TRUE(take(4, Sources::kGone_ns)) << "the first has gone";
  EXPECT_TRUE(take(3, Sources::kGone_ns)) << "and comes again";
  EXPECT_FALSE(take(4, Sources::kGone_ns));
}

TEST(Subscriber, ContactsThatWaitedAreNoSilence) {
  const auto publisher = Publisher::open({"tcp://127.0.0.1:*"}).value();
  Subscriber subscriber(
      {.endpoint = publisher->endpoints().front(), .topics = kContacts, .monotonicClock = [] { return clock_ns; }});
  Follower follower = contacts::follower();
  Sensor sensor;
  sensor.press(0.01);
  bool hasBegun = false;
  EXPECT_TRUE(tractiond::test::eventually([&] {
    publisher->send(taken(follower, sensor));
    if (hasBegun) clock_ns += 10'000'000'000;  // the reader is busy; an end comes where the message has not arrived yet
    const auto message = subscriber.receive(hasBegun ? 1ms : 20ms);
    if (!message) return false;
    return std::exchange(hasBegun, true) && std::get<Contacts>(*message).contacts.at(0).phase == ContactPhase::kMove;
  }));
}

}  // namespace
}  // namespace traction::contacts
