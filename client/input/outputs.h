// The outputs of a profile.
#pragma once

#include "base/error.h"
#include "client/input/profile.h"
#include "client/input/touches.h"

#include <tl/expected.hpp>

#include <memory>
#include <vector>

namespace traction::input {

/// Makes devices and sockets. Fails with the first error of one of them.
tl::expected<std::vector<std::unique_ptr<Output>>, tractiond::Error> openOutputs(const Profile& profile);

}  // namespace traction::input
