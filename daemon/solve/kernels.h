// Linear algebra of the solver: the loops that take most of the time of a frame. All of them read matrices row by row,
// in memory order. "On a line's boundary" means that an address is a multiple of 64 bytes, the size of a cache line.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Number of floats in a cache line. Rows are padded with zeros to a multiple of it.
inline constexpr int kLineFloats = 16;

/// Returns the padded number of columns.
inline int padded(int columns) {
  return (columns + kLineFloats - 1) / kLineFloats * kLineFloats;
}

/// Pages of a large array: kLarge ones stream faster, of kSmall ones only those take memory that are written to.
enum class Pages { kLarge, kSmall };

/// An array on a line's boundary, filled with zeros at first. A large one takes memory when it is first written to.
template <typename Number>
class LineArray {
 public:
  LineArray() = default;
  /// Allocates the array, all zeros.
  /// \throws std::bad_alloc
  /// \param size number of elements; not padded
  explicit LineArray(std::size_t size, Pages pages = Pages::kLarge);
  LineArray(const LineArray& other)
      : LineArray(other.size_) {
    std::copy_n(other.data(), size_, data());
  }
  LineArray(LineArray&&) noexcept = default;
  LineArray& operator=(LineArray&&) noexcept = default;
  std::size_t size() const { return size_; }
  Number* data() { return data_.get(); }
  const Number* data() const { return data_.get(); }

 private:
  struct Free {
    void* mapped = nullptr;  ///< null: allocated
    std::size_t length = 0;
    void operator()(Number* data) const;
  };
  std::size_t size_ = 0;
  std::unique_ptr<Number[], Free> data_;
};

/// A matrix of floats, row after row, each row on a cache line's boundary and padded with zeros. Zero at first.
class RowMatrix {
 public:
  RowMatrix() = default;
  /// Allocates the matrix; all elements are 0.
  RowMatrix(int rows, int columns, Pages pages = Pages::kLarge);
  RowMatrix(RowMatrix&&) noexcept = default;  // not copied: most are large
  RowMatrix& operator=(RowMatrix&&) noexcept = default;

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  int stride() const { return padded(columns_); }  ///< Returns the number of floats from one row to the next.
  /// Returns a row: stride() floats on a line's boundary. The index is not checked.
  float* row(int index) { return data_.data() + static_cast<std::ptrdiff_t>(index) * stride(); }
  const float* row(int index) const { return data_.data() + static_cast<std::ptrdiff_t>(index) * stride(); }
  /// Returns all rows(), with what fills them: rows() * stride() floats.
  std::span<float> all() { return {data_.data(), data_.size()}; }
  std::span<const float> all() const { return {data_.data(), data_.size()}; }
  /// Returns the matrix as Eigen's, without what fills its rows.
  auto view() { return Eigen::Map<Numbers, 0, Eigen::OuterStride<>>(row(0), rows_, columns_, stride()); }
  auto view() const { return Eigen::Map<const Numbers, 0, Eigen::OuterStride<>>(row(0), rows_, columns_, stride()); }

 private:
  using Numbers = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  int rows_ = 0, columns_ = 0;
  LineArray<float> data_;
};

/// Returns a matrix or expression of Eigen's doubles, rounded to floats.
template <typename Source>
RowMatrix toRows(const Source& source) {
  RowMatrix rows(static_cast<int>(source.rows()), static_cast<int>(source.cols()));
  rows.view() = source.template cast<float>();
  return rows;
}

/// Returns the indices 0 .. count - 1.
inline std::vector<int> every(int count) {
  std::vector<int> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// Computes sum += sum over k of coefficients[k] * matrix.row(rows[k]).
/// \param coefficients as many as `rows`
/// \param sum matrix.stride() elements; fastest on a line's boundary
void addRows(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, double* sum);
/// Does what addRows() does for the columns first .. end - 1 alone, and for the padding up to the end of their last
/// line.
/// \param first a multiple of kLineFloats
/// \param sum as in addRows(): its first element belongs to column 0
void addColumns(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, int first,
                int end, double* sum);

/// Computes products[k] = matrix.row(rows[k]) . vector in double precision.
/// \param vector matrix.stride() elements, all finite
/// \param products as many as `rows`
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const double* vector, double* products);

