#include "tests/unit/solve/dense_patch_fit.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace tractiond::solve {

DensePatchFit::DensePatchFit(const sensor::NodeGrid& nodes, double depth_m, const Matrix& influence,
                             const Matrix& motion, double force_N, const ModelOptions& options,
                             const HalfSpace& halfSpace)
    : DenseModel(nodes, depth_m, influence, motion, force_N, options)
    , nodes_(nodes)
    , pitch_(nodes.pitch)
    , columns_(nodes.columns + 4)
    , halfSpace_(halfSpace)
    , rest_(influence - halfSpace(points_)) {}

DensePatchFit::Matrix DensePatchFit::columns(const Eigen::Vector3d& place) const {
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

double DensePatchFit::lagrange(double at, int number) {
  double result = 1.0;
  for (int other = 0; other < 4; ++other) {
    if (other != number) result *= (at - other) / (number - other);
  }
  return result;
}

std::vector<Eigen::Index> DensePatchFit::maxima(const Vector& forces, Vector& force, Vector& height) const {
  const Eigen::Index count = points_.cols();
  force.resize(count);
  height.resize(count);
  for (Eigen::Index p = 0; p < count; ++p) force[p] = forces.segment<3>(3 * p).norm();
  for (Eigen::Index p = 0; p < count; ++p) {
    const Eigen::ArrayXd weight =
        (-(points_.colwise() - points_.col(p)).colwise().squaredNorm().array() / (2 * pitch_ * pitch_)).exp();
    height[p] = (weight * force.array()).sum() / weight.sum();
  }
  std::vector<Eigen::Index> found;
  for (Eigen::Index p = 0; p < count; ++p) {
    bool highest = height[p] > 0;
    for (Eigen::Index q = 0; q < count; ++q) {
      const bool beside = (points_.col(p) - points_.col(q)).cwiseAbs().maxCoeff() < 1.1 * pitch_;
      highest = highest && !(beside && height[q] > height[p]);
    }
    if (highest) found.push_back(p);
  }
  std::stable_sort(found.begin(), found.end(), [&](auto a, auto b) { return height[a] > height[b]; });
  return found;
}

DensePatchFit::Patch DensePatchFit::startAt(const Eigen::Vector3d& at) const {
  return {{at[0], at[1], 0.3 * pitch_ * pitch_}, Eigen::Vector4d::Zero()};
}

DensePatchFit::Matrix DensePatchFit::columnsOf(const Frame& frame, const std::vector<Patch>& patches,
                                               const Bar& bar) const {
  constexpr double kPlace[] = {0.0694318442, 0.3300094782, 0.6699905218, 0.9305681558};
  constexpr double kWeight[] = {0.1739274226, 0.3260725774, 0.3260725774, 0.1739274226};
  Matrix result = Matrix::Zero(frame.d.size(), 4 * static_cast<Eigen::Index>(patches.size()));
  for (std::size_t k = 0; k < patches.size(); ++k) {
    auto own = result.middleCols<4>(4 * static_cast<Eigen::Index>(k));
    if (bar.empty() || (k != bar[0] && k != bar[1])) {
      own = columns(patches[k].place)(frame.present, Eigen::all);
      continue;
    }
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector3d at = (1 - kPlace[i]) * patches[bar[0]].place + kPlace[i] * patches[bar[1]].place;
      const double share = 2 * kWeight[i] * (k == bar[0] ? 1 - kPlace[i] : kPlace[i]);
      own += share * columns(at)(frame.present, Eigen::all);
    }
  }
  return result;
}

DensePatchFit::Vector DensePatchFit::loadsOf(const std::vector<Patch>& patches) {
  Vector loads(4 * static_cast<Eigen::Index>(patches.size()));
  for (std::size_t k = 0; k < patches.size(); ++k) loads.segment<4>(4 * static_cast<Eigen::Index>(k)) = patches[k].load;
  return loads;
}

DensePatchFit::Matrix DensePatchFit::slopesOf(const Frame& frame, const std::vector<Patch>& patches,
                                              const Bar& bar) const {
  Matrix result(frame.d.size(), 3 * static_cast<Eigen::Index>(patches.size()));
  const Vector loads = loadsOf(patches), here = columnsOf(frame, patches, bar) * loads;
  for (std::size_t k = 0; k < patches.size(); ++k) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      std::vector<Patch> moved = patches;
      moved[k].place[i] += 0.02 * units()[i];
      result.col(3 * static_cast<Eigen::Index>(k) + i) =
          (columnsOf(frame, moved, bar) * loads - here) / (0.02 * units()[i]);
    }
  }
  return result;
}

