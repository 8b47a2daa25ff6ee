// Counts the calls of operator new, and of malloc, which Eigen's matrices come from, where no sanitizer has it.
#include "daemon/solve/linear_model.h"
#include "daemon/solve/model_contacts.h"
#include "daemon/solve/model_solver.h"
#include "tests/support/allocations.h"
#include "tests/unit/solve/sensors.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace {

std::atomic<std::uint64_t> mallocs{0};

std::uint64_t allocations() {
  return tractiond::support::allocations() + mallocs;
}

}  // namespace

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT(*-reserved-identifier): glibc's own
extern "C" void* malloc(std::size_t size) noexcept {
  ++mallocs;
  return __libc_malloc(size);
}
#endif

namespace tractiond::solve::allocation_test {
namespace {

void expectNoAllocation(FieldSolver& solver, const sensor::Sensor& sensor, const Eigen::MatrixXd& influence) {
  const SolveOptions options;
  TractionField forces;
  forces.resize(sensor.markerCount(), sensor.nodes.count());
  const MarkerField whole = fieldOf(influence * Eigen::VectorXd::Ones(influence.cols()));
  MarkerField some = whole, others = whole, most = whole;
  const int capacity = static_cast<int>(options.maxMissingFraction * sensor.markerCount());
  for (int i = 0; i < capacity; ++i) {
    loseMarker(some, i);
    loseMarker(others, sensor.markerCount() - 1 - i);
  }
  for (int i = 0; i <= capacity; ++i) loseMarker(most, i);
  // Two contacts that are close.
  Eigen::VectorXd twoForces = Eigen::VectorXd::Zero(influence.cols());
  for (const int node : {15, 18}) twoForces[3 * node + 2] = 1.0;
  const MarkerField two = fieldOf(influence * twoForces);
  MarkerField someOfTwo = two;
  for (int i = 0; i < capacity / 2; ++i) loseMarker(someOfTwo, 2 * i);

  // One at the rim.
  Eigen::VectorXd oneForce = Eigen::VectorXd::Zero(influence.cols());
  oneForce[3 * 7 + 2] = 1.0;
  const MarkerField one = fieldOf(influence * oneForce);
  MarkerField someOfOne = one;
  for (int i = 0; i < capacity / 2; ++i) loseMarker(someOfOne, 2 * i);

  const MarkerField* const fields[] = {&whole, &some, &others, &most, &whole, &two, &someOfTwo, &one, &someOfOne};
  const auto before = allocations();
  for (const MarkerField* field : fields) {
    solver.solve(*field, forces);
    EXPECT_EQ(allocations(), before);
    EXPECT_EQ(forces.valid, field != &most);
    if (field == &two || field == &someOfTwo) {
      EXPECT_EQ(forces.contactCount, 2);
    }
  }
}

TEST(ModelSolver, AllocatesNothingWhateverIsMissing) {
  const sensor::Sensor sensor = smallSensor();
  const Atoms atoms = makeAtoms(sensor);
  const Eigen::MatrixXd points = halfSpaceImage(sensor, atoms.points);
  const double scale_N = sensor.gel.youngsModulus * square(sensor.nodes.pitch);
  const Factors factors = computeFactors(points, atoms, still(points.rows()), scale_N, SolveOptions{}).value();
  ModelSolver solver(factors, atoms, sensor);
  expectNoAllocation(solver, sensor, halfSpaceImage(sensor, sensor::nodePositions(sensor.nodes)));
}

TEST(LinearModel, AllocatesNothingWhenItAnswers) {
  const sensor::Sensor sensor = smallSensor();
  const Atoms atoms = makeAtoms(sensor);
  SolveOptions options;
  options.model = sensor::elastic::Model::kHalfSpace;
  const Factors factors = computeFactors(sensor, atoms, options).value();
  Model model(sensor, factors, atoms, options);
  Modes modes(factors, atoms, options);
  LinearModel linear(factors, atoms, modes.strong());
  LinearScratch scratch;
  const SystematicPart systematic(factors, sensor);
  ModelContacts listing(atoms, sensor, systematic);
  std::array<Contact, kMaxContacts> contacts;
  Estimate estimate;
  estimate.force_N.resize(3 * atoms.pointCount());
  const Eigen::VectorXd pressed =
      halfSpaceImage(sensor, Eigen::Vector3d(1e-3, 2e-3, 0.0)) * Eigen::Vector3d(0.1, 0.0, 1.0);
  const Eigen::MatrixXd even = halfSpaceImage(sensor, sensor::nodePositions(sensor.nodes));
  const Eigen::VectorXd broad = even * Eigen::VectorXd::Constant(even.cols(), 0.05);
  std::vector<double> deviations(3 * atoms.nodeCount());
  for (const Eigen::VectorXd& moved : {pressed, broad}) {
    const Picture before(factors, moved, {}, options.noise_px);
    model.solve(before, estimate);
    ASSERT_EQ(estimate.outcome, Estimate::Outcome::kFound);
    ASSERT_TRUE(linear.make(model, estimate, scratch));
    for (const std::vector<int>& missing : {std::vector<int>{}, {2, 3, 10, 11, 100, 101}}) {
      const Picture picture(factors, moved, missing, 2.0 * options.noise_px);
      const auto then = allocations();
      modes.look(picture);
      const bool holds = linear.answer(picture, modes, estimate);
      const auto answered = allocations();
      linear.mixture().nodeDeviations_N(deviations);
      const auto deviated = allocations();
      listing.list(estimate, linear.mixture(), 0.01, contacts);
      const auto listed = allocations();
      EXPECT_TRUE(holds);
      EXPECT_EQ(answered, then);
      EXPECT_EQ(deviated, answered);
      EXPECT_EQ(listed, deviated);
    }
  }
}

}  // namespace
}  // namespace tractiond::solve::allocation_test
