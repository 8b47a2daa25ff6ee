#include "sensor/elastic/frontal_solver.h"

#include "sensor/elastic/linear_algebra.h"

#include <algorithm>
#include <cassert>

namespace sensor::elastic {

using Eigen::Index, Eigen::MatrixXd;

Front FrontalSolver::eliminate(const std::vector<Front>& parts, const std::function<bool(int)>& isDone) {
  Factor factor;
  Front rest;
  Index first = parts.front().firstColumn, end = first;
  for (const Front& part : parts) {
    first = std::min(first, part.firstColumn);
    end = std::max(end, part.firstColumn + part.right.cols());
    for (const int unknown : part.unknowns) {
      if (local_[unknown] >= 0) continue;
      local_[unknown] = 0;
      (isDone(unknown) ? factor.eliminated : rest.unknowns).push_back(unknown);
    }
  }
  factor.firstColumn = rest.firstColumn = first;
  const Index columns = end - first;
  factor.remaining = rest.unknowns;
  const auto done = static_cast<Index>(factor.eliminated.size()), left = static_cast<Index>(rest.unknowns.size());
  int row = 0;
  for (const int unknown : factor.eliminated) local_[unknown] = row++;
  for (const int unknown : rest.unknowns) local_[unknown] = row++;

  factor.lower.setZero(done + left, done);
  factor.right.setZero(done, columns);
  rest.matrix.setZero(left, left);
  rest.right.setZero(left, columns);
  for (const Front& part : parts) {
    std::vector<Index> to(part.unknowns.size());
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = local_[part.unknowns[i]];
    for (Index j = 0; j < part.matrix.cols(); ++j)
      for (Index i = j; i < part.matrix.rows(); ++i) {
        const Index r = std::max(to[i], to[j]), c = std::min(to[i], to[j]);
        (c < done ? factor.lower(r, c) : rest.matrix(r - done, c - done)) += part.matrix(i, j);
      }
    const Index shift = part.firstColumn - factor.firstColumn;
    for (Index j = 0; j < part.right.cols(); ++j)
      for (Index i = 0; i < part.right.rows(); ++i)
        (to[i] < done ? factor.right(to[i], shift + j) : rest.right(to[i] - done, shift + j)) += part.right(i, j);
  }
  for (const int unknown : factor.eliminated) local_[unknown] = -1;
  for (const int unknown : rest.unknowns) local_[unknown] = -1;

  auto diagonal = factor.lower.topRows(done), below = factor.lower.bottomRows(left);
  [[maybe_unused]] const bool isDefinite = factorise(diagonal);
  assert(isDefinite);
  solveLowerRight(diagonal, Op::kTransposed, below);
  multiplyBySelf(-1.0, below, Op::kPlain, 1.0, rest.matrix);
  solveLower(diagonal, Op::kPlain, factor.right);
  multiply(-1.0, below, Op::kPlain, factor.right, Op::kPlain, 1.0, rest.right);
  factors_.push_back(std::move(factor));
  return rest;
}

MatrixXd FrontalSolver::solve(Index columns) {
  MatrixXd solution = MatrixXd::Zero(static_cast<Index>(local_.size()), columns);
  for (; !factors_.empty(); factors_.pop_back()) {
    const Factor& factor = factors_.back();
    const auto done = static_cast<Index>(factor.eliminated.size()), left = static_cast<Index>(factor.remaining.size());
    const MatrixXd known = solution(factor.remaining, Eigen::all);
    MatrixXd x = MatrixXd::Zero(done, columns);
    x.middleCols(factor.firstColumn, factor.right.cols()) = factor.right;
    multiply(-1.0, factor.lower.bottomRows(left), Op::kTransposed, known, Op::kPlain, 1.0, x);
    solveLower(factor.lower.topRows(done), Op::kTransposed, x);
    solution(factor.eliminated, Eigen::all) = x;
  }
  return solution;
}

}  // namespace sensor::elastic
