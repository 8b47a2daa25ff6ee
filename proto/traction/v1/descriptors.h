// What the messages are made of, for files that are to be understood without this program.
#pragma once

#include <string_view>

namespace traction {

/// A FileDescriptorSet (google/protobuf/descriptor.proto) of all of traction/v1.
std::string_view descriptors();

}  // namespace traction
