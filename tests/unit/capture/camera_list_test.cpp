#include "daemon/capture/camera_list.h"

#include <gtest/gtest.h>

namespace tractiond::capture::camera_list_test {
namespace {

TEST(ShareAdvice, DividesTheLink) {
  EXPECT_EQ(shareAdvice(1, 125e6, 9000), "");
  EXPECT_EQ(shareAdvice(3, 0, 9000), "") << "the link's speed is not known";
  EXPECT_EQ(shareAdvice(2, 125e6, 9000),
            "2 cameras share this link: give each throughput_bytes_per_s = 56250000, or packet_delay_ns = 72000 with "
            "packets of 9000 bytes");
}

}  // namespace
}  // namespace tractiond::capture::camera_list_test
