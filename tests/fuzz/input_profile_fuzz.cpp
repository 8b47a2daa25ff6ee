#include "client/input/profile.h"
#include "tests/fuzz/target.h"
#include "tests/support/places.h"

namespace fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  for (const char* const name : {"mouse", "music", "puck", "strokes", "tablet", "touch", "zoom"})
    all.push_back(fileText(tractiond::test::source("config/input/" + std::string(name) + ".toml")));
  return all;
}

bool feed(std::string_view bytes) {
  const auto profile = traction::input::parseProfile(bytes, "fuzz");
  if (!profile) return false;
  require(profile->area.size_m[0] > 0.0 && profile->area.size_m[1] > 0.0, "a screen has no size");
  require((profile->pointer || profile->touch) + profile->pen.has_value() + profile->text.has_value() <= 1,
          "a contact is two devices");
  if (profile->pointer) require(profile->pointer->release_N < profile->pointer->press_N, "a button has no hysteresis");
  return true;
}

}  // namespace fuzz
