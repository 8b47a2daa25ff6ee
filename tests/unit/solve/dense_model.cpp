#include "tests/unit/solve/dense_model.h"

#include "daemon/solve/evidence.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace tractiond::solve {

DenseModel::DenseModel(const sensor::NodeGrid& nodes, double depth_m, const Matrix& influence, const Matrix& motion,
                       double force_N, const ModelOptions& options)
    : DenseAtoms(nodes)
    , options_(options)
    , depth_m_(depth_m)
    , force_N_(force_N)
    , motion_(motion)
    , H_(influence * kronecker(shape_)) {}

DenseModel::Result DenseModel::solve(const Vector& displacement, const std::vector<int>& present,
                                     double noise_px) const {
  const Matrix H = H_(present, Eigen::all), motion = motion_(present, Eigen::all);
  const Vector d = displacement(present);
  const double n2 = noise_px * noise_px;
  const Modes modes = modesOf(H, motion, noise_px);
  const Vector all = modes.toAmplitudes * d;
  const Surest sure = surest(modes, all);
  const double least = leastTau(sure);
  const Vector amplitudes = read(modes, all, least);
  const Vector size = H.colwise().squaredNorm().transpose();

  Result result;
  Seen first = start(modes, amplitudes, sure), seen = first;
  const bool detected =
      std::sqrt(sure.squaredDeviations) >= detectionThreshold(options_.falseAlarms, static_cast<int>(shape_.cols()));
  for (std::size_t time = 0; time < 2; ++time) {
    Vector gamma;
    Fit fit;
    for (std::size_t i = 0; i < 3; ++i) {
      ++result.rounds;
      const int most = options_.most[time][i];
      gamma = coupled(evident(seen)).cwiseQuotient(coupled(seen.known));
      if (detected) result.atoms = select(gamma, size, most, n2);
      if (detected && result.atoms.empty()) {
        seen = {Vector::Zero(H.cols()), seen.known, Vector::Zero(shape_.cols())};
        seen.mean.segment<3>(3 * sure.atom) = sure.force;
        gamma = coupled(evident(seen)).cwiseQuotient(coupled(seen.known));
        result.atoms = select(gamma, size, most, n2);
      }
      if (result.atoms.empty()) {
        result.forces = Vector::Zero(3 * shape_.rows());
        fit = posterior(H, motion, d, n2, {}, gamma, {});
        result.residual = fit.residual;
        result.motion = fit.motion;
        return result;
      }
      const std::vector<int> smoothAtoms = result.atoms;
      const Vector smoothGamma = gamma;
      Seen shown = seen;
      for (int pass = 0; pass < (i == 2 ? 2 : 1); ++pass) {
        if (pass == 1) {
          shown.mean.setZero();
          for (std::size_t k = 0; k < result.atoms.size(); ++k) {
            shown.mean.segment<3>(3 * result.atoms[k]) = fit.force.segment<3>(3 * static_cast<Eigen::Index>(k));
          }
        }
        if (i == 2) {
          result.atoms = smoothAtoms;
          gamma = smoothGamma;
          roughen(result.atoms, gamma, shown.mean, size, most, n2, pass == 1);
        }
        std::vector<Eigen::Matrix3d> omega;
        for (const int a : result.atoms) omega.push_back(directions(shown, evident(shown), a, i == 2));
        fit = posterior(H, motion, d, n2, result.atoms, gamma, omega);
      }
      seen = {Vector::Zero(H.cols()), first.known, Vector::Zero(shape_.cols())};
      keep(fit, result.atoms, seen);
    }
    result.forces = kronecker(shape_) * seen.mean;
    const Matrix B = wrenches();
    result.wrench = B * result.forces;
    const Matrix to = B * kronecker(shape_)(Eigen::all, components(result.atoms));
    result.covariance = to * fit.sigma * to.transpose();
    result.residual = fit.residual;
    const double count = static_cast<double>(d.size());
    if (time == 1 || fit.residual < n2 * (count - fit.known.sum() + options_.gate * std::sqrt(2.0 * count))) break;
    const Vector explained = modes.s.asDiagonal() * modes.V.transpose() * seen.mean;
    const Vector left = amplitudes - explained.head(amplitudes.size());
    const Surest more = surest(modes, left);
    if (std::sqrt(more.squaredDeviations) < options_.surety) break;
    Seen rest = start(modes, left, more);
    first = rest;
    keep(fit, result.atoms, rest);
    seen = rest;
  }
  return result;
}

