// What is stated of contacts, against loads that are known.
#include "daemon/solve/model_contacts.h"
#include "daemon/solve/wrench.h"
#include "tests/unit/solve/linear_bench.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <numbers>

namespace tractiond::solve {
namespace {

using Contacts = std::span<const Contact>;

/// A sensor with errors of its own, and the list of its contacts.
class ContactBench {
 public:
  ContactBench() {
    factors_.systematicErrors = {.contact = {}, .wholeFace = {}, .contactScatter = {}, .wholeFaceScatter = {}};
    for (int i = 0; i < 2 * 36; ++i) {
      factors_.systematicErrors.contact.push_back(1e-3 * std::cos(i));
      factors_.systematicErrors.wholeFace.push_back(2e-3 * std::sin(i));
    }
  }

  LinearBench& bench() { return bench_; }
  const SystematicPart& systematic() const { return systematic_; }

  Contacts list(const Estimate& estimate, Mixture& mixture) {
    const int count = listing_.list(estimate, mixture, 0.01, contacts_);
    return {contacts_.data(), static_cast<std::size_t>(count)};
  }
  Contacts solve(const VectorXd& picture, Estimate& estimate) {
    estimate = bench_.make(picture);
    return list(estimate, bench_.model().mixture());
  }
  /// By the model of the last solve().
  Contacts answer(const VectorXd& picture) {
    EXPECT_TRUE(bench_.answer(picture));
    return list(bench_.later(), bench_.linear().mixture());
  }

