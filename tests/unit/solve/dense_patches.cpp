#include "tests/unit/solve/dense_patches.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace tractiond::solve {

DensePatches::Mixed DensePatches::solve(const Vector& displacement, const std::vector<int>& present,
                                        double noise_px) const {
  const Result alone = DenseModel::solve(displacement, present, noise_px);
  Mixed mixed{alone.forces, alone.wrench, alone.covariance, {}, 0.0, 0.0, {}, {}};
  if (alone.atoms.empty()) return mixed;
  Frame frame{displacement(present), motion_(present, Eigen::all), present, noise_px * noise_px};
  const double residual = alone.residual / frame.n2;
  const Fitted fitted = find(frame, alone.evident, residual + alone.degrees);
  const bool hasPatches = !fitted.patches.empty() && fitted.misfit - residual < 2000;
  const std::vector<Patch> patches = hasPatches ? fitted.patches : std::vector<Patch>{};

  std::vector<Candidate> all = {{alone.evidence - alone.degrees, alone.forces, alone.wrench, alone.covariance}};
  if (!hasPatches || fitted.misfit > residual + alone.degrees) {
    for (Candidate& each : even(frame, alone.evident, alone.degrees)) all.push_back(each);
  }
  const std::size_t firstPatched = all.size();
  if (hasPatches) {
    for (Candidate& each : around(frame, patches)) all.push_back(each);
  }
  double most = all[0].worth, sum = 0.0, ofPatches = 0.0;
  for (const Candidate& each : all) most = std::max(most, each.worth);
  for (Candidate& each : all) sum += each.worth = std::exp(each.worth - most);
  for (std::size_t i = 1; i < all.size(); ++i) (i < firstPatched ? mixed.even : ofPatches) += all[i].worth;
  mixed.even /= sum;
  mixed.forces.setZero();
  mixed.wrench.setZero();
  mixed.covariance.setZero();
  Vector change = Vector::Zero(all.back().change.size());
  for (const Candidate& each : all) {
    mixed.forces += each.worth / sum * each.forces;
    mixed.wrench += each.worth / sum * each.wrench;
    if (each.change.size() > 0) change += each.worth / ofPatches * each.change;
  }
  Matrix unknown = Matrix::Zero(change.size(), change.size());
  for (const Candidate& each : all) {
    const Vector away = each.wrench - mixed.wrench;
    mixed.covariance += each.worth / sum * (each.covariance + away * away.transpose());
    if (each.change.size() == 0) continue;
    const Vector deviation = each.change - change;
    unknown += each.worth / ofPatches * (each.changeCovariance + deviation * deviation.transpose());
  }
  mixed.share = ofPatches / sum;
  const auto count = static_cast<Eigen::Index>(patches.size());
  for (Eigen::Index k = 0; k < count; ++k) {
    Patch patch = patches[static_cast<std::size_t>(k)];
    patch.load += change.segment<4>(4 * k);
    patch.place += change.segment<3>(4 * count + 3 * k);
    mixed.patches.push_back(patch);
    const std::vector<Eigen::Index> own = {
        4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3, 4 * count + 3 * k, 4 * count + 3 * k + 1, 4 * count + 3 * k + 2};
    mixed.patchCovariance.emplace_back(unknown(own, own));
  }
  return mixed;
}

DensePatches::Vector DensePatches::spread(const Eigen::Vector3d& place) const {
  const double pitch2 = pitch_ * pitch_, variance = std::max(place[2], 0.02 * pitch2) + 0.08 * pitch2;
  Eigen::Vector3d at = {place[0], place[1], 0};
  for (Eigen::Index i = 0; i < 2; ++i) at[i] = std::clamp(at[i], points_.row(i).minCoeff(), points_.row(i).maxCoeff());
  const Vector share = (-(points_.colwise() - at).colwise().squaredNorm().array() / (2 * variance)).exp();
  return share / share.sum();
}

DensePatches::Vector DensePatches::centred(const Eigen::Vector3d& place) const {
  Eigen::Vector3d low = place - units(), high = place + units();
  low[2] = high[2] = place[2];
  Vector share;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d middle = (low + high) / 2;
    share = spread(middle);
    const Eigen::Vector3d centroid = points_ * share;
    for (Eigen::Index axis = 0; axis < 2; ++axis) (centroid[axis] < place[axis] ? low : high)[axis] = middle[axis];
  }
  return share;
}

