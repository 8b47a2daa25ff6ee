#include "base/hash.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace tractiond::hash_test
