// The schema of all messages, for files that other programs can read without this project's .proto files.
#pragma once

#include <string_view>

namespace traction {

/// Returns a serialised FileDescriptorSet (google/protobuf/descriptor.proto) of all files of traction/v1 and those that
/// they import. Static storage; reentrant.
std::string_view descriptors();

}  // namespace traction