void DensePatches::addForces(const Patch& patch, const Vector& share, Vector& forces) const {
  const Eigen::Vector3d centroid = points_ * share;
  const Eigen::Matrix3Xd arms = points_.colwise() - centroid;
  const double torsion = patch.load[3] / arms.colwise().squaredNorm().dot(share);
  for (Eigen::Index p = 0; p < share.size(); ++p) {
    const Eigen::Vector3d turning = torsion * Eigen::Vector3d::UnitZ().cross(Eigen::Vector3d(arms.col(p)));
    forces.segment<3>(3 * p) += share[p] * (patch.load.head<3>() + turning);
  }
}

DensePatches::Matrix DensePatches::footprint(const Vector& forces) const {
  const Eigen::Index count = points_.cols();
  Vector force(count);
  for (Eigen::Index p = 0; p < count; ++p) force[p] = forces.segment<3>(3 * p).norm();
  const auto averaged = [&](const Vector& of, double reach) {
    Vector result(count);
    for (Eigen::Index p = 0; p < count; ++p) {
      const Eigen::ArrayXd squares = (points_.colwise() - points_.col(p)).colwise().squaredNorm().transpose().array();
      const Vector weights = (-squares / (2 * reach * reach)).exp();
      result[p] = weights.dot(of) / weights.sum();
    }
    return result;
  };
  const Vector near = averaged(force, pitch_ * 2 / 3), square = near.cwiseAbs2();
  const Vector level =
      averaged(square, 2 * pitch_).array() / (averaged(near, 2 * pitch_).array() + 1e-9 * near.maxCoeff());
  const auto at = [&](double edge) {
    Vector e(count);
    for (Eigen::Index p = 0; p < count; ++p) {
      e[p] = level[p] * std::clamp((near[p] / level[p] - (edge - 0.15)) / 0.3, 0.0, 1.0);
    }
    return e;
  };
  const auto beside = [&](Eigen::Index p, Eigen::Index q) {
    return (points_.col(p) - points_.col(q)).cwiseAbs().maxCoeff() < 1.1 * pitch_;
  };
  Vector e = at(0.45), larger = at(0.3), smaller = at(0.6);
  // Every point has the least number of those that it hangs together with.
  std::vector<Eigen::Index> part(static_cast<std::size_t>(count));
  for (Eigen::Index p = 0; p < count; ++p) part[static_cast<std::size_t>(p)] = p;
  for (bool changed = true; changed;) {
    changed = false;
    for (Eigen::Index p = 0; p < count; ++p) {
      for (Eigen::Index q = 0; q < count; ++q) {
        Eigen::Index &mine = part[static_cast<std::size_t>(p)], other = part[static_cast<std::size_t>(q)];
        if (e[p] == 0 || e[q] == 0 || other >= mine || !beside(p, q)) continue;
        mine = other;
        changed = true;
      }
    }
  }
  Vector sums = Vector::Zero(count);
  for (Eigen::Index p = 0; p < count; ++p) sums[part[static_cast<std::size_t>(p)]] += e[p];
  Eigen::Index largest = 0;
  sums.maxCoeff(&largest);
  const auto isOf = [&](Eigen::Index p) { return e[p] > 0 && part[static_cast<std::size_t>(p)] == largest; };
  Matrix result = Matrix::Zero(count, 2);
  for (Eigen::Index p = 0; p < count; ++p) {
    bool isNear = false;
    for (Eigen::Index q = 0; q < count; ++q) isNear = isNear || (isOf(q) && beside(p, q));
    if (isOf(p)) result.row(p) << e[p], -smaller[p] / 2;
    if (isNear) result(p, 1) += larger[p] / 2;
  }
  return result;
}

