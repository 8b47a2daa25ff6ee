#include "tests/unit/solve/dense_patches.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace tractiond::solve {

DensePatches::DensePatches(const sensor::NodeGrid& nodes, double depth_m, const Matrix& influence, const Matrix& motion,
                           double force_N, const ModelOptions& options, const HalfSpace& halfSpace)
    : DenseModel(nodes, depth_m, influence, motion, force_N, options)
    , nodes_(nodes)
    , pitch_(nodes.pitch)
    , columns_(nodes.columns + 4)
    , halfSpace_(halfSpace)
    , rest_(influence - halfSpace(points_)) {}

DensePatches::Matrix DensePatches::columns(const Eigen::Vector3d& place) const {
  const double spread = std::max(place[2], 0.0), arm = std::sqrt(20 * std::max(spread, pitch_ * pitch_ / 20) / 7);
  const double radius = std::sqrt(spread * 2 / 0.7);
  sensor::Points at(3, 13);
  Matrix forces = Matrix::Zero(39, 4);
  for (int i = 0; i < 13; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / 6;
    const Eigen::Vector3d out = {std::cos(angle), std::sin(angle), 0};
    const double away = i == 12 ? 0 : i < 6 ? radius : arm;
    at.col(i) = Eigen::Vector3d(place[0], place[1], 0) + away * out;
    if (i < 6 || i == 12) forces.block<3, 3>(3 * i, 0).diagonal().setConstant(i == 12 ? 0.3 : 0.7 / 6);
    if (i >= 6 && i < 12) forces.block<3, 1>(3 * i, 3) = Eigen::Vector3d::UnitZ().cross(out) / (6 * arm);
  }
  Matrix result = halfSpace_(at) * forces;
  const Eigen::Vector2d centre = inGrid(place);
  const int rows = static_cast<int>(points_.cols()) / columns_;
  const int left = std::clamp(static_cast<int>(std::floor(centre[0])) - 2, 0, columns_ - 6);
  const int below = std::clamp(static_cast<int>(std::floor(centre[1])) - 2, 0, rows - 6);
  for (int i = 0; i < 13; ++i) {
    const Eigen::Vector2d here = inGrid(at.col(i));
    const int x = std::clamp(static_cast<int>(std::floor(here[0])) - 1, left, left + 2);
    const int y = std::clamp(static_cast<int>(std::floor(here[1])) - 1, below, below + 2);
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) {
        const double weight = lagrange(here[0] - x, c) * lagrange(here[1] - y, r);
        const Eigen::Index point = static_cast<Eigen::Index>(y + r) * columns_ + x + c;
        result += weight * rest_.middleCols<3>(3 * point) * forces.middleRows<3>(3 * i);
      }
    }
  }
  return result;
}