DenseModel::Modes DenseModel::modesOf(const Matrix& H, const Matrix& motion, double noise_px) {
  const Matrix one = Matrix::Identity(H.rows(), H.rows());
  const Matrix halfWeight =
      Eigen::SelfAdjointEigenSolver<Matrix>(one + motion * motion.transpose() / (noise_px * noise_px))
          .operatorInverseSqrt();
  const Eigen::BDCSVD<Matrix> svd(halfWeight * H, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.singularValues(), svd.matrixV(), noise_px, svd.matrixU().transpose() * halfWeight};
}

std::vector<int> DenseModel::components(const std::vector<int>& atoms) {
  std::vector<int> result;
  for (const int a : atoms) result.insert(result.end(), {3 * a, 3 * a + 1, 3 * a + 2});
  return result;
}

std::vector<Eigen::Index> DenseModel::groupEnds(const Modes& modes) const {
  std::vector<Eigen::Index> ends;
  for (const double least : options_.groups) {
    const Eigen::Index end = (modes.s.array() > least * options_.noise_px / force_N_).count();
    if (end > (ends.empty() ? 0 : ends.back()) && end < modes.s.size()) ends.push_back(end);
  }
  ends.push_back(modes.s.size());
  return ends;
}

DenseModel::Vector DenseModel::read(const Modes& modes, const Vector& all, double least) const {
  for (const Eigen::Index end : groupEnds(modes)) {
    const Vector c = all.head(end);
    if (visible(modes, likeliest(modes, c, least)) <= end) return c;
  }
  return all;
}

Eigen::Index DenseModel::visible(const Modes& modes, double tau) const {
  for (const Eigen::Index end : groupEnds(modes)) {
    if (end == modes.s.size() || modes.s[end] * tau < options_.visible * modes.noise_px) return end;
  }
  return modes.s.size();
}

double DenseModel::likeliest(const Modes& modes, const Vector& c, double least) const {
  const double n2 = modes.noise_px * modes.noise_px;
  double best = -std::numeric_limits<double>::max(), tau = 0.0;
  for (int i = 0; i <= 50; ++i) {
    const double candidate = force_N_ * std::exp(-12.0 + 0.25 * i) * modes.noise_px / options_.noise_px;
    const Eigen::ArrayXd variance = modes.s.head(c.size()).array().square() * candidate * candidate + n2;
    const double evidence = -0.5 * (variance.log() + c.array().square() / variance).sum();
    if (evidence <= best && tau >= least) continue;
    best = evidence;
    tau = candidate;
  }
  return tau;
}

DenseModel::Surest DenseModel::surest(const Modes& modes, const Vector& c) const {
  const Eigen::Index used = groupEnds(modes).front();
  const Matrix seen = modes.s.head(used).asDiagonal() * modes.V.leftCols(used).transpose();
  Surest result;
  for (Eigen::Index a = 0; a < shape_.cols(); ++a) {
    const Matrix of = seen.middleCols<3>(3 * a);
    const Vector force = of.colPivHouseholderQr().solve(c.head(used));
    const double reduction =
        (c.head(used).squaredNorm() - (c.head(used) - of * force).squaredNorm()) / (modes.noise_px * modes.noise_px);
    if (reduction > result.squaredDeviations) result = {reduction, a, force};
  }
  return result;
}

double DenseModel::leastTau(const Surest& surest) const {
  return surest.force.norm() / std::sqrt(3.0 * static_cast<double>(shape_.rows()));
}

DenseModel::Seen DenseModel::start(const Modes& modes, const Vector& c, const Surest& surest) const {
  const double n2 = modes.noise_px * modes.noise_px, tau = likeliest(modes, c, leastTau(surest));
  const Eigen::Index used = std::min(visible(modes, tau), c.size());
  const Eigen::ArrayXd s = modes.s.head(used), s2 = s.square(), g = s2 * tau * tau / (s2 * tau * tau + n2);
  const Matrix V = modes.V.leftCols(used);
  Seen seen{V * (g / s * c.head(used).array()).matrix(), Vector(shape_.cols()), Vector(shape_.cols())};
  for (Eigen::Index a = 0; a < shape_.cols(); ++a) {
    const Eigen::ArrayXd power = V.middleRows<3>(3 * a).colwise().squaredNorm().transpose();
    seen.known[a] = (power * g).sum();
    // By the noise along the mean.
    const Matrix rows = V.middleRows<3>(3 * a);
    const Eigen::Matrix3d covariance = n2 * rows * (g.square() / s2).matrix().asDiagonal() * rows.transpose();
    const Eigen::Vector3d mean = seen.mean.segment<3>(3 * a);
    seen.noise[a] = 3 * mean.squaredNorm() / mean.dot(covariance.inverse() * mean);
  }
  if (isAmbiguous(surest.atom) && std::sqrt(surest.squaredDeviations) >= options_.broad) {
    seen.mean.segment<3>(3 * surest.atom) = surest.force;
    seen.noise[surest.atom] = 0.0;
  }
  return seen;
}

