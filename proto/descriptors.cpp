#include "proto/traction/v1/descriptors.h"

namespace traction {

namespace {

constexpr char kBytes[] = {
#include "v1.descriptors.inc"
};

}  // namespace

std::string_view descriptors() {
  return {kBytes, sizeof kBytes};
}

}  // namespace traction
