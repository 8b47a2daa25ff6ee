// evaluation_grasp COUNT SEED: grasps of random things by the example's controller, without pictures. Prints one line
// of JSON for each. Forces are as noisy as those of pictures, and two frames late.
#include "client/examples/gripper/grip.h"
#include "twin/hand.h"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <numbers>
#include <random>

namespace {

using namespace twin;

constexpr double kGravity = 9.80665, kPeriod_s = 1.0 / 60;
constexpr std::size_t kDelay = 2;  // [frames]
// Deviations of the stated forces, and of what is common to a grasp, as seen in grasps through pictures.
constexpr double kNoise_N = 5e-3, kNoiseOfNormal = 4e-3, kGain = 0.01;
constexpr double kMostJerk = 3.0;  // [m/s^2] a third of gravity

class Random {
 public:
  explicit Random(unsigned seed)
      : engine_(seed) {}
  double even(double from, double to) { return std::uniform_real_distribution(from, to)(engine_); }
  double normal(double deviation) { return deviation * std::normal_distribution()(engine_); }
  Eigen::Vector2d direction() {
    const double angle = even(0.0, 2 * std::numbers::pi);
    return {std::cos(angle), std::sin(angle)};
  }

 private:
  std::mt19937 engine_;
};

struct Thing {
  HandOptions hand;
  double jerk, least_N;  ///< the least normal force that holds weight and jerk
};

Thing thing(Random& random) {
  HandOptions hand;
  hand.friction = std::exp(random.even(std::log(0.2), 0.0));
  hand.mass = random.even(30e-3, 80e-3);
  hand.width = random.even(30e-3, 50e-3);
  hand.opening = hand.width + 5e-3;
  const bool isBall = random.even(0.0, 1.0) < 0.6;
  hand.profile =
      isBall ? Profile{0.0, random.even(15e-3, 40e-3)} : Profile{random.even(2e-3, 6e-3), random.even(5e-3, 15e-3)};
  hand.stiffness = random.even(2e4, 2e5);
  hand.breaking = random.even(3.0, 5.0) * hand.mass * kGravity / 2 / hand.friction;
  const double jerk = random.even(0.0, kMostJerk);
  const double bump = hand.mass * jerk;
  hand.disturbances = {
      {.at_s = random.even(2, 4), .duration_s = random.even(0.1, 0.4), .acceleration = jerk * random.direction()},
      {.at_s = random.even(4.5, 5.5), .duration_s = random.even(0.05, 0.3), .force = bump * random.direction()}};
  return {hand, jerk, hand.mass * (kGravity + jerk) / 2 / hand.friction};
}

grip::Finger felt(const RoundContact& contact, double gain, Random& random) {
  const Eigen::Vector3d force = gain * contact.force();
  const double normal = force.z() + random.normal(kNoise_N + kNoiseOfNormal * force.z());
  return {normal > 0.05, normal, -force.x() + random.normal(kNoise_N), -force.y() + random.normal(kNoise_N), false};
}

void grasp(Random& random) {
  const Thing what = thing(random);
  Hand hand(what.hand, sensor::Gel{});
  grip::Options options;
  options.jerk_m_s2 = what.jerk;
  grip::Grip grip(options, what.hand.opening);
  const double gain = 1.0 + random.normal(kGain);
  std::deque<std::array<grip::Finger, 2>> seen;
  double sum_N = 0.0;
  int held = 0;
  using Phase = grip::Grip::Phase;
  for (double time_s = 0.0; time_s < 60.0 && grip.phase() < Phase::kDone; time_s += kPeriod_s) {
    seen.push_back({felt(hand.contact(0), gain, random), felt(hand.contact(1), gain, random)});
    if (seen.size() > kDelay) seen.pop_front();
    const grip::Target target = grip.step(seen.front()[0], seen.front()[1], kPeriod_s);
    hand.command(target.opening_m, target.height_m);
    hand.advance(kPeriod_s);
    if (grip.phase() != Phase::kHold) continue;
    sum_N += hand.state().normal;
    ++held;
  }
  const auto word = [](bool is) { return is ? "true" : "false"; };
  const bool dropped = grip.phase() != Phase::kDone || hand.state().dropped || hand.state().slid > 5e-3;
  std::printf("{\"friction\":%.4f,\"found\":%.4f,\"mass_kg\":%.4f,\"least_N\":%.4f,\"held_N\":%.4f,\"slid_m\":%.6f,"
              "\"dropped\":%s,\"broken\":%s}\n",
              what.hand.friction, grip.friction(), what.hand.mass, what.least_N, held > 0 ? sum_N / held : 0.0,
              hand.state().slid, word(dropped), word(hand.state().broken));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: evaluation_grasp COUNT SEED\n");
    return 64;
  }
  Random random(static_cast<unsigned>(std::strtoul(argv[2], nullptr, 10)));
  for (long left = std::strtol(argv[1], nullptr, 10); left > 0; --left) grasp(random);
  return 0;
}
