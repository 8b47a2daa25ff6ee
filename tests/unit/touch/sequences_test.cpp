// Random sequences of fields, and contacts that move for minutes.
#include "tests/support/seed.h"
#include "touch/contact_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <random>

namespace touch {
namespace {

constexpr std::int64_t kInterval_ns = 16'666'667;
constexpr std::int64_t kPatience_ns = 6'000'000'000;  // at most

double sum(const std::vector<Contact>& contacts) {
  double total = 0.0;
  for (const Contact& one : contacts) total += one.force_N[2];
  return total;
}

/// Checks what a tracker reports against the laws of contacts.
class Auditor {
 public:
  void check(const std::vector<Contact>& reported, const Field& field, bool valid) {
    std::size_t seen = 0;
    std::map<std::uint64_t, std::int64_t> still;
    const bool continues = valid ? field.time_ns > time_ns_ && field.basis == basis_ : field.time_ns >= time_ns_;
    if (valid) {
      basis_ = field.basis;
      time_ns_ = field.time_ns;
    }
    for (const Contact& one : reported) {
      ASSERT_EQ(one.phase == ContactPhase::kEnd, one.endCause != EndCause::kNone);
      if (one.phase == ContactPhase::kBegin) {
        ASSERT_GT(one.id, last_) << "an id is used again";
        last_ = one.id;
      } else {
        ASSERT_TRUE(open_.contains(one.id)) << "without begin";
        ASSERT_EQ(open_[one.id], one.begun_ns);
        ASSERT_TRUE(continues || one.phase == ContactPhase::kEnd) << "fields that cannot be compared";
      }
      const bool isSeen = one.phase == ContactPhase::kBegin || one.phase == ContactPhase::kMove;
      seen += isSeen;
      ASSERT_TRUE(!isSeen || one.seen_ns == field.time_ns);
      if (one.phase != ContactPhase::kEnd) {
        ASSERT_TRUE(still.emplace(one.id, one.begun_ns).second) << "reported twice";
        ASSERT_LE(field.time_ns - one.seen_ns, kPatience_ns);
        ASSERT_GE(field.time_ns, one.seen_ns);
      }
    }
    const auto count = [&](ContactPhase phase) { return std::ranges::count(reported, phase, &Contact::phase); };
    ASSERT_EQ(std::ssize(still), std::ssize(open_) + count(ContactPhase::kBegin) - count(ContactPhase::kEnd))
        << "a contact is not reported";
    open_ = std::move(still);
    ASSERT_EQ(seen, valid ? field.contacts.size() : 0);
    double force = 0.0;
    for (const Observation& one : field.contacts) force += one.force_N[2];
    ASSERT_NEAR(sum(reported), valid ? force : 0.0, 1e-9);
  }
  std::size_t open() const { return open_.size(); }
  std::uint64_t begun() const { return last_; }

