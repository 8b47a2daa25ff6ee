#include "tests/simulation/linear_solver.h"

#include "daemon/solve/wrench.h"

namespace tractiond::simulation {
namespace {

constexpr double kTouches = 2.0;  ///< something does if the squares exceed so many of noise

}  // namespace

LinearSolver::LinearSolver(const Gel& gel)
    : gel_(gel)
    , rules_(gel.sensor, gel.options)
    , used_(gel.sensor.markerCount(), gel.options)
    , displacement_px_(gel.influence.rows())
    , force_N_(gel.influence.cols())
    , residual_px_(gel.influence.rows()) {}

void LinearSolver::solve(const MarkerField& markers, TractionField& field) noexcept {
  field.markers = markers;
  field.flags = markers.flags;
  solve::FieldRules::clear(field);
  if ((markers.flags & kGelMismatch) != 0) return;
  if ((markers.flags & kFewMarkers) != 0 || !used_.choose(markers)) {
    field.flags |= kFewMarkers;
    return;
  }
  field.valid = true;
  field.solution = Solution::kFull;
  const double noise_px2 = solve::square(used_.noise_px());
  Eigen::Map<Eigen::Matrix<double, 6, 6>>(field.noise.data()) = noise_px2 * gel_.covariance;
  if (used_.squares_px2() <= kTouches * noise_px2 * used_.count()) {
    field.method = Method::kNoContact;
    return solve::FieldRules::explain(used_.squares_px2(), used_, field);
  }
  field.method = Method::kContact;
  displacement_px_ = Eigen::VectorXd::Map(used_.row_px().data(), displacement_px_.size()).cast<float>();
  force_N_.noalias() = gel_.inverse * displacement_px_;
  residual_px_ = displacement_px_;
  residual_px_.noalias() -= gel_.influence * force_N_;
  for (const int coordinate : used_.missing()) residual_px_[coordinate] = 0.0F;

  Eigen::VectorXf::Map(field.force_N.data(), force_N_.size()) = force_N_;
  const auto noise_px = static_cast<float>(used_.noise_px());
  Eigen::VectorXf::Map(field.deviation_N.data(), force_N_.size()) = noise_px * gel_.deviation;
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t n = 0; n < rules_.nodes().size(); ++n) {
    const Eigen::Vector3d force = force_N_.segment<3>(3 * static_cast<Eigen::Index>(n)).cast<double>();
    wrench += solve::unitWrenches(Eigen::Vector3d::Map(rules_.nodes()[n].data())) * force;
  }
  std::copy_n(wrench.begin(), 3, field.resultant_N.begin());
  std::copy_n(wrench.begin() + 3, 3, field.moment_Nm.begin());
  solve::FieldRules::explain(residual_px_.squaredNorm(), used_, field);
  rules_.centre(field);
  if (solve::FieldRules::finite(field)) return;
  solve::FieldRules::clear(field);
  field.flags = markers.flags;
  field.work.failed = true;
}

}  // namespace tractiond::simulation
