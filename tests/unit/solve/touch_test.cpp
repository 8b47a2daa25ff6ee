// Single contacts on the paper's sensor, and none.
#include "tests/support/seed.h"
#include "tests/unit/solve/presses.h"

namespace tractiond::solve::touch_test {
namespace {

using TouchTest = PressTest;

/// Returns what 1 N into the gel does to the picture, spread over a bar.
/// \param tapering 0: evenly; 1: to nothing at one end
VectorXd barImage(const Vector2d& centre, double angle, double length_m, double width_m, double tapering) {
  constexpr int kAlong = 14, kAcross = 7;
  sensor::Points points(3, kAlong * kAcross);
  VectorXd forces = VectorXd::Zero(3 * points.cols());
  for (int i = 0; i < points.cols(); ++i) {
    const Vector2d at((i % kAlong + 0.5) / kAlong - 0.5, (i / kAlong + 0.5) / kAcross - 0.5);
    points.col(i) << centre + Eigen::Rotation2Dd(angle) * Vector2d(length_m * at.x(), width_m * at.y()), 0.0;
    forces[3 * i + 2] = 1.0 + 2.0 * tapering * at.x();
  }
  return halfSpaceImage(paper(), points) * forces / forces.sum();
}

TEST_F(TouchTest, NothingTouchesAndNothingIsRead) {
  for (int i = 0; i < 500; ++i) {
    EXPECT_EQ(solve(noise()).method, Method::kNoContact);
    EXPECT_EQ(resultant(), Vector3d::Zero());
    EXPECT_GT(field_.noise[14], 0.0);
  }
}

TEST_F(TouchTest, FalseAlarmsAreAsManyAsAllowed) {
  const SolveOptions options{.falseAlarmsPerHour = 36.0, .frameRate_Hz = 1.0};
  ModelSolver solver(paperFactors(), paperAtoms(), paper(), options, std::array{0.03, 0.03});
  int alarms = 0;
  for (int i = 0; i < 2000; ++i) {
    solver.solve(seen(noise()), field_);
    alarms += field_.method == Method::kNoContact ? 0 : 1;
  }
  EXPECT_GE(alarms, 4);  // 0.4 to 1.6 of a hundredth of the frames
  EXPECT_LE(alarms, 32);
}

TEST_F(TouchTest, FalseAlarmsOfHoursAreAsManyAsAllowed) {
  random_.seed(test::seed());
  const auto print = [&](const char* gel, const sensor::Sensor& sensor, const SolveOptions& options, int frames) {
    const Atoms atoms = makeAtoms(sensor);
    const MotionPrior motion{sensor::elastic::pictureMotionMatrix(sensor), paperMotion().variances};
    const double scale_N = sensor.gel.youngsModulus * square(sensor.nodes.pitch);
    const Factors factors =
        computeFactors(halfSpaceImage(sensor, atoms.points), atoms, motion, scale_N, options).value();
    ModelSolver solver(factors, atoms, sensor, options, std::array{0.03, 0.03});
    field_.resize(sensor.markerCount(), sensor.nodes.count());
    MarkerField markers = fieldOf(VectorXd::Zero(factors.coordinateCount()));
    std::fill(markers.variance_px2.begin(), markers.variance_px2.end(), static_cast<float>(square(options.noise_px)));
    int alarms = 0;
    for (int i = 0; i < frames; ++i) {
      for (float& d : markers.displacement_px) d = static_cast<float>(options.noise_px * normal_(random_));
      solver.solve(markers, field_);
      alarms += field_.method == Method::kNoContact ? 0 : 1;
    }
    const double allowed = frames * options.falseAlarmsPerHour / (3600.0 * options.frameRate_Hz);
    std::printf("%s: %d false alarms in %d untouched frames, allowed %.0f\n", gel, alarms, frames, allowed);
    EXPECT_LT(alarms, 2.0 * allowed);
  };
  print("paper's gel", paper(), {}, 1'000'000);
  SolveOptions often{.falseAlarmsPerHour = 100.0};  // fewer frames show as much
  sensor::Sensor deep = paper();
  for (sensor::MarkerLayer& layer : deep.layers) layer.depth *= 2.0;
  print("markers twice as deep", deep, often, 100'000);
  print("8 x 6 markers", smallSensor(), often, 100'000);
  often.noise_px = 0.06;
  print("paper's gel, noise of 0.06 px", paper(), often, 100'000);
}

// The light is uneven: on one side the markers' noise is twice that of the mean.
TEST_F(TouchTest, MarkersThatAreNoisierThanOthersAreNoTouch) {
  const auto frame = [&](double force_N) {
    MarkerField markers = seen(noise());
    for (std::size_t m = 0; m < markers.valid.size(); ++m) {
      const float times = m % 24 < 4 ? 3.0F : 1.0F;  // columns at the left
      markers.variance_px2[m] *= times * times;
      for (std::size_t i : {2 * m, 2 * m + 1}) {
        markers.displacement_px[i] = times * markers.displacement_px[i] +
                                     static_cast<float>(force_N) * static_cast<float>(influence()(i, 3 * 290 + 2));
      }
    }
    solve(markers);
    return field_.method;
  };
  for (int i = 0; i < 300; ++i) EXPECT_EQ(frame(0.0), Method::kNoContact) << "frame " << i;
  EXPECT_EQ(frame(0.1), Method::kContact);
}

// Nodes that noise alone has found once made a contact of so many that the whole face was solved for: in one frame of
// forty a shear of 50 gf was read with a false press of 30 gf.
TEST_F(TouchTest, NoiseDoesNotSpreadAWeakShearOverTheFace) {
  const Press patch = press({12e-3, -9e-3}, 2.5e-3);
  for (const double gramForce : {7.0, 14.0, 50.0}) {
    const VectorXd displacement = patch.image * Vector3d(gramForce * kGramForce, 0.0, 0.0);
    for (int i = 0; i < 100; ++i) {
      solve(displacement + noise());
      EXPECT_EQ(field_.method, Method::kContact) << gramForce << " gf, frame " << i;
    }
  }
}

// Its edge was left out once: 30 gf on a flat disc were read as 28.
TEST_F(TouchTest, AWideFaintPressIsReadWhole) {
  const Vector2d at(1e-3, -2e-3);
  const Press disc = press(at, sensor::elastic::disc(at, 10e-3, Vector3d::UnitZ()));
  for (const double gramForce : {15.0, 25.0, 35.0}) {
    Vector3d mean = Vector3d::Zero();
    constexpr int kFrames = 60;
    for (int i = 0; i < kFrames; ++i) {
      solve(disc.image.col(2) * (gramForce * kGramForce) + noise());
      mean += resultant() / kFrames / kGramForce;
    }
    EXPECT_LT((mean - Vector3d(0.0, 0.0, gramForce)).norm(), 0.7) << gramForce;
  }
}

// In some frames a few small forces were evident and the press was not: 40 gf were read as 3 gf, 0.4 stated.
TEST_F(TouchTest, ALightPressOfTheWholeFaceIsReadWithinWhatIsStated) {
  const sensor::NodeGrid& grid = paper().nodes;
  const double half_m = 0.5 * grid.pitch * grid.columns;
  const Eigen::ArrayXd squares = (sensor::nodePositions(grid).topRows<2>() / half_m).colwise().squaredNorm();
  const Eigen::ArrayXd dome = (1.0 - 0.5 * squares).max(0.0);
  VectorXd image = VectorXd::Zero(influence().rows());
  for (Eigen::Index n = 0; n < dome.size(); ++n) image += dome[n] / dome.sum() * influence().col(3 * n + 2);
  double squaredDeviations = 0.0, worst = 0.0;
  constexpr int kFrames = 60;
  for (int i = 0; i < kFrames; ++i) {
    solve(40.0 * kGramForce * image + noise());
    const double deviations = (resultant().z() - 40.0 * kGramForce) / std::sqrt(field_.noise[14]);
    squaredDeviations += square(deviations) / kFrames;
    worst = std::max(worst, std::abs(deviations));
  }
  EXPECT_LT(squaredDeviations, square(2.0));
  EXPECT_LT(worst, 8.0);
  std::printf("errors: %.2f deviations rms, at most %.1f\n", std::sqrt(squaredDeviations), worst);
}

TEST_F(TouchTest, TwoContactsAreToldApart) {
  std::uniform_real_distribution<double> place(-24e-3, 24e-3), turn(0.0, 2.0 * M_PI);
  int told = 0, all = 0;
  const std::array<std::array<Vector3d, 2>, 3> cases = {{{Vector3d(0.0, 0.0, 100.0), Vector3d(0.0, 0.0, 100.0)},
                                                         {Vector3d(0.0, 0.0, 120.0), Vector3d(0.0, 0.0, 60.0)},
                                                         {Vector3d(30.0, 0.0, 90.0), Vector3d(0.0, -40.0, 90.0)}}};
  for (int trial = 0; trial < 24; ++trial) {
    const Vector2d centre(place(random_), place(random_));
    const double angle = turn(random_), distance = trial % 2 == 0 ? 7e-3 : 11e-3;
    const Vector2d half = 0.5 * distance * Vector2d(std::cos(angle), std::sin(angle));
    const std::array<Press, 2> presses = {press(centre - half, 1.5e-3), press(centre + half, 2.0e-3)};
    const auto& forces = cases[trial % cases.size()];
    VectorXd image = VectorXd::Zero(influence().rows());
    for (std::size_t i = 0; i < 2; ++i) image += presses[i].image * forces[i] * kGramForce;
    for (int frame = 0; frame < 3; ++frame, ++all) {
      if (solve(image + noise()).contactCount != 2) continue;
      Vector3d sum = Vector3d::Zero();
      for (int i = 0; i < 2; ++i) sum += Vector3d::Map(field_.contacts[i].force_N.data());
      EXPECT_LT((sum - resultant()).norm(), 1e-9);
      bool there = true;
      for (std::size_t i = 0; i < 2; ++i) {
        const auto off = [&](const Contact& c) { return (Vector2d::Map(c.position_m.data()) - presses[i].at).norm(); };
        const bool first = off(field_.contacts[0]) < off(field_.contacts[1]);
        const Contact& contact = field_.contacts[first ? 0 : 1];
        const Vector3d force = forces[i] * kGramForce;
        there &= off(contact) < 1e-3;
        for (int axis = 0; axis < 3; ++axis)
          there &= std::abs(contact.force_N[axis] - force[axis]) < 0.1 * force.norm();
      }
      told += there ? 1 : 0;
    }
  }
  EXPECT_GE(told, 0.95 * all);
  std::printf("told apart: %.0f %%\n", 100.0 * told / all);
}

TEST_F(TouchTest, OneContactIsNotTwoWhateverItsShape) {
  std::uniform_real_distribution<double> place(-20e-3, 20e-3), turn(0.0, 2.0 * M_PI);
  int split = 0, all = 0;
  for (const auto& [length, width] :
       {std::pair{3e-3, 3e-3}, {10e-3, 2e-3}, {14e-3, 2e-3}, {18e-3, 5e-3}, {16e-3, 10e-3}}) {
    for (const double tapering : {0.0, 0.9}) {
      const Vector2d centre(place(random_), place(random_));
      const VectorXd image = barImage(centre, turn(random_), length, width, tapering);
      for (const double gramForce : {50.0, 100.0, 400.0}) {
        for (int frame = 0; frame < 2; ++frame, ++all) {
          split += solve(image * gramForce * kGramForce + noise()).contactCount > 1 ? 1 : 0;
        }
      }
    }
  }
  EXPECT_LE(split, 0.01 * all);
}

TEST_F(TouchTest, AWeakContactBesideAStrongOneIsAContact) {
  const Press strong = press({-4e-3, 2e-3}, 2.5e-3);
  int found = 0, all = 0;
  for (const double distance : {14e-3, 18e-3, 22e-3}) {
    for (const double angle : {0.2, 1.7, 3.5}) {
      const Vector2d at = strong.at + distance * Vector2d(std::cos(angle), std::sin(angle));
      const VectorXd weak = press(at, 2e-3).image.col(2) * (10.0 * kGramForce);
      for (const double gramForce : {50.0, 200.0, 400.0}) {
        for (int frame = 0; frame < 2; ++frame, ++all) {
          solve(strong.image.col(2) * (gramForce * kGramForce) + weak + noise());
          if (field_.contactCount != 2) continue;
          const Contact& contact = field_.contacts[1];
          EXPECT_NEAR(contact.force_N[2], 10.0 * kGramForce, 5.0 * contact.forceDeviation_N[2]);
          found += (Vector2d::Map(contact.position_m.data()) - at).norm() < 2e-3 ? 1 : 0;
        }
      }
    }
  }
  std::printf("found beside a strong one: %d of %d\n", found, all);
  EXPECT_GE(found, 0.9 * all);
}

TEST_F(TouchTest, TheTruthIsWithinTheStatedInterval) {
  std::vector<Press> patches;
  std::uniform_real_distribution<double> place(-27e-3, 27e-3), share(-1.0, 1.0), size(10.0, 200.0);
  for (int i = 0; i < 10; ++i) patches.push_back(press({place(random_), place(random_)}, i % 2 == 0 ? 1.5e-3 : 3e-3));
  int inside = 0, all = 0;
  for (int i = 0; i < 200; ++i) {
    const Press& patch = patches[i % patches.size()];
    const Vector3d force = size(random_) * kGramForce * Vector3d(0.4 * share(random_), 0.4 * share(random_), 1.0);
    Eigen::Vector4d motion;
    for (double& m : motion) m = normal_(random_);
    motion.array() *= paperMotion().variances.array().sqrt();
    solve(patch.image * force + paperMotion().modes * motion + noise());
    ASSERT_EQ(field_.method, Method::kContact);
    const auto wrench = patch.wrench(force);
    for (int k = 0; k < 6; ++k) {
      const double error = (k < 3 ? field_.resultant_N[k] : field_.moment_Nm[k - 3]) - wrench[k];
      // Between its nodes the model is right within a few thousandths: the systematic part states it.
      const double model = 0.005 * (k < 3 ? force.norm() : std::hypot(patch.at.norm(), 3e-3) * force.norm());
      inside += std::abs(error) < 1.96 * std::hypot(std::sqrt(field_.noise[7 * k]), model) ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(inside, 0.92 * all);
  std::printf("inside the stated 95 %% interval: %.1f %%\n", 100.0 * inside / all);
}

TEST_F(TouchTest, AMovedPictureIsNotAForce) {
  const VectorXd moved = paperMotion().modes * Eigen::Vector4d(0.04, -0.03, 1e-4, -5e-5);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(solve(moved + noise()).method, Method::kNoContact);
    EXPECT_NEAR(field_.pictureMotion[0], 0.04, 0.005);
    EXPECT_NEAR(field_.pictureMotion[1], -0.03, 0.005);
  }
}

// The same noise throughout: what changes is the load alone, in steps of a fifth of the noise.
TEST_F(TouchTest, AGrowingPressIsReadWithoutAStep) {
  for (const Vector2d& at : {Vector2d(1.1e-3, -7.9e-3), Vector2d(30.4e-3, 3.3e-3)}) {
    const Press patch = press(at, 2e-3);
    const VectorXd still = noise();
    Vector3d last = Vector3d::Zero();
    Method before = Method::kNoContact;
    for (int step = 0; step <= 200; ++step) {
      const Vector3d force = 0.2 * step * kGramForce * Vector3d::UnitZ();
      solve(patch.image * force + still);
      if (field_.method == before) {
        EXPECT_LT((resultant() - last).norm(), 0.6 * kGramForce) << "at " << 0.2 * step << " gf";
      } else {
        // Below the threshold nothing is read, whatever presses; what appears is all of it, once.
        EXPECT_EQ(before, Method::kNoContact) << "at " << 0.2 * step << " gf";
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_NEAR(resultant()[axis], force[axis], 4.0 * std::sqrt(field_.noise[7 * axis]))
              << "along axis " << axis << " at " << 0.2 * step << " gf";
        }
      }
      before = field_.method;
      last = resultant();
    }
    EXPECT_NEAR(last.z(), 40.0 * kGramForce, 4.0 * kGramForce);
  }
}

TEST_F(TouchTest, DoubtfulMarkersAreTakenOut) {
  const Press patch = press({0.0, 0.0}, 2.5e-3);
  const VectorXd image = patch.image.col(2) * 2.0 + noise();
  MarkerField without = seen(image), doubtful = seen(image);
  for (int marker = 300; marker < 310; ++marker) {
    loseMarker(without, marker);
    doubtful.displacement_px[2 * marker] += 1.0F;
    doubtful.variance_px2[marker] = 0.1F;
  }
  solve(without);
  const Vector3d expected = resultant();
  solve(doubtful);
  EXPECT_LT((resultant() - expected).norm(), 1e-6);
}

// The factors, which are kept, do not depend on this error.
TEST_F(TouchTest, TheErrorOfTheMechanicsWidensAStrongForcesInterval) {
  const Press patch = press({1e-3, 2e-3}, 2.5e-3);
  const auto deviation_N = [&](double model, double force_N) {
    sensor::Sensor sensor = paper();
    sensor.uncertainty.model = model;
    ModelSolver solver(paperFactors(), paperAtoms(), sensor, {}, std::array{0.03, 0.03});
    solver.solve(seen(patch.image.col(2) * force_N), field_);
    EXPECT_NEAR(resultant().z(), force_N, 1e-3 * force_N);
    return std::sqrt(field_.noise[14]);
  };
  EXPECT_GT(deviation_N(0.03, 4.0), 1.5 * deviation_N(0.0, 4.0));
  EXPECT_LT(deviation_N(0.03, 0.2), 1.1 * deviation_N(0.0, 0.2));
}

TEST_F(TouchTest, WhatNoForceCanDoIsMarked) {
  VectorXd torn = noise();
  for (Eigen::Index i = 0; i < torn.size(); i += 4) torn[i] += i < torn.size() / 2 ? 0.5 : 0.0;
  solve(torn);
  EXPECT_NE(field_.flags & kUnexplained, 0U);
  const Press patch = press({0.0, 0.0}, 2.5e-3);
  solve(patch.image.col(2) * (400.0 * kGramForce) + noise());
  EXPECT_EQ(field_.flags & (kUnexplained | kOutOfRange), 0U);
  solve(patch.image.col(2) * (600.0 * kGramForce) + noise());
  EXPECT_NE(field_.flags & kOutOfRange, 0U);
}

TEST_F(TouchTest, TheDetectionLimitIsWhatIsFoundInHalfOfTheFrames) {
  const auto limit = paperSolver().detectionLimit_N();
  for (const int axis : {0, 2}) {
    int found = 0;
    constexpr int kFrames = 100;
    std::uniform_int_distribution<int> place(4, 19);
    for (int i = 0; i < kFrames; ++i) {
      const int node = place(random_) * paper().nodes.columns + place(random_);
      solve(influence().col(3 * node + axis) * limit[axis / 2] + noise());
      found += field_.method == Method::kNoContact ? 0 : 1;
    }
    EXPECT_GT(found, 20) << "axis " << axis;
    EXPECT_LT(found, 80) << "axis " << axis;
  }
}

}  // namespace
}  // namespace tractiond::solve::touch_test