 private:
  LinearBench bench_;
  Factors factors_;
  SystematicPart systematic_{factors_, bench_.sensor()};
  ModelContacts listing_{bench_.atoms(), bench_.sensor(), systematic_};
  std::array<Contact, kMaxContacts> contacts_;
};

Vector3d pointOf(const Contact& contact) {
  return {contact.position_m[0], contact.position_m[1], contact.positionZ_m};
}

/// Force and moment about a point [m], from those about the origin.
Wrench about(const Vector3d& point, Wrench wrench) {
  wrench.tail<3>() -= point.cross(Vector3d(wrench.head<3>()));
  return wrench;
}

/// The same of a covariance.
Matrix6 covarianceAbout(const Vector3d& point, const Matrix6& covariance) {
  Matrix6 move;
  for (Index i = 0; i < 6; ++i) move.col(i) = about(point, Wrench::Unit(i));
  return move * covariance * move.transpose();
}

/// What is stated less what acts, in standard deviations of the noise.
Wrench errorOf(const Contact& contact, const Load& load) {
  const Wrench error = wrenchOf(contact) - about(pointOf(contact), wrenchOf(load));
  return error.array() / Matrix6::Map(contact.noise.data()).diagonal().array().sqrt();
}

/// What the contacts leave of the wrench.
Wrench restOf(const Estimate& estimate, Contacts contacts) {
  Wrench rest = wrenchOf(estimate);
  for (const Contact& each : contacts) rest -= about(-pointOf(each), wrenchOf(each));
  return rest;
}

const Load kTwisted = disc(6, -4, 2.5, 10 * kPress + 3 * kShear - 2 * kAcross, 6.0);  // N, N mm

TEST(Contacts, HaveTheTorqueOfTheirLoad) {
  ContactBench contacts;
  Estimate estimate;
  const auto expectTruth = [](Contacts found, const Load& load) {
    ASSERT_EQ(found.size(), 1U);
    EXPECT_LT(errorOf(found[0], load).cwiseAbs().maxCoeff(), 4.0);
    EXPECT_NEAR(found[0].moment_Nm[0], 0.0, 1e-12);  // it presses
    EXPECT_NEAR(found[0].moment_Nm[1], 0.0, 1e-12);
    const double deviation = std::sqrt(found[0].noise[35]);
    EXPECT_GT(deviation, 1e-5);
    EXPECT_LT(deviation, 3e-4);  // else a torque of 6 mN m says little
  };
  expectTruth(contacts.solve(contacts.bench().picture(kTwisted, 1), estimate), kTwisted);
  EXPECT_GT(estimate.patchShare, 0.9);
  expectTruth(contacts.answer(contacts.bench().picture(kTwisted, 2)), kTwisted);
  const Load later = disc(6.2, -4.2, 2.5, 8 * kPress + 1.5 * kShear - kAcross, 2.0);
  expectTruth(contacts.answer(contacts.bench().picture(later, 3)), later);
}

TEST(Contacts, HaveEachTheirOwnWrench) {
  ContactBench contacts;
  Estimate estimate;
  const Load left = disc(-6, -4, 2, 5 * kPress - kShear, 3.0), right = disc(6, 4, 2, 8 * kPress + kAcross, -4.0);
  const auto expectTruth = [&](Contacts found) {
    ASSERT_EQ(found.size(), 2U);
    EXPECT_LT(errorOf(found[0], right).cwiseAbs().maxCoeff(), 4.0);
    EXPECT_LT(errorOf(found[1], left).cwiseAbs().maxCoeff(), 4.0);
    for (const Contact& each : found) {
      EXPECT_GT(std::sqrt(each.noise[35]), 1e-5);
      EXPECT_LT(std::sqrt(each.noise[35]), 4e-4);
    }
  };
  expectTruth(contacts.solve(contacts.bench().picture(both(left, right), 5), estimate));
  EXPECT_GT(estimate.patchShare, 0.9);
  expectTruth(contacts.answer(contacts.bench().picture(both(left, right), 6)));
}

TEST(Contacts, AddUpToTheResultant) {
  const std::vector<std::pair<const char*, Load>> loads = {
      {"one", kTwisted},
      {"two", both(disc(-6, -4, 2, 5 * kPress, 2.0), disc(6, 4, 2, 8 * kPress + kShear, -3.0))},
      {"a bar", both(both(disc(-4, 0, 2, 3 * kPress), disc(0, 0, 2, 3 * kPress)), disc(4, 0, 2, 3 * kPress, 1.0))},
      {"in a corner, beyond the nodes", disc(-11, -9, 1.5, 5 * kPress + kAcross, 1.0)},
      {"even", disc(0.5, -0.7, 9, 6 * kPress)},
  };
  unsigned seed = 10;
  for (const auto& [name, load] : loads) {
    ContactBench contacts;
    Estimate estimate;
    for (const bool isLinear : {false, true}) {
      SCOPED_TRACE(testing::Message() << name << (isLinear ? ", by an earlier model" : ""));
      const VectorXd picture = contacts.bench().picture(isLinear ? moved(load, 0.3, -0.2, 1.2) : load, ++seed);
      const Contacts found = isLinear ? contacts.answer(picture) : contacts.solve(picture, estimate);
      const Wrench rest = restOf(isLinear ? contacts.bench().later() : estimate, found);
      EXPECT_LT(rest.head<3>().norm(), 1e-9);
      EXPECT_LT(rest.tail<3>().norm(), 1e-11);
    }
  }
}

/// A contact that is all there is has what is stated of the resultant. Where it does not press, its noise is that of
/// functionals.
TEST(Contacts, OneHasTheUncertaintyOfTheResultant) {
  for (const Load& load : {kTwisted, disc(6, -4, 2.5, 5 * kShear, 4.0), disc(0.5, -0.7, 9, 6 * kPress)}) {
    ContactBench contacts;
    Estimate estimate;
    for (const bool isLinear : {false, true}) {
      const VectorXd picture = contacts.bench().picture(load, 30);
      const Contacts found = isLinear ? contacts.answer(picture) : contacts.solve(picture, estimate);
      if (isLinear) estimate = contacts.bench().later();
      ASSERT_EQ(found.size(), 1U);
      const auto expectSame = [&](const WrenchCovariance& stated, const MatrixXd& aboutOrigin, double tolerance) {
        const Matrix6 expected = covarianceAbout(pointOf(found[0]), aboutOrigin);
        const VectorXd scale = expected.diagonal().cwiseSqrt().cwiseInverse();
        EXPECT_LT((scale.asDiagonal() * (Matrix6::Map(stated.data()) - expected) * scale.asDiagonal()).norm(),
                  tolerance);
      };
      expectSame(found[0].noise, covarianceOf(estimate), 1e-3);  // shares of a patch change by differences
      const WrenchCovariance systematic =
          contacts.systematic().covariance(estimate.wrench, all(nodeForces(estimate, contacts.bench().atoms())));
      expectSame(found[0].systematic, MatrixXd(Matrix6::Map(systematic.data())), 1e-6);
    }
  }
}

/// An even pressure on an ellipse.
Load ellipse(double x_mm, double y_mm, double a_mm, double b_mm, double angle, const Vector3d& force_N) {
  Load load;
  for (const PointForce& at : disc(0.0, 0.0, 1.0, force_N)) {
    const double along = a_mm * at.x_mm, across = b_mm * at.y_mm;
    load.push_back({x_mm + std::cos(angle) * along - std::sin(angle) * across,
                    y_mm + std::sin(angle) * along + std::cos(angle) * across, at.force});
  }
  return load;
}

/// Returns the angle in [-pi/2, pi/2) of the same axis.
double ofAxis(double angle) {
  return angle - std::numbers::pi * std::floor(angle / std::numbers::pi + 0.5);
}

TEST(Contacts, HaveTheShapeOfTheirLoad) {
  double squares = 0.0;
  int count = 0;
  for (const double angle : {-1.5, -0.7, 0.0, 0.6, 1.4}) {
    for (const auto& [load, ratio] : {std::pair{ellipse(0.4, -0.5, 9.0, 4.0, angle, 20 * kPress), 9.0 / 4.0},
                                      {ellipse(0.4, -0.5, 8.0, 2.5, angle, 20 * kPress), 8.0 / 2.5}}) {
      ContactBench contacts;
      Estimate estimate;
      for (const bool isLinear : {false, true}) {
        const VectorXd picture = contacts.bench().picture(load, isLinear ? 5 : 6);
        const Contacts found = isLinear ? contacts.answer(picture) : contacts.solve(picture, estimate);
        ASSERT_EQ(found.size(), 1U);
        const auto& [larger, smaller] = found[0].halfAxes_m;
        const auto& [ofLarger, ofSmaller] = found[0].halfAxesDeviation_m;
        EXPECT_NEAR(std::numbers::pi * larger * smaller, found[0].area_m2, 1e-9 * found[0].area_m2);
        EXPECT_NEAR(std::log(larger / smaller / ratio), 0.0, 2.0 * (ofLarger / larger + ofSmaller / smaller));
        EXPECT_LT(found[0].orientationDeviation_rad, 0.2);
        squares += square(ofAxis(found[0].orientation_rad - angle) / found[0].orientationDeviation_rad);
        ++count;
      }
    }
  }
  EXPECT_LT(squares, 2.0 * count);
  EXPECT_GT(squares, 0.05 * count);
}

/// Two patches that are one contact.
TEST(Contacts, OfPatchesAreAsLongAsThesePatchesLieApart) {
  ContactBench contacts;
  Estimate estimate;
  contacts.solve(contacts.bench().picture(both(disc(-6, -4, 2, 5 * kPress), disc(6, 4, 2, 8 * kPress)), 5), estimate);
  ASSERT_EQ(estimate.patchCount, 2);
  for (FoundPatch& each : estimate.patches) each.contact = 0;
  const Contacts found = contacts.list(estimate, contacts.bench().model().mixture());
  ASSERT_EQ(found.size(), 1U);
  const auto& [left, right] = std::pair{estimate.patches[0].patch, estimate.patches[1].patch};
  const double apart = std::hypot(left.place.x_m - right.place.x_m, left.place.y_m - right.place.y_m);
  const double share = left.load[2] / (left.load[2] + right.load[2]);
  const double spread = share * left.place.spread_m2 + (1.0 - share) * right.place.spread_m2;
  const double ratio = std::sqrt((spread + share * (1.0 - share) * square(apart)) / spread);
  EXPECT_NEAR(found[0].halfAxes_m[0] / found[0].halfAxes_m[1], ratio, 1e-9 * ratio);
  EXPECT_NEAR(found[0].orientation_rad, std::atan2(4.0, 6.0), 0.05);
}

TEST(Contacts, OfARoundPatchAreRoundWithTheRadiusOfTheBallsPressure) {
  ContactBench contacts;
  Estimate estimate;
  const Contacts round = contacts.solve(contacts.bench().picture(disc(6, -4, 2.5, 10 * kPress), 1), estimate);
  ASSERT_EQ(round.size(), 1U);
  const double radius = std::sqrt(round[0].area_m2 / std::numbers::pi);
  for (const double axis : round[0].halfAxes_m) EXPECT_NEAR(axis, radius, 1e-9 * radius);
  for (const double deviation : round[0].halfAxesDeviation_m) {
    EXPECT_NEAR(deviation / radius, 0.5 * round[0].areaDeviation_m2 / round[0].area_m2, 1e-9);
  }
  EXPECT_EQ(round[0].orientationDeviation_rad, std::numbers::pi / std::sqrt(12.0));
  const double wanted_m = std::sqrt(5.0 / 4.0) * 2.5e-3;  // of the spread of an even disc, r^2 / 4
  EXPECT_NEAR(round[0].hertzRadius_m, wanted_m, 2.0 * round[0].hertzRadiusDeviation_m);
  EXPECT_GT(round[0].hertzRadiusDeviation_m, 0.0);
  EXPECT_LT(round[0].hertzRadiusDeviation_m, 0.2 * wanted_m);
  const Contacts large =
      contacts.solve(contacts.bench().picture(ellipse(0.4, -0.5, 9.0, 4.0, 0.3, 20 * kPress), 2), estimate);
  ASSERT_EQ(large.size(), 1U);
  EXPECT_EQ(large[0].hertzRadius_m, 0.0);
}

}  // namespace
}  // namespace tractiond::solve