std::vector<DensePatches::Candidate> DensePatches::even(const Frame& frame, const Vector& forces,
                                                        double fieldDegrees) const {
  const Matrix H = H_(frame.present, Eigen::all);
  const Vector size = H.colwise().squaredNorm().transpose();
  const auto solve = [&](const Vector& from, double rho) {
    const Matrix shown = footprint(from);
    Eigen::Matrix3d along = Eigen::Matrix3d::Zero();
    Vector pressing = Vector::Zero(from.size());
    Matrix extra = Matrix::Zero(from.size(), 6);
    for (Eigen::Index p = 0; p < points_.cols(); ++p) {
      const Eigen::Vector3d force = from.segment<3>(3 * p);
      if (force.norm() > 0) along += force * force.transpose() / force.norm();
      pressing[3 * p] = shown(p, 0);
      extra.block<3, 3>(3 * p, 0).diagonal().setConstant(3 * shown(p, 0));
      extra.block<3, 3>(3 * p, 3).diagonal().setConstant(shown(p, 1));
    }
    Vector whole = beneath(pressing, true);
    for (Eigen::Index a = 0; a < whole.size(); ++a) {
      const bool isTold = !isAmbiguous(a) && !(a < points_.cols() && beyond_[a]);
      if (isTold) whole[a] *= rho * rho;
    }
    std::vector<int> atoms;
    strongest(whole, size, options_.most[0][2], frame.n2, atoms);
    const Eigen::Matrix3d own =
        (1 - options_.turning) * 3 * along / along.trace() + options_.turning * Eigen::Matrix3d::Identity();
    const Matrix does = H.leftCols(from.size()) * extra;  // the points are the first atoms
    const Fit fit = posterior(H, frame.motion, frame.d, frame.n2, atoms, whole,
                              std::vector<Eigen::Matrix3d>(atoms.size(), own), does);
    Matrix toPoints(from.size(), fit.whole.cols());
    toPoints << kronecker(shape_)(Eigen::all, components(atoms)), extra;
    Vector x(fit.whole.cols());
    x << fit.force, fit.extra;
    const Matrix to = wrenches() * toPoints;
    const double degrees = fit.known.sum() + 6 - fit.whole.bottomRightCorner(6, 6).trace();
    return Candidate{fit.evidence - std::max(degrees, fieldDegrees) - std::log(3.0), toPoints * x, to * x,
                     to * fit.whole * to.transpose()};
  };
  const Vector first = solve(forces, 0.4).forces;
  return {solve(first, 0.2), solve(first, 0.4), solve(first, 0.8)};
}

