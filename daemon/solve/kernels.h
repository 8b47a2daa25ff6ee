// The loops in which a frame's solving spends its time. All stream matrices row by row, in memory order.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace tractiond::solve {

/// Floats a cache line holds: rows are padded with zeros to a multiple of it.
inline constexpr int kLineFloats = 16;

inline int padded(int columns) {
  return (columns + kLineFloats - 1) / kLineFloats * kLineFloats;
}

/// A matrix of floats, row after row, each row on a cache line's boundary and padded with zeros. Zero at first.
class RowMatrix {
 public:
  RowMatrix() = default;
  RowMatrix(int rows, int columns);

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  int stride() const { return padded(columns_); }
  float* row(int index) { return data_.get() + static_cast<std::ptrdiff_t>(index) * stride(); }
  const float* row(int index) const { return data_.get() + static_cast<std::ptrdiff_t>(index) * stride(); }
  std::span<float> all() { return {data_.get(), size()}; }
  std::span<const float> all() const { return {data_.get(), size()}; }

 private:
  std::size_t size() const { return static_cast<std::size_t>(rows_) * static_cast<std::size_t>(stride()); }

  struct Free {
    void operator()(float* data) const;
  };
  int rows_ = 0, columns_ = 0;
  std::unique_ptr<float[], Free> data_;
};

/// sum += sum over k of coefficients[k] * matrix.row(rows[k]); `sum` holds matrix.stride() floats on a line's boundary.
void addRows(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, double* sum);

/// products[k] = matrix.row(rows[k]) . vector, of matrix.stride() floats on a line's boundary.
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const float* vector, double* products);

/// The same in double precision throughout; `vector` has matrix.stride() elements.
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const double* vector, double* products);

/// Cholesky factor in place of a packed lower triangle, as solveLower() wants it. False: not positive definite.
bool factoriseLower(std::span<double> lower, int size);

/// squares[i] = (i, i) of (L L')^-1; `scratch` holds `size` doubles.
void inverseDiagonal(std::span<const double> lower, int size, double* scratch, double* squares);

/// Scalar product.
double dotProduct(const double* a, const double* b, int size);

/// Solves L y = b in place. L is lower triangular and packed: row i starts at i (i + 1) / 2; its diagonal is stored as
/// the reciprocal.
void solveLower(std::span<const double> lower, int size, double* vector);

/// Solves L' x = y in place.
void solveLowerTransposed(std::span<const double> lower, int size, double* vector);

}  // namespace tractiond::solve
