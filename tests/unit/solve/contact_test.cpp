// The contact step on the paper's sensor: patches between the nodes, noise, motion of the picture, missing markers.
#include "daemon/solve/solver.h"
#include "tests/unit/solve/presses.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tractiond::solve::contact_test {
namespace {

class ContactTest : public PressTest {
 protected:
  ContactTest() { use(solver_); }

  Solver solver_{paperInverse(), paper()};
};

TEST_F(ContactTest, EqualsDenseLeastSquaresWhateverIsMissing) {
  const Press patch = press({2.0e-3, 4.4e-3}, 4e-3);
  MarkerField markers = seen(patch.image * Vector3d(0.2, 0.4, 2.0) + noise());
  VectorXd amplitudes = VectorXd::Zero(paperInverse().left.stride());
  for (int i = 0; i < influence().rows(); ++i) {
    amplitudes += static_cast<double>(markers.displacement_px[i]) *
                  Eigen::VectorXf::Map(paperInverse().left.row(i), amplitudes.size()).cast<double>();
  }
  std::uniform_int_distribution<int> any(0, paper().markerCount() - 1);
  for (const int missing : {0, 1, 115}) {
    while (markers.validCount > paper().markerCount() - missing) loseMarker(markers, any(random_));
    solver_.solve(markers, field_);
    ASSERT_EQ(field_.method, Method::kContact);

    ContactStep step(paperInverse(), paper().nodes, SolveOptions{});
    std::vector<int> gone;
    std::vector<Eigen::Index> rows;
    std::vector<double> row(static_cast<std::size_t>(paperInverse().influence.stride()), 0.0);
    for (int i = 0; i < influence().rows(); ++i) {
      if (markers.valid[i / 2] == 0) {
        gone.push_back(i);
      } else {
        rows.push_back(i);
        row[i] = markers.displacement_px[i];
      }
    }
    // Any support will do for this: that of the whole picture.
    step.find({amplitudes.data(), static_cast<std::size_t>(amplitudes.size())}, kNoise_px);
    ASSERT_FALSE(step.nodes().empty());
    double squares = 0.0;
    for (const double d : row) squares += d * d;
    ASSERT_TRUE(step.solve(row.data(), gone, squares));

    const auto count = static_cast<Eigen::Index>(step.nodes().size());
    MatrixXd a(influence().rows(), 3 * count + 4);
    VectorXd weight(3 * count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const int node = step.nodes()[i];
      weight.segment<3>(3 * i).setConstant(step.weights()[node]);
      a.middleCols<3>(3 * i) = influence().middleCols<3>(3 * node) * step.weights()[node];
    }
    a.rightCols<4>() = paperMotion().modes;
    const VectorXd d = VectorXd::Map(row.data(), influence().rows());
    MatrixXd stacked(static_cast<Eigen::Index>(rows.size()) + a.cols(), a.cols());
    VectorXd right = VectorXd::Zero(stacked.rows());
    VectorXd penalty = VectorXd::Constant(a.cols(), step.lambda());
    penalty.tail<4>() = kNoise_px * paperMotion().variances.cwiseSqrt().cwiseInverse();
    stacked << a(rows, Eigen::all), MatrixXd(penalty.asDiagonal());
    right.head(static_cast<Eigen::Index>(rows.size())) = d(rows);
    const VectorXd x = stacked.colPivHouseholderQr().solve(right);
    const VectorXd expected = weight.cwiseProduct(x.head(3 * count));
    const VectorXd actual = VectorXd::Map(step.forces().data(), 3 * count);
    EXPECT_LT((actual - expected).norm(), 1e-4 * expected.norm()) << missing << " missing";
    const double residual = (d(rows) - (a * x)(rows)).squaredNorm();
    EXPECT_NEAR(step.squaredResidual(), residual, 1e-4 * residual);

    // Posterior covariance of a force and of its sum.
    const MatrixXd covariance = kNoise_px * kNoise_px * (stacked.transpose() * stacked).inverse();
    std::vector<double> functional(ContactStep::kMostUnknowns, 0.0), deviations(3 * ContactStep::kMostNodes);
    VectorXd sum = VectorXd::Zero(a.cols());
    for (Eigen::Index i = 0; i < count; ++i) {
      functional[3 * i + 2] = 1.0;
      sum[3 * i + 2] = weight[3 * i + 2];
    }
    step.prepare(functional.data());
    const double variance = sum.dot(covariance * sum);
    EXPECT_NEAR(step.covariance(functional.data(), functional.data()), variance, 1e-3 * variance);
    step.deviations(deviations.data());
    EXPECT_NEAR(deviations[2], weight[2] * std::sqrt(covariance(2, 2)), 1e-3 * deviations[2]);
  }
}

TEST_F(ContactTest, AContactThatSlidesOverTheRimIsReadWithoutAStep) {
  const VectorXd still = noise();
  const Vector3d force(1.0, 0.2, 1.5);
  Vector3d last = Vector3d::Zero();
  for (double x = 20e-3; x < 34e-3; x += 0.1e-3) {
    solve(press({x, -8.2e-3}, 2.5e-3).image * force + still);
    EXPECT_LT((resultant() - force).norm(), 0.025 * force.norm()) << "at " << 1e3 * x << " mm";
    if (x > 20e-3) {
      EXPECT_LT((resultant() - last).norm(), 0.6 * kGramForce) << "at " << 1e3 * x << " mm";
    }
    last = resultant();
  }
}

// By the nodes alone a shear in the corner of a thin gel came with 3 % of it as a false press.
TEST_F(ContactTest, AContactAtTheRimIsReadAsOneInTheMiddle) {
  for (const Vector2d& at : {Vector2d(-33e-3, -33e-3), Vector2d(20e-3, -33e-3), Vector2d(33e-3, 6e-3)}) {
    const Press patch = press(at, 2.5e-3);
    for (const Vector3d& force : {Vector3d(4.0, 0.0, 0.0), Vector3d(0.0, 4.0, 0.0), Vector3d(0.0, 0.0, 4.0)}) {
      solve(patch.image * force);
      EXPECT_EQ(field_.method, Method::kContact);
      ASSERT_EQ(field_.contactCount, 1);
      EXPECT_LT((resultant() - force).norm(), 0.007 * force.norm()) << at.transpose() << ": " << force.transpose();
      for (int i = 0; i < 6; ++i) {
        EXPECT_NEAR(field_.contacts[0].force_N[i % 3], force[i % 3], 0.007 * force.norm());
        EXPECT_LT(std::sqrt(field_.noise[7 * i]), i < 3 ? 0.045 : 1.6e-3);
      }
      EXPECT_LT((Vector2d::Map(field_.contacts[0].position_m.data()) - at).norm(), 0.08e-3);
      MarkerField some = seen(patch.image * force);
      for (int marker = 3; marker < paper().markerCount(); marker += 10) loseMarker(some, marker);
      solver_.solve(some, field_);
      EXPECT_LT((resultant() - force).norm(), 0.01 * force.norm()) << at.transpose() << ": " << force.transpose();
    }
  }
}

// A patch and what its nodes lack once drove each other away: in a corner, single frames of 25 gf were read as 60.
TEST_F(ContactTest, AWeakPressInACornerIsReadWithinItsInterval) {
  const Press corner = press({-33e-3, -33e-3}, 2.5e-3);
  const Vector3d force(0.0, 0.0, 25.0 * kGramForce);
  Vector3d mean = Vector3d::Zero();
  constexpr int kFrames = 300;
  for (int i = 0; i < kFrames; ++i) {
    solve(corner.image * force + noise());
    const Vector3d error = resultant() - force;
    mean += error / kFrames;
    EXPECT_LT(std::abs(error.z()), 5.0 * std::sqrt(field_.noise[14])) << "frame " << i;
  }
  EXPECT_LT(mean.norm(), 0.5 * kGramForce);
}

TEST_F(ContactTest, WhatMayLieBeyondTheOutermostNodesIsInDoubt) {
  const double force = 400.0 * kGramForce;
  for (const double x : {0.0, 31.5e-3}) {
    const Vector2d at(x, -20e-3);
    const Press disc = press(at, sensor::elastic::disc(at, 8e-3, Vector3d::UnitZ()));
    int inside = 0;
    for (int i = 0; i < 40; ++i) {
      solve(disc.image.col(2) * force + noise());
      // Of the systematic part, what the sensor's numbers do is the same everywhere and not in this picture.
      const double doubt = field_.systematic[0];  // along x, where nothing acts
      inside += std::abs(resultant().z() - force) < 1.96 * std::sqrt(field_.noise[14] + doubt) ? 1 : 0;
      EXPECT_EQ(doubt > square(0.005 * force), x > 0.0);
    }
    EXPECT_GE(inside, 36) << x;
  }
}

TEST_F(ContactTest, AGrowingContactIsReadWithoutAStepThroughTheFallback) {
  const sensor::Points nodes = sensor::nodePositions(paper().nodes);
  const VectorXd still = noise();
  Vector3d last = Vector3d::Zero();
  bool contact = false, blend = false, face = false;
  for (double reach = 4.0; reach < 30.0; reach += 0.05) {
    VectorXd forces = VectorXd::Zero(influence().cols());
    for (Eigen::Index n = 0; n < nodes.cols(); ++n) {
      const double edge = (reach - 1e3 * nodes.col(n).norm()) / 3.0;  // a pitch from full to nothing
      forces[3 * n + 2] = std::clamp(edge, 0.0, 1.0);
    }
    forces *= 4.0 / forces.sum();
    solve(influence() * forces + still);
    if (reach > 4.0) {
      EXPECT_LT((resultant() - last).norm(), 8.0 * kGramForce) << "at " << reach << " mm";
    }
    last = resultant();
    contact |= field_.method == Method::kContact;
    blend |= field_.method == Method::kBlend;
    face |= field_.method == Method::kWholeFace;
    EXPECT_NEAR(resultant().z(), 4.0, 0.3);
  }
  EXPECT_TRUE(contact && blend && face);
}

// What no force explains grows from nothing, and the whole face takes over: also from a contact at the rim.
TEST_F(ContactTest, ACornerIsReadWithoutAStepThroughTheFallback) {
  const VectorXd still = noise(), strange = noise();
  const Vector3d force(2.0, -1.0, 3.0);
  const VectorXd image = press({-33e-3, -33e-3}, 2.5e-3).image * force + still;
  Vector3d last = Vector3d::Zero();
  double largest = 0.0, whole = 0.0;
  bool contact = false, blend = false, face = false;
  for (int step = 0; step <= 600; ++step) {
    solve(image + 0.02 * step * strange);
    if (step > 0) {
      largest = std::max(largest, (resultant() - last).norm());
      whole += (resultant() - last).norm();
    }
    last = resultant();
    contact |= field_.method == Method::kContact;
    blend |= field_.method == Method::kBlend;
    face |= field_.method == Method::kWholeFace;
  }
  EXPECT_TRUE(contact && blend && face);
  EXPECT_LT(largest, 0.04 * whole);
  std::printf("largest step %.2f gf of %.1f gf\n", largest / kGramForce, whole / kGramForce);
}

}  // namespace
}  // namespace tractiond::solve::contact_test
