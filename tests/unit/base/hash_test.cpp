#include "base/hash.h"

#include <gtest/gtest.h>

#include <array>

namespace tractiond::hash_test {
namespace {

TEST(Hash, EqualsTheReferenceOfXxh3) {
  // XXH3_128bits of nothing, as published with the algorithm's test vectors.
  EXPECT_EQ(toHex(hash128("", 0)), "99aa06d3014798d86001c324468d497f");
}

TEST(Hash, DependsOnWhereOneRangeEnds) {
  Hasher one, other;
  one.text("ab"), one.text("c");
  other.text("a"), other.text("bc");
  EXPECT_NE(one.digest(), other.digest());
}

TEST(Hash, InPiecesEqualsAtOnce) {
  const std::array<double, 3> values = {1.0, 2.0, 3.0};
  Hasher pieces;
  for (const double value : values) pieces.value(value);
  EXPECT_EQ(pieces.digest(), hash128(values.data(), sizeof values));
}

}  // namespace
}  // namespace tractiond::hash_test