std::vector<DensePatches::Candidate> DensePatches::around(const Frame& frame, const std::vector<Patch>& patches) const {
  const auto count = static_cast<Eigen::Index>(patches.size());
  const Matrix H = H_(frame.present, Eigen::all), columns = columnsOf(frame, patches, {});
  Vector left = frame.d, free(7 * count), wrench = Vector::Zero(6), forces = Vector::Zero(3 * points_.cols());
  Matrix toWrench = Matrix::Zero(6, 7 * count);
  Eigen::Matrix3d along = Eigen::Matrix3d::Zero();
  for (Eigen::Index k = 0; k < count; ++k) {
    const Patch& patch = patches[static_cast<std::size_t>(k)];
    const Eigen::Vector3d at = {patch.place[0], patch.place[1], 0}, force = patch.load.head<3>();
    left -= columns.middleCols<4>(4 * k) * patch.load;
    free.segment<4>(4 * k) = 3 * force.norm() * Eigen::Vector4d(1, 1, 1, pitch_);
    free.segment<3>(4 * count + 3 * k) = Eigen::Vector3d(pitch_, pitch_, pitch_ * pitch_ / 4);
    toWrench.block<3, 3>(0, 4 * k).setIdentity();
    for (Eigen::Index i = 0; i < 3; ++i) {
      toWrench.block<3, 1>(3, 4 * k + i) = at.cross(Eigen::Vector3d::Unit(i));
      if (i < 2) toWrench.block<3, 1>(3, 4 * count + 3 * k + i) = Eigen::Vector3d::Unit(i).cross(force);
    }
    toWrench(5, 4 * k + 3) = 1;
    wrench += toWrench.middleCols<4>(4 * k) * patch.load;
    along += force * force.transpose();
    Patch untwisted = patch;  // torsion tells nothing of what a patch is rough by
    untwisted.load[3] = 0;
    addForces(untwisted, spread(patch.place), forces);
  }
  Matrix extra(frame.d.size(), 7 * count);
  extra << columns, slopesOf(frame, patches, {});
  extra *= free.asDiagonal();

  // The rounds, on what is left without the picture's motion.
  std::vector<Patch> copy = patches;
  Vector motion;
  linear(frame, copy, motion, {});
  const double noise_px = std::sqrt(frame.n2);
  const Modes modes = modesOf(H, frame.motion, noise_px);
  const Vector amplitudes = modes.toAmplitudes * (left - frame.motion * motion);
  const Surest sure = surest(modes, amplitudes);
  const bool isMore = std::sqrt(sure.squaredDeviations) >= options_.surety;
  const Vector nothing = Vector::Zero(shape_.cols());
  const Seen first = isMore ? start(modes, read(modes, amplitudes, leastTau(sure)), sure)
                            : Seen{Vector::Zero(H.cols()), nothing, nothing};
  Seen seen = first;
  const Vector size = H.colwise().squaredNorm().transpose();
  Vector smooth = Vector::Zero(shape_.cols());
  std::vector<Eigen::Matrix3d> omega(static_cast<std::size_t>(shape_.cols()), Eigen::Matrix3d::Identity());
  for (std::size_t i = 0; i < 3; ++i) {
    Vector gamma = coupled(evident(seen)).cwiseQuotient(coupled(seen.known));
    const std::vector<int> atoms = select(gamma, size, options_.most[0][i], frame.n2);
    if (atoms.empty()) break;
    std::vector<Eigen::Matrix3d> direction;
    for (int a = 0; a < shape_.cols(); ++a) direction.push_back(directions(seen, evident(seen), a, i == 2));
    if (i == 2) {
      omega = direction;
      for (const int a : atoms) smooth[a] = gamma[a];
      break;
    }
    std::vector<Eigen::Matrix3d> chosen;
    for (const int a : atoms) chosen.push_back(direction[static_cast<std::size_t>(a)]);
    const Fit fit = posterior(H, frame.motion, left, frame.n2, atoms, gamma, chosen, extra);
    seen = {Vector::Zero(H.cols()), first.known, Vector::Zero(shape_.cols())};
    keep(fit, atoms, seen);
  }

  const Vector rough = beneath(forces, false);
  const Eigen::Matrix3d own =
      (1 - options_.turning) * 3 * along / along.trace() + options_.turning * Eigen::Matrix3d::Identity();
  const int most = smooth.isZero(0.0) ? std::min(options_.most[0][2], options_.mostAlone * static_cast<int>(count))
                                      : options_.most[0][2];
  std::vector<Candidate> found;
  for (const double rho : {0.1, 0.2, 0.4, 0.8}) {
    const Vector whole = smooth + rho * rho * rough;
    std::vector<int> atoms;
    strongest(whole, size, most, frame.n2, atoms);
    std::vector<Eigen::Matrix3d> mixed;
    for (const int a : atoms) {
      const double share = smooth[a] / whole[a];
      mixed.emplace_back(share * omega[static_cast<std::size_t>(a)] + (1 - share) * own);
    }
    const Fit fit = posterior(H, frame.motion, left, frame.n2, atoms, whole, mixed, extra);
    const Matrix toPoints = kronecker(shape_)(Eigen::all, components(atoms));
    Matrix to(6, toPoints.cols() + 7 * count);
    to << wrenches() * toPoints, toWrench * free.asDiagonal();
    Vector x(to.cols());
    x << fit.force, fit.extra;
    Candidate candidate{fit.evidence - std::log(4.0) - static_cast<double>(count) * (std::log(nodes_.count()) + 10),
                        toPoints * fit.force,
                        wrench + to * x,
                        to * fit.whole * to.transpose(),
                        free.cwiseProduct(fit.extra),
                        free.asDiagonal() * fit.whole.bottomRightCorner(7 * count, 7 * count) * free.asDiagonal()};
    for (Eigen::Index k = 0; k < count; ++k) {
      Patch patch = patches[static_cast<std::size_t>(k)];
      patch.load += candidate.change.segment<4>(4 * k);
      patch.place += candidate.change.segment<3>(4 * count + 3 * k);
      addForces(patch, centred(patch.place), candidate.forces);
      const Eigen::Vector2d away = candidate.change.segment<2>(4 * count + 3 * k);
      candidate.wrench.tail<3>() += Eigen::Vector3d(away.x(), away.y(), 0).cross(candidate.change.segment<3>(4 * k));
    }
    found.push_back(candidate);
  }
  return found;
}

}  // namespace tractiond::solve