double DensePatchFit::priorOf(const std::vector<Patch>& patches) const {
  double sum = 0.0;
  for (const Patch& patch : patches) sum += std::pow((patch.place[2] / (pitch_ * pitch_) - 0.3) / 0.6, 2);
  return sum;
}

double DensePatchFit::linear(const Frame& frame, std::vector<Patch>& patches, Vector& motion, const Bar& bar) const {
  const Matrix columns = columnsOf(frame, patches, bar);
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

DensePatchFit::Vector DensePatchFit::scaledSolve(const Matrix& B, const Vector& right) {
  const Vector scale = B.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  return scale.cwiseProduct((B * scale.asDiagonal()).householderQr().solve(right));
}

DensePatchFit::Matrix DensePatchFit::equations(const Frame& frame, const Fitted& now, Vector& right,
                                               const Bar& bar) const {
  const auto count = static_cast<Eigen::Index>(now.patches.size());
  const Matrix columns = columnsOf(frame, now.patches, bar), slopes = slopesOf(frame, now.patches, bar);
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

DensePatchFit::Fitted DensePatchFit::fit(const Frame& frame, const std::vector<Patch>& start, const Bar& bar,
                                         double precision) const {
  Fitted now{start, {}, 0.0};
  const auto count = static_cast<Eigen::Index>(start.size());
  now.misfit = linear(frame, now.patches, now.motion, bar);
  double damping = 0.0;
  for (int time = 0; time < 16; ++time) {
    Vector right;
    Matrix B = equations(frame, now, right, bar);
    const Eigen::Index rows = B.rows(), places = 4 * count + 4;
    B.conservativeResizeLike(Matrix::Zero(rows + 3 * count, B.cols()));
    right.conservativeResizeLike(Vector::Zero(B.rows()));
    for (Eigen::Index i = 0; i < 3 * count; ++i) {
      B(rows + i, places + i) = std::sqrt(damping) * B.col(places + i).norm();
    }
    Vector step = scaledSolve(B, right).tail(3 * count);
    for (Eigen::Index held = -1, k = 0; k < count; ++k) {  // what is at its widest stays if it would go on
      const Eigen::Index i = 3 * k + 2;
      const bool isWidest = now.patches[static_cast<std::size_t>(k)].place[2] >= 1.5 * pitch_ * pitch_;
      if (!isWidest || step[i] <= 1e-12 || held == k) continue;
      B.col(places + i).setZero();
      B(rows + i, places + i) = 1;
      step = scaledSolve(B, right).tail(3 * count);
      held = k;
      k = -1;  // others may now go on that did not
    }
    Fitted next = now;
    for (Eigen::Index k = 0; k < count; ++k) {
      Eigen::Vector3d& place = next.patches[static_cast<std::size_t>(k)].place;
      for (Eigen::Index i = 0; i < 3; ++i) {
        const double most = i < 2 ? 0.7 : 0.3, low = i < 2 ? points_.row(i).minCoeff() : -0.15 * pitch_ * pitch_;
        const double high = i < 2 ? points_.row(i).maxCoeff() : 1.5 * pitch_ * pitch_;
        place[i] = std::clamp(place[i] + units()[i] * std::clamp(step[3 * k + i], -most, most), low, high);
      }
    }
    next.misfit = linear(frame, next.patches, next.motion, bar);
    const double gain = now.misfit - next.misfit;
    const double last = precision * std::max(0.02, 1e-3 * (now.misfit - static_cast<double>(frame.d.size())));
    if (gain < -last) {
      damping = std::max(10 * damping, 0.1);
      if (damping > 1e4) break;
      continue;
    }
    now = next;
    damping = damping > 0.1 ? damping / 10 : 0.0;
    if (gain < last) break;
  }
  return now;
}

double DensePatchFit::logEvidence(const Frame& frame, const Fitted& now, std::size_t& least) const {
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

double DensePatchFit::logEvidence(const Frame& frame, const Fitted& now) const {
  std::size_t least = 0;
  return logEvidence(frame, now, least);
}

bool DensePatchFit::areNarrow(const Fitted& now) const {
  return std::all_of(now.patches.begin(), now.patches.end(),
                     [this](const Patch& patch) { return patch.place[2] < 1.5 * pitch_ * pitch_; });
}

bool DensePatchFit::areTwoContacts(const Frame& frame, const Fitted& now, std::size_t a, std::size_t b) const {
  const Patch &one = now.patches[a], &other = now.patches[b];
  const double away = distance(one, other.place);
  if (away < radius(one) + radius(other)) return false;
  if (away > 5.5 * pitch_) return true;
  std::vector<Patch> ends = now.patches;
  const Eigen::Vector2d more = 0.365 * (other.place - one.place).head<2>();
  ends[a].place.head<2>() -= more;
  ends[b].place.head<2>() += more;
  return fit(frame, ends, {a, b}).misfit >= now.misfit + 16 + 0.005 * 0.005 * frame.d.squaredNorm() / frame.n2;
}

DensePatchFit::Fitted DensePatchFit::find(const Frame& frame, const Vector& forces, double enough) const {
  Vector force, height;
  const std::vector<Eigen::Index> peaks = maxima(forces, force, height);
  std::vector<Patch> start;
  for (const Eigen::Index p : peaks) {
    if (height[p] >= 0.1 * height.maxCoeff()) start.push_back(startAt(points_.col(p)));
  }
  if (start.empty() || start.size() > 4) return {};
  if (start.size() == 1) start[0] = startAt(points_ * force / force.sum());
  Fitted now = fit(frame, start);
  while (now.patches.size() > 1) {
    std::size_t least = 0;
    const double with = logEvidence(frame, now, least);
    std::vector<Patch> fewer = now.patches;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(least));
    const Fitted without = fit(frame, fewer);
    if (logEvidence(frame, without) <= with) break;
    now = without;
  }
  enough += 2 * (10 + std::log(nodes_.columns * nodes_.rows));  // the least that one more must gain
  int inVain = areNarrow(now) ? 0 : 2;
  for (const Eigen::Index p : peaks) {
    if (inVain == 2 || now.patches.size() == 4 || now.misfit <= enough) break;
    bool isNear = false;
    for (const Patch& patch : now.patches) {
      isNear = isNear || distance(patch, points_.col(p)) < radius(patch) + 1.5 * pitch_;
    }
    if (isNear) continue;
    std::vector<Patch> more = now.patches;
    more.push_back(startAt(points_.col(p)));
    const Fitted with = fit(frame, more);
    const bool likely = logEvidence(frame, with) > logEvidence(frame, now) && areNarrow(with);
    if (likely) now = with;
    inVain += likely ? 0 : 1;
  }
  for (std::size_t k = 0; k < now.patches.size() && now.patches.size() < 4 && now.misfit > enough; ++k) {
    const Eigen::Vector3d half = halfLength(now.patches[k], force);
    Fitted others = now;
    others.patches.erase(others.patches.begin() + static_cast<std::ptrdiff_t>(k));
    if (half.isZero(0) || !areNarrow(others)) continue;
    std::vector<Patch> two = now.patches;
    two[k] = startAt(now.patches[k].place - half);
    two.push_back(startAt(now.patches[k].place + half));
    const Fitted split = fit(frame, two);
    if (logEvidence(frame, split) > logEvidence(frame, now) && areNarrow(split) &&
        areTwoContacts(frame, split, k, two.size() - 1))
      now = split;
  }
  return areNarrow(now) ? fit(frame, now.patches, {}, 5e-4) : Fitted{};
}

Eigen::Vector3d DensePatchFit::halfLength(const Patch& patch, const Vector& force) const {
  Vector weight = force;
  for (Eigen::Index p = 0; p < weight.size(); ++p) {
    if (distance(patch, points_.col(p)) >= 3.5 * pitch_) weight[p] = 0;
  }
  if (weight.sum() == 0) return Eigen::Vector3d::Zero();
  const Eigen::Matrix2Xd away = points_.topRows<2>().colwise() - (points_.topRows<2>() * weight / weight.sum()).eval();
  const Eigen::Matrix2d moments = away * weight.asDiagonal() * away.transpose() / weight.sum();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(moments);
  const double longer = axes.eigenvalues()[1] - axes.eigenvalues()[0];
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  if (longer < 0.25 * pitch_ * pitch_) return half;
  half.head<2>() = std::sqrt(longer) * axes.eigenvectors().col(1);
  return half[0] < 0 || (half[0] == 0 && half[1] < 0) ? Eigen::Vector3d(-half) : half;
}

}  // namespace tractiond::solve