DensePatches::Mixed DensePatches::solve(const Vector& displacement, const std::vector<int>& present,
                                        double noise_px) const {
  const Result alone = DenseModel::solve(displacement, present, noise_px);
  Mixed mixed{alone.forces, alone.wrench, alone.covariance, {}, 0.0, {}, {}};
  if (alone.atoms.empty()) return mixed;
  Frame frame{displacement(present), motion_(present, Eigen::all), present, noise_px * noise_px};
  std::vector<Patch> patches = peaks(alone.forces);
  if (patches.empty() || patches.size() > 4) return mixed;
  const Fitted fitted = likely(frame, patches);
  const double misfit = fitted.misfit;
  patches = fitted.patches;
  for (const Patch& patch : patches) {
    if (patch.place[2] >= 1.5 * pitch_ * pitch_) return mixed;
  }
  if (misfit - alone.residual / frame.n2 >= 2000) return mixed;

  std::vector<Candidate> all = {{alone.evidence - alone.degrees, alone.forces, alone.wrench, alone.covariance, {}, {}}};
  for (Candidate& each : around(frame, patches)) all.push_back(each);
  double most = all[0].worth, sum = 0.0, ofPatches = 0.0;
  for (const Candidate& each : all) most = std::max(most, each.worth);
  for (Candidate& each : all) sum += each.worth = std::exp(each.worth - most);
  for (std::size_t i = 1; i < all.size(); ++i) ofPatches += all[i].worth;
  mixed.forces.setZero();
  mixed.wrench.setZero();
  mixed.covariance.setZero();
  Vector change = Vector::Zero(all[1].change.size());
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
    const Vector apart = each.change - change;
    unknown += each.worth / ofPatches * (each.changeCovariance + apart * apart.transpose());
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

double DensePatches::lagrange(double at, int number) {
  double result = 1.0;
  for (int other = 0; other < 4; ++other) {
    if (other != number) result *= (at - other) / (number - other);
  }
  return result;
}

std::vector<DensePatches::Patch> DensePatches::peaks(const Vector& forces) const {
  const Eigen::Index count = points_.cols();
  Vector force(count), height = Vector::Zero(count);
  for (Eigen::Index p = 0; p < count; ++p) force[p] = forces.segment<3>(3 * p).norm();
  for (Eigen::Index p = 0; p < count; ++p) {
    const Eigen::ArrayXd weight =
        (-(points_.colwise() - points_.col(p)).colwise().squaredNorm().array() / (2 * pitch_ * pitch_)).exp();
    height[p] = (weight * force.array()).sum() / weight.sum();
  }
  std::vector<Patch> found;
  Vector centre = points_ * force / force.sum();
  for (Eigen::Index p = 0; p < count; ++p) {
    bool highest = height[p] >= 0.1 * height.maxCoeff();
    for (Eigen::Index q = 0; q < count; ++q) {
      const bool beside = (points_.col(p) - points_.col(q)).cwiseAbs().maxCoeff() < 1.1 * pitch_;
      highest = highest && !(beside && height[q] > height[p]);
    }
    if (!highest) continue;
    found.push_back({points_.col(p), Eigen::Vector4d::Zero()});
  }
  if (found.size() == 1) found[0].place = centre;
  for (Patch& patch : found) patch.place[2] = 0.3 * pitch_ * pitch_;
  return found;
}

DensePatches::Matrix DensePatches::columnsOf(const Frame& frame, const std::vector<Patch>& patches) const {
  Matrix result(frame.d.size(), 4 * static_cast<Eigen::Index>(patches.size()));
  for (std::size_t k = 0; k < patches.size(); ++k) {
    result.middleCols<4>(4 * static_cast<Eigen::Index>(k)) = columns(patches[k].place)(frame.present, Eigen::all);
  }
  return result;
}

DensePatches::Matrix DensePatches::slopesOf(const Frame& frame, const std::vector<Patch>& patches) const {
  Matrix result(frame.d.size(), 3 * static_cast<Eigen::Index>(patches.size()));
  for (std::size_t k = 0; k < patches.size(); ++k) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      Eigen::Vector3d moved = patches[k].place;
      moved[i] += 0.02 * units()[i];
      const Vector change = (columns(moved) - columns(patches[k].place)) * patches[k].load;
      result.col(3 * static_cast<Eigen::Index>(k) + i) = change(frame.present) / (0.02 * units()[i]);
    }
  }
  return result;
}

double DensePatches::priorOf(const std::vector<Patch>& patches) const {
  double sum = 0.0;
  for (const Patch& patch : patches) sum += std::pow((patch.place[2] / (pitch_ * pitch_) - 0.3) / 0.6, 2);
  return sum;
}

double DensePatches::linear(const Frame& frame, std::vector<Patch>& patches, Vector& motion) const {
  const Matrix columns = columnsOf(frame, patches);
  const Eigen::Index rows = frame.d.size(), loads = columns.cols();
  Matrix B = Matrix::Zero(rows + 4, loads + 4);
  B.topRows(rows) << columns, frame.motion;
  B.topRows(rows) /= std::sqrt(frame.n2);
  B.bottomRightCorner<4, 4>().setIdentity();
  Vector right = Vector::Zero(rows + 4);
  right.head(rows) = frame.d / std::sqrt(frame.n2);
  const Vector x = scaledSolve(B, right);
  for (std::size_t k = 0; k < patches.size(); ++k) patches[k].load = x.segment<4>(4 * static_cast<Eigen::Index>(k));
  motion = x.tail<4>();
  return (right - B * x).squaredNorm() + priorOf(patches);
}

