#include "daemon/solve/kernels.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace tractiond::solve::kernels_test {
namespace {

class Kernels : public testing::TestWithParam<int> {  // the number of rows or unknowns
 protected:
  float number() { return distribution_(random_); }

  RowMatrix matrix(int rows, int columns) {
    RowMatrix result(rows, columns);
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < columns; ++j) result.row(i)[j] = number();
    }
    return result;
  }

 private:
  std::mt19937 random_{1};
  std::uniform_real_distribution<float> distribution_{-1.0F, 1.0F};
};

TEST_P(Kernels, AddRowsAddsTheChosenRows) {
  const RowMatrix a = matrix(2 * GetParam() + 1, 37);
  std::vector<int> rows;
  std::vector<float> coefficients;
  std::vector<double> sum(static_cast<std::size_t>(a.stride()), 1.0), expected = sum;
  for (int k = 0; k < GetParam(); ++k) {
    rows.push_back(2 * k + 1);
    coefficients.push_back(number());
    for (int j = 0; j < 37; ++j) expected[j] += static_cast<double>(coefficients.back()) * a.row(rows.back())[j];
  }
  addRows(a, rows, coefficients, sum.data());
  for (int j = 0; j < 37; ++j) EXPECT_NEAR(sum[j], expected[j], 1e-5);
  for (int j = 37; j < a.stride(); ++j) EXPECT_EQ(sum[j], 1.0);

  std::vector<double> inParts(sum.size(), 1.0);
  addColumns(a, rows, coefficients, 0, 10, inParts.data());  // with the line's other six
  addColumns(a, rows, coefficients, kLineFloats, 37, inParts.data());
  EXPECT_EQ(inParts, sum);
}

TEST_P(Kernels, MultiplyRowsMultipliesTheChosenRows) {
  const RowMatrix a = matrix(2 * GetParam() + 1, 37), x = matrix(1, 37);
  std::vector<int> rows;
  for (int k = 0; k < GetParam(); ++k) rows.push_back(2 * k);
  std::vector<double> products(rows.size());
  multiplyFirst(a, rows, a.columns(), x.row(0), products.data());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    double expected = 0.0;
    for (int j = 0; j < 37; ++j) expected += static_cast<double>(a.row(rows[k])[j]) * x.row(0)[j];
    EXPECT_NEAR(products[k], expected, 1e-5);
  }

  std::vector<double> ofFirst(rows.size()), widened(static_cast<std::size_t>(a.stride()), 0.0);
  RowMatrix part(1, 20);
  std::copy_n(x.row(0), 20, part.row(0));
  std::copy_n(x.row(0), 20, widened.begin());
  multiplyRows(a, rows, widened.data(), products.data());
  multiplyFirst(a, rows, 20, part.row(0), ofFirst.data());
  for (std::size_t k = 0; k < rows.size(); ++k) EXPECT_NEAR(ofFirst[k], products[k], 1e-5);
  multiplyFirst(a, rows, 20, widened.data(), ofFirst.data());
  for (std::size_t k = 0; k < rows.size(); ++k) EXPECT_NEAR(ofFirst[k], products[k], 1e-12);
}

TEST_P(Kernels, MultiplyRowsByColumnsInDoublePrecision) {
  for (const int columns : {37, 300}) {  // 300: more than are converted at a time
    const RowMatrix a = matrix(2 * GetParam() + 1, columns);
    std::vector<int> rows;
    for (int k = 0; k < GetParam(); ++k) rows.push_back(2 * k);
    std::vector<double> x(static_cast<std::size_t>(kColumns * a.stride())), first(static_cast<std::size_t>(a.stride()));
    for (double& value : x) value = number();
    for (int j = 0; j < columns; ++j) first[j] = x[kColumns * j];
    constexpr int kStride = kColumns + 3;
    std::vector<double> products(kStride * rows.size(), 5.0), ofFirst(rows.size());
    multiplyRowsByColumns(a, rows, x.data(), products.data(), kStride);
    multiplyRows(a, rows, first.data(), ofFirst.data());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      for (int c = 0; c < kStride; ++c) {
        double expected = c < kColumns ? 0.0 : 5.0;
        for (int j = 0; j < columns && c < kColumns; ++j) {
          expected += static_cast<double>(a.row(rows[k])[j]) * x[kColumns * j + c];
        }
        EXPECT_NEAR(products[kStride * k + c], expected, 1e-12);
        if (c == 0) {
          EXPECT_NEAR(ofFirst[k], expected, 1e-12);
        }
      }
    }
  }
}

