// Holds the paths of this clone for all tests: a compiler cache of another clone knows every file but this one.
#include "tests/support/places.h"

namespace tractiond::test {

std::string source(const std::string& path) {
  return TRACTION_SOURCE_DIR "/" + path;
}
std::string built(const std::string& path) {
  return TRACTION_BUILD_DIR "/" + path;
}

}  // namespace tractiond::test
