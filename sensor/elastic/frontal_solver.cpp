#include "sensor/elastic/frontal_solver.h"

#include "sensor/elastic/linear_algebra.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace sensor::elastic {
namespace {

Eigen::Index count(const std::vector<int>& list) {
  return static_cast<Eigen::Index>(list.size());
}

// Adds the lower triangle of a symmetric matrix whose rows become rows `to` of the sum.
void addSymmetric(const Eigen::MatrixXd& part, const std::vector<int>& to, Eigen::MatrixXd& sum) {
  for (Eigen::Index j = 0; j < part.cols(); ++j)
    for (Eigen::Index i = j; i < part.rows(); ++i) sum(std::max(to[i], to[j]), std::min(to[i], to[j])) += part(i, j);
}

}  // namespace

Front FrontalSolver::merge(Front a, Front b) {
  assert(b.firstColumn == a.firstColumn + a.right.cols());
  Front sum{a.unknowns, {}, {}, a.firstColumn};
  std::vector<int> toA(a.unknowns.size()), toB(b.unknowns.size());
  for (std::size_t i = 0; i < a.unknowns.size(); ++i) local_[a.unknowns[i]] = toA[i] = static_cast<int>(i);
  for (std::size_t i = 0; i < b.unknowns.size(); ++i) {
    int& row = local_[b.unknowns[i]];
    if (row < 0) {
      row = static_cast<int>(sum.unknowns.size());
      sum.unknowns.push_back(b.unknowns[i]);
    }
    toB[i] = row;
  }
  for (const int unknown : sum.unknowns) local_[unknown] = -1;

  sum.matrix.setZero(count(sum.unknowns), count(sum.unknowns));
  sum.right.setZero(count(sum.unknowns), a.right.cols() + b.right.cols());
  addSymmetric(a.matrix, toA, sum.matrix);
  addSymmetric(b.matrix, toB, sum.matrix);
  sum.right.topLeftCorner(a.right.rows(), a.right.cols()) = a.right;
  sum.right.rightCols(b.right.cols())(toB, Eigen::all) = b.right;
  return sum;
}

Front FrontalSolver::eliminate(Front front, const std::function<bool(int)>& isDone) {
  // Order the unknowns to be eliminated first.
  std::vector<int> order(front.unknowns.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  const auto middle =
      std::stable_partition(order.begin(), order.end(), [&](int row) { return isDone(front.unknowns[row]); });
  const Eigen::Index done = middle - order.begin(), left = order.end() - middle;
  std::vector<int> to(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) to[order[i]] = static_cast<int>(i);

  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(done + left, done + left);
  addSymmetric(front.matrix, to, matrix);
  front.matrix.resize(0, 0);
  Factor factor{{}, {}, {}, {}, front.right(std::vector(order.begin(), middle), Eigen::all), front.firstColumn};
  Front rest{{}, {}, front.right(std::vector(middle, order.end()), Eigen::all), front.firstColumn};
  for (auto row = order.begin(); row != order.end(); ++row)
    (row < middle ? factor.eliminated : factor.remaining).push_back(front.unknowns[*row]);
  rest.unknowns = factor.remaining;

  [[maybe_unused]] const bool isDefinite = factorise(matrix.topLeftCorner(done, done));
  assert(isDefinite);
  const auto diagonal = matrix.topLeftCorner(done, done);
  solveLowerRight(diagonal, Op::kTransposed, matrix.bottomLeftCorner(left, done));
  multiplyBySelf(-1.0, matrix.bottomLeftCorner(left, done), Op::kPlain, 1.0, matrix.bottomRightCorner(left, left));
  solveLower(diagonal, Op::kPlain, factor.right);
  multiply(-1.0, matrix.bottomLeftCorner(left, done), Op::kPlain, factor.right, Op::kPlain, 1.0, rest.right);
  factor.diagonal = diagonal;
  factor.below = matrix.bottomLeftCorner(left, done);
  rest.matrix = matrix.bottomRightCorner(left, left);
  factors_.push_back(std::move(factor));
  return rest;
}

Eigen::MatrixXd FrontalSolver::solve(Eigen::Index columns) {
  Eigen::MatrixXd solution = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(local_.size()), columns);
  for (; !factors_.empty(); factors_.pop_back()) {
    const Factor& factor = factors_.back();
    const Eigen::MatrixXd known = solution(factor.remaining, Eigen::all);
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(count(factor.eliminated), columns);
    x.middleCols(factor.firstColumn, factor.right.cols()) = factor.right;
    multiply(-1.0, factor.below, Op::kTransposed, known, Op::kPlain, 1.0, x);
    solveLower(factor.diagonal, Op::kTransposed, x);
    solution(factor.eliminated, Eigen::all) = x;
  }
  return solution;
}

}  // namespace sensor::elastic