DensePatches::Vector DensePatches::scaledSolve(const Matrix& B, const Vector& right) {
  const Vector scale = B.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  return scale.cwiseProduct((B * scale.asDiagonal()).householderQr().solve(right));
}

DensePatches::Matrix DensePatches::equations(const Frame& frame, const Fitted& now, Vector& right) const {
  const auto count = static_cast<Eigen::Index>(now.patches.size());
  const Matrix columns = columnsOf(frame, now.patches), slopes = slopesOf(frame, now.patches);
  const Eigen::Index rows = frame.d.size(), places = 4 * count + 4;
  const double n = std::sqrt(frame.n2);
  Matrix B = Matrix::Zero(rows + 4 + count, places + 3 * count);
  right = Vector::Zero(B.rows());
  B.topLeftCorner(rows, places) << columns / n, frame.motion / n;
  Vector left = frame.d - frame.motion * now.motion;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Patch& patch = now.patches[static_cast<std::size_t>(k)];
    left -= columns.middleCols<4>(4 * k) * patch.load;
    for (Eigen::Index i = 0; i < 3; ++i) B.col(places + 3 * k + i).head(rows) = units()[i] / n * slopes.col(3 * k + i);
    B(rows + 4 + k, places + 3 * k + 2) = 1 / 0.6;
    right[rows + 4 + k] = (0.3 - patch.place[2] / (pitch_ * pitch_)) / 0.6;
  }
  right.head(rows) = left / n;
  B.block<4, 4>(rows, 4 * count).setIdentity();
  right.segment<4>(rows) = -now.motion;
  return B;
}

DensePatches::Fitted DensePatches::fit(const Frame& frame, const std::vector<Patch>& start) const {
  Fitted now{start, {}, 0.0};
  const auto count = static_cast<Eigen::Index>(start.size());
  now.misfit = linear(frame, now.patches, now.motion);
  double damping = 0.0;
  for (int time = 0; time < 16; ++time) {
    Vector right;
    Matrix B = equations(frame, now, right);
    const Eigen::Index rows = B.rows(), places = 4 * count + 4;
    B.conservativeResizeLike(Matrix::Zero(rows + 3 * count, B.cols()));
    right.conservativeResizeLike(Vector::Zero(B.rows()));
    for (Eigen::Index i = 0; i < 3 * count; ++i) {
      B(rows + i, places + i) = std::sqrt(damping) * B.col(places + i).norm();
    }
    const Vector step = scaledSolve(B, right).tail(3 * count);
    Fitted next = now;
    for (Eigen::Index k = 0; k < count; ++k) {
      Eigen::Vector3d& place = next.patches[static_cast<std::size_t>(k)].place;
      for (Eigen::Index i = 0; i < 3; ++i) {
        const double most = i < 2 ? 0.7 : 0.3, low = i < 2 ? points_.row(i).minCoeff() : -0.15 * pitch_ * pitch_;
        const double high = i < 2 ? points_.row(i).maxCoeff() : 1.5 * pitch_ * pitch_;
        place[i] = std::clamp(place[i] + units()[i] * std::clamp(step[3 * k + i], -most, most), low, high);
      }
    }
    next.misfit = linear(frame, next.patches, next.motion);
    if (next.misfit > now.misfit) {
      damping = std::max(10 * damping, 0.1);
      if (damping > 1e4) break;
      continue;
    }
    const double gain = now.misfit - next.misfit;
    now = next;
    damping = damping > 0.1 ? damping / 10 : 0.0;
    if (gain < 0.02) break;
  }
  return now;
}

