#include "daemon/app/invalid_fields.h"

#include <gtest/gtest.h>

namespace tractiond::invalid_fields_test {
namespace {

TractionField field(int found, unsigned flags) {
  TractionField field;
  field.resize(1152, 576);
  field.markers.validCount = found;
  field.flags = flags;
  return field;
}

TEST(InvalidFields, NamesTheKeyThatDecides) {
  InvalidFields usual({}, {}), lax({.minValidFraction = 0.5}, {.maxMissingFraction = 0.9});
  EXPECT_EQ(usual.take(), "");
  usual.add(field(800, kFewMarkers));
  EXPECT_EQ(usual.take(), "800 of 1152 markers are found; 864 are needed (solve.max_missing_fraction = 0.25)");
  EXPECT_EQ(usual.take(), "") << "told";
  lax.add(field(500, kFewMarkers));
  EXPECT_EQ(lax.take(), "500 of 1152 markers are found; 576 are needed (track.min_valid_fraction = 0.5)");
  usual.add(field(900, kFewMarkers));
  EXPECT_EQ(usual.take(), "900 of 1152 markers are found, and some of them are too uncertain to count; 864 are needed "
                          "(solve.max_missing_fraction = 0.25)");
  TractionField broken = field(600, kFewMarkers);
  broken.markers.isolatedGaps = 152;
  usual.add(broken);
  EXPECT_EQ(usual.take(), "600 of 1152 markers are found; 750 are needed (solve.max_missing_fraction = 0.25)");
  usual.add(field(1152, kFewMarkers | kGelMismatch));
  EXPECT_EQ(usual.take(), "the gel file does not fit the picture (sensor.gel_file)");
  usual.add(field(1152, 0));
  EXPECT_EQ(usual.take(), "their numbers are not finite");
}

}  // namespace
}  // namespace tractiond::invalid_fields_test