TEST_P(Kernels, DotProductAddsUp) {
  std::vector<double> a, b;
  double expected = 0.0;
  for (int i = 0; i < GetParam(); ++i) {
    a.push_back(number());
    b.push_back(number());
    expected += a.back() * b.back();
  }
  EXPECT_NEAR(dotProduct(a.data(), b.data(), GetParam()), expected, 1e-13);
}

TEST_P(Kernels, TriangularSolvesUndoTheProduct) {
  const int size = GetParam();
  const auto at = [](int i, int j) { return i * (i + 1) / 2 + j; };
  std::vector<double> lower(static_cast<std::size_t>(at(size, 0)));
  std::vector<double> x(static_cast<std::size_t>(size));
  for (double& value : lower) value = 0.1 * number();
  for (int i = 0; i < size; ++i) lower[at(i, i)] = 1.0 + std::abs(number());
  for (double& value : x) value = number();

  std::vector<double> product(x.size(), 0.0), transposed(x.size(), 0.0);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) {
      product[i] += lower[at(i, j)] * x[j];
      transposed[j] += lower[at(i, j)] * x[i];
    }
  }
  for (int i = 0; i < size; ++i) lower[at(i, i)] = 1.0 / lower[at(i, i)];
  solveLower(lower, size, product.data());
  solveLowerTransposed(lower, size, transposed.data());
  for (int i = 0; i < size; ++i) {
    EXPECT_NEAR(product[i], x[i], 1e-11);
    EXPECT_NEAR(transposed[i], x[i], 1e-11);
  }
}

TEST_P(Kernels, FactorAndItsUsesMatchEigen) {
  const int size = GetParam();
  Eigen::MatrixXd root(size, size + 3), right(size, kColumns);
  for (double& value : root.reshaped()) value = number();
  for (double& value : right.reshaped()) value = number();
  const int zeros = size / 3;
  right.topRows(zeros).setZero();
  const Eigen::MatrixXd matrix = root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(size, size);
  std::vector<double> lower, columns, scratch(static_cast<std::size_t>(kColumns * size));
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) lower.push_back(matrix(i, j));
    for (int k = 0; k < kColumns; ++k) columns.push_back(right(i, k));
  }
  ASSERT_TRUE(factoriseLower(lower, size, scratch.data()));
  solveLowerColumns(lower, zeros, size, columns.data());
  std::array<double, kColumns * kColumns> products{};
  multiplyColumns(columns.data(), columns.data(), size, products.data());

  const Eigen::MatrixXd inverse = matrix.inverse(), expected = right.transpose() * inverse * right;
  for (int i = 0; i < kColumns; ++i) {
    for (int j = 0; j < kColumns; ++j) EXPECT_NEAR(products[kColumns * i + j], expected(i, j), 1e-8);
  }
}

TEST_P(Kernels, WhatIsNotPositiveDefiniteHasNoFactor) {
  const int size = GetParam();
  if (size == 0) return;
  std::vector<double> lower, scratch(static_cast<std::size_t>(kColumns * size));
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) lower.push_back(i == j && i < size - 1 ? 1.0 : 0.0);
  }
  EXPECT_FALSE(factoriseLower(lower, size, scratch.data()));
}

INSTANTIATE_TEST_SUITE_P(Sizes, Kernels, testing::Values(0, 1, 2, 7, 8, 9, 16, 50));

TEST(LineArray, ALargeOneIsZeroOnALineAndItsOwn) {
  constexpr std::size_t kSize = 1'000'001;  // 8 MB
  LineArray<double> large(kSize), small(kSize, Pages::kSmall);
  for (LineArray<double>* array : {&large, &small}) {
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array->data()) % 64, 0U);
    EXPECT_TRUE(std::all_of(array->data(), array->data() + kSize, [](double each) { return each == 0.0; }));
    std::fill_n(array->data(), kSize, 1.0);
  }
  const LineArray<double> moved = std::move(large);
  EXPECT_EQ(std::accumulate(moved.data(), moved.data() + kSize, 0.0), static_cast<double>(kSize));
}

TEST(RowMatrix, RowsLieOnCacheLinesAndThePaddingIsZero) {
  for (const int columns : {1, 16, 17, 700}) {
    RowMatrix a(1000, columns);
    EXPECT_EQ(a.stride() % kLineFloats, 0);
    EXPECT_GE(a.stride(), columns);
    for (const int i : {0, 1, 999}) EXPECT_EQ(reinterpret_cast<std::uintptr_t>(a.row(i)) % 64, 0U);
    for (const float value : a.all()) ASSERT_EQ(value, 0.0F);
  }
}

}  // namespace
}  // namespace tractiond::solve::kernels_test
