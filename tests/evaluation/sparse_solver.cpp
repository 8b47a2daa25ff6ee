// Solves K X = B for a symmetric positive definite K and writes some rows of X. truth.py compiles it, for itself alone:
//   c++ -O2 -I/usr/include/eigen3 -I/usr/include/suitesparse sparse_solver.cpp -lcholmod
// usage: sparse_solver FOLDER      reads columns, rows (int32), values (f64) of K's lower triangle, compressed by
// columns; right_columns, right_rows, right_values of B; output (int32, rows); writes solution (f64, column by column).
#include <Eigen/CholmodSupport>
#include <Eigen/SparseCore>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <vector>

namespace {

template <typename T>
std::vector<T> read(const std::filesystem::path& path) {
  std::vector<T> values(std::filesystem::file_size(path) / sizeof(T));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
  return values;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 64;
  const std::filesystem::path folder = argv[1];
  const auto columns = read<int>(folder / "columns"), rows = read<int>(folder / "rows");
  const auto values = read<double>(folder / "values");
  const auto rightColumns = read<int>(folder / "right_columns"), rightRows = read<int>(folder / "right_rows");
  const auto rightValues = read<double>(folder / "right_values");
  const auto output = read<int>(folder / "output");
  const int size = static_cast<int>(columns.size()) - 1, count = static_cast<int>(rightColumns.size()) - 1;
  using Matrix = Eigen::SparseMatrix<double>;
  const Eigen::Map<const Matrix> stiffness(size, size, static_cast<int>(values.size()), columns.data(), rows.data(),
                                           values.data());
  Eigen::CholmodSupernodalLLT<Matrix, Eigen::Lower> factor;
  factor.compute(stiffness);
  if (factor.info() != Eigen::Success) {
    std::cerr << "sparse_solver: not positive definite\n";
    return 65;
  }
  std::ofstream out(folder / "solution", std::ios::binary);
  constexpr int kBlock = 64;
  Eigen::MatrixXd right, chosen;
  for (int first = 0; first < count; first += kBlock) {
    const int block = std::min(kBlock, count - first);
    right.setZero(size, block);
    for (int c = 0; c < block; ++c) {
      for (int k = rightColumns[first + c]; k < rightColumns[first + c + 1]; ++k)
        right(rightRows[k], c) += rightValues[k];
    }
    const Eigen::MatrixXd solution = factor.solve(right);
    chosen.resize(static_cast<Eigen::Index>(output.size()), block);
    for (std::size_t i = 0; i < output.size(); ++i) chosen.row(static_cast<Eigen::Index>(i)) = solution.row(output[i]);
    out.write(reinterpret_cast<const char*>(chosen.data()),
              static_cast<std::streamsize>(chosen.size() * sizeof(double)));
  }
  return out ? 0 : 74;
}
