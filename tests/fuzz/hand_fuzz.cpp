#include "client/touch/hand_file.h"
#include "tests/fuzz/target.h"
#include "tests/support/places.h"

namespace fuzz {

std::vector<std::string> seeds() {
  return {fileText(tractiond::test::source("config/hand.toml"))};
}

bool feed(std::string_view bytes) {
  const auto hand = traction::contacts::parseHand(bytes, "fuzz");
  if (!hand) return false;
  for (const auto& finger : hand->fingers) {
    const Eigen::Matrix3d& rotation = finger.pose.rotation;
    require((rotation * rotation.transpose()).isIdentity(1e-9), "a pose is no rotation");
    require(finger.pose.position_m.allFinite(), "a finger is nowhere");
  }
  return true;
}

}  // namespace fuzz