DenseModel::Vector DenseModel::evident(const Seen& seen) const {
  Vector result(shape_.cols());
  for (Eigen::Index a = 0; a < result.size(); ++a) {
    const double above =
        seen.mean.segment<3>(3 * a).squaredNorm() - options_.surety * options_.surety * seen.noise[a] / 3;
    result[a] = std::max(0.0, above);
  }
  return result;
}

DenseModel::Vector DenseModel::coupled(const Vector& of) const {
  Vector result = Vector::Zero(of.size());
  for (std::size_t a = 0; a < x_.size(); ++a) {
    for (std::size_t b = 0; b < x_.size(); ++b) {
      const double reach = options_.coupling * spacing_[static_cast<std::size_t>(level_[a])];
      if (level_[a] == level_[b]) {
        result[static_cast<Eigen::Index>(a)] +=
            std::exp(-squaredDistance(a, b) / (2 * reach * reach)) * of[static_cast<Eigen::Index>(b)];
      }
    }
  }
  return result;
}

Eigen::Matrix3d DenseModel::directions(const Seen& seen, const Vector& evidence, int atom, bool wide) const {
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  const double half = spacing_[static_cast<std::size_t>(level_[static_cast<std::size_t>(atom)])] / 2;
  const double reach = wide ? std::max(depth_m_, half) : depth_m_;
  for (std::size_t b = 0; b < x_.size(); ++b) {
    const double e = evidence[static_cast<Eigen::Index>(b)];
    if (e == 0.0) continue;
    const Eigen::Vector3d mean = seen.mean.segment<3>(3 * static_cast<Eigen::Index>(b));
    C += std::exp(-squaredDistance(static_cast<std::size_t>(atom), b) / (2 * reach * reach)) * e / mean.squaredNorm() *
         mean * mean.transpose();
  }
  if (C.trace() == 0.0) return Eigen::Matrix3d::Identity();
  return (1 - options_.turning) * 3 * C / C.trace() + options_.turning * Eigen::Matrix3d::Identity();
}

DenseModel::Vector DenseModel::sizes(const Vector& squares) {
  Vector result(squares.size() / 3);
  for (Eigen::Index a = 0; a < result.size(); ++a) result[a] = squares.segment<3>(3 * a).sum() / 3;
  return result;
}

std::vector<int> DenseModel::falling(const Vector& value) {
  std::vector<int> order(static_cast<std::size_t>(value.size()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return value[a] > value[b]; });
  return order;
}

std::vector<int> DenseModel::select(Vector& gamma, const Vector& squares, int most, double n2) const {
  const Vector size = sizes(squares), value = gamma.cwiseProduct(size);
  const std::vector<int> order = falling(value);
  const double next = most < value.size() ? value[order[static_cast<std::size_t>(most)]] : 0.0;
  std::vector<int> chosen;
  for (int i = 0; i < std::min(most, static_cast<int>(order.size())); ++i) {
    const int a = order[static_cast<std::size_t>(i)];
    if (value[a] - next > options_.floor * n2) chosen.push_back(a);
    gamma[a] = (value[a] - next) / size[a];
  }
  return chosen;
}

void DenseModel::roughen(std::vector<int>& atoms, Vector& gamma, const Vector& mean, const Vector& squares, int most,
                         double n2, bool continues) const {
  Vector whole = beneath(kronecker(shape_) * mean);
  for (Eigen::Index a = 0; a < whole.size(); ++a) {
    const bool isSmall = !isAmbiguous(a) && !(a < points_.cols() && beyond_[a]);
    if (isSmall) whole[a] *= options_.roughness * options_.roughness;
  }
  const Vector around = beneath(kronecker(shape_) * mean, options_.around * spacing_.front()), size = sizes(squares);
  for (Eigen::Index a = points_.cols(); continues && a < whole.size(); ++a) {
    whole[a] += std::min(around[a], options_.unseen * options_.unseen * n2 / size[a] / 3);
  }
  for (const int a : atoms) whole[a] += gamma[a];
  gamma = whole;
  const Vector value = whole.cwiseProduct(size);
  atoms = falling(value);
  atoms.resize(static_cast<std::size_t>(std::min<Eigen::Index>(most, value.size())));
  std::erase_if(atoms, [&](int a) { return value[a] <= options_.floor * n2; });
}