 private:
  std::map<std::uint64_t, std::int64_t> open_;  ///< times of begin
  Basis basis_;                                 ///< of the last valid field, as its time
  std::int64_t time_ns_ = std::numeric_limits<std::int64_t>::min();
  std::uint64_t last_ = 0;
};

/// Contacts that come, wander, change places and go, and a sensor that loses frames, itself, and its time.
void expectPairsInRandomSequences(int sequences) {
  std::uint64_t begun = 0;
  for (int sequence = 0; sequence < sequences; ++sequence) {
    SCOPED_TRACE(sequence);
    std::seed_seq seeds{tractiond::test::seed(), static_cast<std::uint32_t>(sequence)};
    std::mt19937 random(seeds);
    const auto chance = [&](double share) { return static_cast<double>(random()) < share * 4294967296.0; };
    const auto between = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
    };
    const auto fresh = [&] {
      const double deviation = std::pow(10.0, between(-5.0, -2.5));
      return Observation{{between(-0.05, 0.05), between(-0.04, 0.04)},
                         {deviation, deviation},
                         {0.0, 0.0, between(0.1, 5.0)},
                         {0.01, 0.01, 0.01},
                         between(9e-6, 1e-3),
                         1e-6};
    };
    const double unrest = chance(0.5) ? 0.02 : 0.2;  // how often something happens
    ContactTracker tracker;
    Auditor auditor;
    Field field{static_cast<std::int64_t>(random()), true, false, {}, {}};
    std::vector<Observation> world;
    for (int frame = 0; frame < 60; ++frame) {
      if (chance(unrest) && world.size() < 8) world.push_back(fresh());
      if (chance(unrest) && !world.empty()) world.erase(world.begin() + random() % world.size());
      for (Observation& one : world) {
        for (double& place : one.position_m) place += between(-0.005, 0.005);
      }
      if (chance(unrest)) std::shuffle(world.begin(), world.end(), random);
      field.contacts = world;
      std::erase_if(field.contacts, [&](const Observation&) { return chance(unrest); });  // not detected
      field.valid = !chance(unrest);
      field.doubted = chance(unrest);
      if (!field.valid && chance(0.5)) field.contacts.clear();
      if (chance(0.1 * unrest)) field.basis.zero[0] = static_cast<std::uint8_t>(random() % 3);
      if (chance(0.1 * unrest)) field.basis.boot[0] = static_cast<std::uint8_t>(random());
      if (chance(0.1 * unrest)) field.basis.calibration[0] = static_cast<std::uint8_t>(random() % 2);
      field.time_ns += kInterval_ns * (chance(unrest) ? static_cast<std::int64_t>(random() % 10) : 1);
      if (chance(0.1 * unrest)) field.time_ns = static_cast<std::int64_t>(random() - (std::uint64_t{1} << 31));
      auditor.check(tracker.update(field), field, field.valid);
      if (chance(0.1 * unrest)) {  // the sensor is lost
        field.contacts.clear();
        auditor.check(tracker.endAll(), field, false);
        ASSERT_EQ(auditor.open(), 0U);
      }
      if (testing::Test::HasFatalFailure()) return;
    }
    begun += auditor.begun();
    field.contacts.clear();
    if (chance(0.5)) {  // the program stops, or frames go on: not valid, without contact, or with a clock that only is
                        // not late
      auditor.check(tracker.endAll(), field, false);
    } else {
      field.valid = chance(0.5);
      for (std::int64_t waited_ns = 0; waited_ns <= kPatience_ns; waited_ns += kInterval_ns) {
        field.time_ns += kInterval_ns;
        auditor.check(tracker.update(field), field, field.valid);
      }
    }
    ASSERT_EQ(auditor.open(), 0U) << "begin without end";
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(begun, static_cast<std::uint64_t>(3 * sequences));
  std::printf("%d sequences, %llu contacts, begin without end: 0\n", sequences, static_cast<unsigned long long>(begun));
}

TEST(Tracker, EachBeginHasItsEndInRandomSequences) {
  expectPairsInRandomSequences(2'000);
}
TEST(TrackerMinutes, EachBeginHasItsEndInRandomSequences) {
  expectPairsInRandomSequences(100'000);
}

/// Two contacts that circle each other at 12 to 32 mm while their centre wanders: each is where the other was.
class Dancers {
 public:
  explicit Dancers(std::mt19937& random) {
    for (double& phase : phase_) phase = std::uniform_real_distribution(0.0, 2.0 * std::numbers::pi)(random);
  }
  std::array<double, 2> position_m(int which, double t) const {
    const double half =
        1e-3 * (which ? 11.0 - 5.0 * std::cos(0.9 * t + phase_[0]) : -11.0 + 5.0 * std::cos(0.9 * t + phase_[0]));
    const double angle = 2.5 * t + 2.2 * std::sin(1.3 * t + phase_[1]);
    return {half * std::cos(angle) + 15e-3 * std::sin(4.1 * t + phase_[2]),
            half * std::sin(angle) + 10e-3 * std::sin(5.3 * t + phase_[3])};
  }
  std::array<double, 2> velocity_m_s(int which, double t) const {
    const double step = 1e-5;
    const auto before = position_m(which, t - step), after = position_m(which, t + step);
    return {(after[0] - before[0]) / (2 * step), (after[1] - before[1]) / (2 * step)};
  }

 private:
  std::array<double, 4> phase_{};
};

struct Dance {
  int ids = 0, swaps = 0;
  double fastest_m_s = 0.0;
  int velocities = 0, covered = 0;  ///< components; within 1.96 deviations
};

/// \param lost probability with which a group of fields begins that are missing or not valid, up to 80 ms
/// \param overlooked the same for one of the contacts, in fields that are valid
Dance dance(double minutes, double lost, double overlooked) {
  std::mt19937 random(tractiond::test::seed());
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const Dancers dancers(random);
  ContactTracker tracker;
  std::map<std::uint64_t, int> of;  // the contact as which an id began
  Dance result;
  int lostFields = 0, unseen = 0, hidden = 0;
  bool missing = false, justLost = false;
  for (int frame = 0; frame < static_cast<int>(minutes * 3600); ++frame) {
    const double t = frame / 60.0;
    if (lostFields == 0 && !justLost && uniform(random) < lost) {
      lostFields = 1 + static_cast<int>(random() % 4);
      missing = random() % 2 == 0;
    }
    justLost = lostFields > 0;
    if (unseen == 0 && uniform(random) < overlooked) {
      unseen = 1 + static_cast<int>(random() % 8);
      hidden = static_cast<int>(random() % 2);
    }
    Field field{frame * kInterval_ns + 1, lostFields == 0, false, {}, {}};
    if (field.valid) {
      // The deviations are stated anew in each field; the order is that of the forces, which are random.
      for (const int which : random() % 2 ? std::array{0, 1} : std::array{1, 0}) {
        if (unseen > 0 && which == hidden) continue;
        const double deviation = std::pow(10.0, -4.7 + 1.7 * uniform(random));  // 0.02 to 1 mm
        auto place = dancers.position_m(which, t);
        for (double& one : place) one += deviation * normal(random);
        field.contacts.push_back({place, {deviation, deviation}, {which * 1.0, 0.0, 1.0}, {}, 3e-5, 1e-6});
      }
    }
    unseen = std::max(0, unseen - 1);
    if (lostFields > 0) --lostFields;
    if (!field.valid && missing) continue;
    for (const Contact& one : tracker.update(field)) {
      if (one.phase != ContactPhase::kBegin && one.phase != ContactPhase::kMove) continue;
      const int which = static_cast<int>(one.force_N[0]);
      const auto [found, begins] = of.emplace(one.id, which);
      result.swaps += found->second != which;
      found->second = which;
      const auto velocity = dancers.velocity_m_s(which, t);
      result.fastest_m_s = std::max(result.fastest_m_s, std::hypot(velocity[0], velocity[1]));
      for (int i = 0; i < 2; ++i) {
        ++result.velocities;
        result.covered += std::abs(one.velocity_m_s[i] - velocity[i]) <= 1.96 * one.velocityDeviation_m_s[i];
      }
    }
  }
  result.ids = static_cast<int>(of.size());
  std::printf("%g minutes, up to %.2f m/s: %d ids, %d swapped; %.1f %% of the velocities within 95 %% intervals\n",
              minutes, result.fastest_m_s, result.ids, result.swaps, 100.0 * result.covered / result.velocities);
  return result;
}

TEST(Tracker, TwoContactsThatCircleEachOtherKeepTheirIdsFor10Minutes) {
  const Dance whole = dance(10, 0.0, 0.0);
  EXPECT_EQ(whole.swaps, 0);
  EXPECT_EQ(whole.ids, 2);
  const Dance lossy = dance(10, 0.03, 0.0);
  EXPECT_EQ(lossy.swaps, 0);
  EXPECT_EQ(lossy.ids, 2);
}

TEST(Tracker, AContactThatIsOverlookedIsNotTakenForTheOther) {
  EXPECT_EQ(dance(10, 0.0, 0.03).swaps, 0);
}

TEST(TrackerStatistics, VelocitiesAreWithinTheirIntervals) {
  const Dance whole = dance(10, 0.0, 0.0);
  EXPECT_GT(whole.covered, 0.93 * whole.velocities);
}

}  // namespace
}  // namespace touch
