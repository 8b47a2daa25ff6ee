#include "twin/round_contact.h"

#include <algorithm>
#include <cmath>

namespace twin {

namespace {

constexpr double kSpacing = 0.1e-3;     // of the springs [m]; stick ratios are as coarse as this over the radius
constexpr int kSprings = 100;           // up to a radius of 10 mm
constexpr int kPart = 3;                // springs from one radius of radii() to the next
constexpr double kRelaxation = 0.5e-3;  // [s] viscosity of the gel over its modulus: silicone's loss at some 50 Hz

double middle(std::size_t spring) {
  return (static_cast<double>(spring) + 0.5) * kSpacing;
}

/// Returns the reduced profile of a flat face with a rounded edge (Popov and Heß 2015, 2.5.5); of a ball without one.
double reduced(const Profile& profile, double x) {
  if (x <= profile.flat) return 0.0;
  const double root = std::sqrt(x * x - profile.flat * profile.flat);
  const double angle = profile.flat > 0.0 ? std::acos(profile.flat / x) : 0.0;
  return x / profile.curvature * (root - profile.flat * angle);
}

}  // namespace

RoundContact::RoundContact(const sensor::Gel& gel, const Profile& profile, double friction)
    : normal_(gel.youngsModulus / (1 - gel.poissonRatio * gel.poissonRatio))
    , tangential_(2 * gel.youngsModulus / ((1 + gel.poissonRatio) * (2 - gel.poissonRatio)))
    , friction_(friction)
    , springs_(kSprings) {
  for (std::size_t i = 0; i < springs_.size(); ++i) springs_[i].height = reduced(profile, middle(i));
}

double RoundContact::normalForce(double approach) const {
  double force = 0.0;
  for (const Spring& spring : springs_) {
    if (spring.height >= approach) break;
    force += 2 * kSpacing * normal_ * (approach - spring.height);
  }
  return force;
}

void RoundContact::move(double approach, const Eigen::Vector2d& step, double duration) {
  std::size_t touching = 0, sticking = 0;
  force_.setZero();
  for (Spring& spring : springs_) {
    if (spring.height >= approach) {
      spring.strain.setZero();
      spring.force.setZero();
      continue;
    }
    const double pressed = normal_ * (approach - spring.height), most = friction_ * pressed;
    spring.strain += step;
    Eigen::Vector2d sheared = tangential_ * (spring.strain + (kRelaxation / duration) * step);
    if (const double excess = sheared.norm() / most; excess > 1.0) {
      sheared /= excess;
      spring.strain = sheared / tangential_;
    } else {
      sticking = touching + 1;
    }
    spring.force << sheared, pressed;
    force_ += 2 * kSpacing * spring.force;
    ++touching;
  }
  radius_ = static_cast<double>(touching) * kSpacing;
  stickRatio_ = touching > 0 ? static_cast<double>(sticking) / static_cast<double>(touching) : 1.0;
}

std::vector<double> RoundContact::radii() {
  std::vector<double> all;
  for (int i = kPart; i <= kSprings; i += kPart) all.push_back(i * kSpacing);
  return all;
}

// A pressure of Hertz with radius r and force F has the force 3 F (r^2 - x^2) / (4 r^3) per length of the row. Between
// two radii the row is taken as linear in x^2, as the sum of such pressures is.
Eigen::Matrix3Xd RoundContact::parts() const {
  const std::vector<double> all = radii();
  const auto count = static_cast<Eigen::Index>(all.size());
  Eigen::Matrix3Xd slopes = Eigen::Matrix3Xd::Zero(3, count + 1);  // -d force / d x^2 inside of each radius
  Eigen::Vector3d inner = springs_.front().force;
  double from = 0.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::size_t at = static_cast<std::size_t>(i + 1) * kPart;
    const Eigen::Vector3d outer = at < springs_.size()
                                      ? Eigen::Vector3d(0.5 * (springs_[at - 1].force + springs_[at].force))
                                      : Eigen::Vector3d::Zero();
    const double to = all[static_cast<std::size_t>(i)];
    slopes.col(i) = (inner - outer) / (to * to - from * from);
    inner = outer;
    from = to;
  }
  Eigen::Matrix3Xd forces(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    forces.col(i) = (slopes.col(i) - slopes.col(i + 1)) * (4.0 / 3.0 * std::pow(all[static_cast<std::size_t>(i)], 3));
  }
  return forces;
}

}  // namespace twin