DenseModel::Vector DenseModel::beneath(const Vector& forces, double around) const {
  const double pitch = spacing_.front(),
               side = spacing_[static_cast<std::size_t>(level_.at(static_cast<std::size_t>(plate_)))];
  const Vector fine = reciprocalPressure(forces, std::hypot(pitch, around)),
               coarse = reciprocalPressure(forces, std::hypot(std::max(pitch, side / 8), around));
  Vector whole(shape_.cols());
  for (Eigen::Index a = 0; a < whole.size(); ++a) {
    const double q = 1 / shape_.col(a).dot(a == plate_ ? coarse : fine) / shape_.col(a).maxCoeff();
    whole[a] = q * q / 3;
  }
  return whole;
}

DenseModel::Vector DenseModel::reciprocalPressure(const Vector& forces, double reach) const {
  const Eigen::Index count = points_.cols();
  Vector spread = Vector::Zero(count);
  for (Eigen::Index p = 0; p < count; ++p) {
    double total = 0.0;
    for (Eigen::Index q = 0; q < count; ++q) {
      const double weight = std::exp(-(points_.col(p) - points_.col(q)).squaredNorm() / (2 * reach * reach));
      spread[p] += weight * forces.segment<3>(3 * q).norm();
      total += weight;
    }
    spread[p] /= total;
  }
  Vector pressure = spread;
  for (Eigen::Index p = 0; p < count; ++p) {
    if (beyond_[p]) pressure[p] = std::max(spread[p], spread[nearest_[static_cast<std::size_t>(p)]]);
  }
  return (pressure.array() + 1e-6 * spread.maxCoeff()).inverse();
}

DenseModel::Fit DenseModel::posterior(const Matrix& H, const Matrix& motion, const Vector& d, double n2,
                                      const std::vector<int>& atoms, const Vector& gamma,
                                      const std::vector<Eigen::Matrix3d>& omega) {
  const auto count = static_cast<Eigen::Index>(atoms.size());
  Matrix S = Matrix::Zero(3 * count, 3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    S.block<3, 3>(3 * i, 3 * i) = Eigen::Matrix3d((gamma[atoms[index]] * omega[index]).llt().matrixL());
  }
  Matrix B(d.size(), 3 * count + motion.cols());
  B << H(Eigen::all, components(atoms)) * S, motion;
  const Matrix A = B.transpose() * B + n2 * Matrix::Identity(B.cols(), B.cols());
  const Matrix inverse = A.inverse();
  const Vector x = inverse * (B.transpose() * d);
  const Matrix ofNoise = inverse - n2 * inverse * inverse;
  const Matrix noise = n2 * S * ofNoise.topLeftCorner(3 * count, 3 * count) * S.transpose();
  Fit fit{S * x.head(3 * count),
          Vector(count),
          Vector(count),
          n2 * S * inverse.topLeftCorner(3 * count, 3 * count) * S.transpose(),
          (d - B * x).squaredNorm(),
          x.tail<4>()};
  for (Eigen::Index i = 0; i < count; ++i) {
    fit.known[i] = 3 - fit.sigma.block<3, 3>(3 * i, 3 * i).trace() / gamma[atoms[static_cast<std::size_t>(i)]];
    fit.noise[i] = noise.block<3, 3>(3 * i, 3 * i).trace();
  }
  return fit;
}

void DenseModel::keep(const Fit& fit, const std::vector<int>& atoms, Seen& seen) {
  for (std::size_t i = 0; i < atoms.size(); ++i) {
    const auto index = static_cast<Eigen::Index>(i);
    seen.mean.segment<3>(3 * atoms[i]) = fit.force.segment<3>(3 * index);
    seen.known[atoms[i]] = fit.known[index];
    seen.noise[atoms[i]] = fit.noise[index];
  }
}

DenseModel::Matrix DenseModel::wrenches() const {
  Matrix result(6, 3 * points_.cols());
  for (Eigen::Index p = 0; p < points_.cols(); ++p) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d force = Eigen::Vector3d::Unit(axis), at = points_.col(p);
      result.col(3 * p + axis) << force, at.cross(force);
    }
  }
  return result;
}

}  // namespace tractiond::solve
