// The loops in which a frame's solving spends its time. All stream matrices row by row, in memory order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Floats a cache line holds: rows are padded with zeros to a multiple of it.
inline constexpr int kLineFloats = 16;

inline int padded(int columns) {
  return (columns + kLineFloats - 1) / kLineFloats * kLineFloats;
}

/// Memory for numbers that are streamed: on a cache line's boundary, zero at first.
template <typename Number>
class LineArray {
 public:
  LineArray() = default;
  explicit LineArray(std::size_t size);
  std::size_t size() const { return size_; }
  Number* data() { return data_.get(); }
  const Number* data() const { return data_.get(); }

 private:
  struct Free {
    void operator()(Number* data) const;
  };
  std::size_t size_ = 0;
  std::unique_ptr<Number[], Free> data_;
};

/// A matrix of floats, row after row, each row on a cache line's boundary and padded with zeros. Zero at first.
class RowMatrix {
 public:
  RowMatrix() = default;
  RowMatrix(int rows, int columns);

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  int stride() const { return padded(columns_); }
  float* row(int index) { return data_.data() + static_cast<std::ptrdiff_t>(index) * stride(); }
  const float* row(int index) const { return data_.data() + static_cast<std::ptrdiff_t>(index) * stride(); }
  std::span<float> all() { return {data_.data(), data_.size()}; }
  std::span<const float> all() const { return {data_.data(), data_.size()}; }

 private:
  int rows_ = 0, columns_ = 0;
  LineArray<float> data_;
};

/// Rounds a matrix of doubles that has rows(), cols() and (row, column), as Eigen's have.
template <typename Source>
RowMatrix toRows(const Source& source) {
  RowMatrix rows(static_cast<int>(source.rows()), static_cast<int>(source.cols()));
  for (int i = 0; i < rows.rows(); ++i) {
    for (int j = 0; j < rows.columns(); ++j) rows.row(i)[j] = static_cast<float>(source(i, j));
  }
  return rows;
}

/// The upper left corner of a RowMatrix in half the bytes: integers with a factor for each row, off by at most 1/65534
/// of the largest number in the row. Padded as that one.
class CoarseMatrix {
 public:
  CoarseMatrix() = default;
  CoarseMatrix(const RowMatrix& matrix, int rows, int columns);

  int rows() const { return static_cast<int>(factors_.size()); }
  int columns() const { return columns_; }
  int stride() const { return padded(columns_); }
  const std::int16_t* row(int index) const { return data_.data() + static_cast<std::ptrdiff_t>(index) * stride(); }
  float factor(int index) const { return factors_[static_cast<std::size_t>(index)]; }

 private:
  int columns_ = 0;
  std::vector<float> factors_;
  LineArray<std::int16_t> data_;
};

/// sum += sum over k of coefficients[k] * matrix.row(rows[k]); `sum` holds matrix.stride() floats on a line's boundary.
void addRows(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, double* sum);
/// The same of the columns first .. end - 1 alone, `first` being a multiple of kLineFloats; what fills the last line is
/// added, too.
void addColumns(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, int first,
                int end, double* sum);
/// As addRows(), coarsely; `sum` on a line's boundary.
void addRows(const CoarseMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, float* sum);

/// products[k] = matrix.row(rows[k]) . vector, of matrix.stride() floats on a line's boundary.
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const float* vector, double* products);

/// The same in double precision throughout; `vector` has matrix.stride() elements.
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const double* vector, double* products);

// The same of the first `columns` columns alone; `vector` is padded with zeros to a multiple of kLineFloats.
void multiplyFirst(const RowMatrix& matrix, std::span<const int> rows, int columns, const float* vector,
                   double* products);
void multiplyFirst(const RowMatrix& matrix, std::span<const int> rows, int columns, const double* vector,
                   double* products);

/// Cholesky factor in place of a packed lower triangle, as solveLower() wants it. `scratch` holds kColumns * size
/// doubles. False: not positive definite.
bool factoriseLower(std::span<double> lower, int size, double* scratch);

/// Columns first .. first + kColumns - 1 of L^-1, where there are so many, row after row as solveLowerColumns() wants
/// them; the rows before `first` are left alone.
void inverseColumns(std::span<const double> lower, int first, int size, double* columns);

/// squares[i] = (i, i) of (L L')^-1; `scratch` as above.
void inverseDiagonal(std::span<const double> lower, int size, double* scratch, double* squares);

inline double square(double x) {
  return x * x;
}

/// Scalar product.
double dotProduct(const double* a, const double* b, int size);

/// Solves L y = b in place. L is lower triangular and packed: row i starts at i (i + 1) / 2; its diagonal is stored as
/// the reciprocal.
void solveLower(std::span<const double> lower, int size, double* vector);

/// Solves L Y = B in place for kColumns right-hand sides at once, stored row after row; fastest on a line's boundary.
inline constexpr int kColumns = 8;
void solveLowerColumns(std::span<const double> lower, int size, double* columns);

/// products[stride * k + c] = matrix.row(rows[k]) . column c of kColumns columns of matrix.columns() numbers, stored
/// so.
void multiplyRowsByColumns(const RowMatrix& matrix, std::span<const int> rows, const double* columns, double* products,
                           int stride);

/// products = A'B, kColumns x kColumns row after row, of two such.
void multiplyColumns(const double* a, const double* b, int size, double* products);

/// Solves L' x = y in place.
void solveLowerTransposed(std::span<const double> lower, int size, double* vector);

}  // namespace tractiond::solve