double DensePatches::logEvidence(const Frame& frame, const Fitted& now, std::size_t& least) const {
  Vector right;
  Matrix B = equations(frame, now, right);
  const auto count = static_cast<Eigen::Index>(now.patches.size());
  const Vector scale = B.colwise().norm().transpose().cwiseInverse();
  const Matrix scaled = B * scale.asDiagonal();
  const Matrix covariance = scale.asDiagonal() * (scaled.transpose() * scaled).inverse() * scale.asDiagonal();
  Vector prior = Vector::Ones(B.cols()), own = Vector::Ones(B.cols());
  double fewest = 1e300;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Vector4d& load = now.patches[static_cast<std::size_t>(k)].load;
    prior.segment<4>(4 * k) = 3 * load.head<3>().norm() * Eigen::Vector4d(1, 1, 1, pitch_);
    prior[4 * count + 4 + 3 * k + 2] = 0.6;
    own[4 * count + 4 + 3 * k + 2] = 0;  // is among the equations
    const double squares = load.dot(covariance.block<4, 4>(4 * k, 4 * k).inverse() * load);
    if (squares >= fewest) continue;
    fewest = squares;
    least = static_cast<std::size_t>(k);
  }
  own.segment<4>(4 * count).setZero();
  B = B * prior.asDiagonal();
  Matrix ratio = B.transpose() * B;
  ratio.diagonal() += own;
  const double volume = ratio.selfadjointView<Eigen::Lower>().eigenvalues().array().log().sum();
  return -(now.misfit + volume) / 2 - static_cast<double>(count) * std::log(nodes_.columns * nodes_.rows);
}

DensePatches::Fitted DensePatches::likely(const Frame& frame, const std::vector<Patch>& start) const {
  Fitted now = fit(frame, start);
  while (now.patches.size() > 1) {
    std::size_t least = 0, other = 0;
    const double with = logEvidence(frame, now, least);
    std::vector<Patch> fewer = now.patches;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(least));
    const Fitted without = fit(frame, fewer);
    if (logEvidence(frame, without, other) <= with) break;
    now = without;
  }
  return now;
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

void DensePatches::addForces(const Patch& patch, const Vector& share, Vector& forces) {
  for (Eigen::Index p = 0; p < share.size(); ++p) forces.segment<3>(3 * p) += share[p] * patch.load.head<3>();
}

std::vector<DensePatches::Candidate> DensePatches::around(const Frame& frame, const std::vector<Patch>& patches) const {
  const auto count = static_cast<Eigen::Index>(patches.size());
  const Matrix H = H_(frame.present, Eigen::all), columns = columnsOf(frame, patches);
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
    addForces(patch, spread(patch.place), forces);
  }
  Matrix extra(frame.d.size(), 7 * count);
  extra << columns, slopesOf(frame, patches);
  extra *= free.asDiagonal();

  // The rounds, on what is left without the picture's motion.
  std::vector<Patch> copy = patches;
  Vector motion;
  linear(frame, copy, motion);
  const double noise_px = std::sqrt(frame.n2);
  const Modes modes = modesOf(H, frame.motion, noise_px);
  const Seen first = start(modes, modes.look * (left - frame.motion * motion));
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

  const Vector rough = beneath(forces);
  const Eigen::Matrix3d own =
      (1 - options_.turning) * 3 * along / along.trace() + options_.turning * Eigen::Matrix3d::Identity();
  std::vector<Candidate> found;
  for (const double rho : {0.1, 0.2, 0.4, 0.8}) {
    const Vector whole = smooth + rho * rho * rough;
    std::vector<int> atoms;
    strongest(whole, size, options_.most[0][2], frame.n2, atoms);
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
    Candidate candidate{fit.evidence - std::log(4.0) - static_cast<double>(count) * std::log(nodes_.count()),
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
    }
    found.push_back(candidate);
  }
  return found;
}

}  // namespace tractiond::solve