/// Does what multiplyRows() does with the first `columns` columns alone, in single precision.
/// \param vector padded with zeros to a multiple of kLineFloats; fastest on a line's boundary
void multiplyFirst(const RowMatrix& matrix, std::span<const int> rows, int columns, const float* vector,
                   double* products);
/// Does the same in double precision.
/// \param vector padded with zeros to a multiple of kLineFloats
void multiplyFirst(const RowMatrix& matrix, std::span<const int> rows, int columns, const double* vector,
                   double* products);

/// Computes sums[k] = sum over j of weights[j] times the square of element j of row k.
/// \param rows row after row, each padded with zeros to a multiple of kLineFloats
/// \param columns elements of a row before the padding
/// \param weights padded as a row
void sumSquares(std::span<const float> rows, int columns, const float* weights, double* sums);

// `lower` is the lower triangle of a symmetric matrix A of `size` rows, or its Cholesky factor L, A = L L'. It is
// packed: row i starts at i (i + 1) / 2. The factor has the reciprocals of its diagonal elements in their place.

/// Replaces A by L. Returns false if A is not positive definite or contains a NaN; `lower` then has no meaning. Does
/// not detect an infinite element on the diagonal.
/// \param scratch kColumns * size elements
bool factoriseLower(std::span<double> lower, int size, double* scratch);

/// Computes the columns first .. first + kColumns - 1 of L^-1; columns beyond the last one become 0. Leaves the rows
/// before `first` unchanged.
/// \param columns size x kColumns, row after row
void inverseColumns(std::span<const double> lower, int first, int size, double* columns);

inline double square(double x) {
  return x * x;
}

/// Returns the scalar product of two vectors of `size` elements.
double dotProduct(const double* a, const double* b, int size);

/// Computes products[stride * i + j] = column i . column j for all columns i from `first` on and all j <= i.
/// \param size elements of a column, a multiple of 4
void multiplyPairs(std::span<const double* const> columns, int first, int size, double* products, int stride);

/// Solves L y = b in place.
/// \param vector b, then y; `size` elements
void solveLower(std::span<const double> lower, int size, double* vector);

/// Number of columns that are processed together.
inline constexpr int kColumns = 8;
/// Solves L Y = B in place for kColumns right-hand sides.
/// \param first number of rows at the top of B that are 0; those of Y are 0 then
/// \param columns B, then Y: size x kColumns, row after row; fastest on a line's boundary
void solveLowerColumns(std::span<const double> lower, int first, int size, double* columns);

/// Computes products[stride * k + c] = matrix.row(rows[k]) . column c.
/// \param columns matrix.columns() x kColumns, row after row
void multiplyRowsByColumns(const RowMatrix& matrix, std::span<const int> rows, const double* columns, double* products,
                           int stride);

// A block below is a matrix of 3 x kColumns, row after row: three rows for the components of a force.

/// Computes blocks[blockOf[indices[k]]] += shares[k] * block for each k.
/// \param shares as many as `indices`
/// \param blocks block after block
void addShares(std::span<const int> indices, std::span<const int> blockOf, const double* shares, const double* block,
               double* blocks);
/// Computes rows[indices[k]] += forces[k]' * block for each k: what a force adds to kColumns weighted sums.
/// \param forces vectors of 3 elements, as many as `indices`, one after another
/// \param rows row after row, kColumns elements each
void addForces(std::span<const int> indices, const double* forces, const double* block, double* rows);
/// Replaces blocks[k] by L' blocks[k] for each k, where L = roots[indices[k]].
/// \param roots lower triangular 3 x 3 matrices, row after row, one after another
/// \param blocks as many as `indices`, block after block
void multiplyBlocks(std::span<const int> indices, const double* roots, double* blocks);

/// Computes columns += column * row.
/// \param column `size` elements
/// \param row kColumns elements
/// \param columns size x kColumns, row after row
void addProducts(const double* column, const double* row, int size, double* columns);

/// Computes A'B of two matrices, size x kColumns, row after row.
/// \param products kColumns x kColumns, row after row
void multiplyColumns(const double* a, const double* b, int size, double* products);

/// Solves L' x = y in place.
/// \param vector y, then x; `size` elements
void solveLowerTransposed(std::span<const double> lower, int size, double* vector);

}  // namespace tractiond::solve
