// The hand file: which sensors are the fingers of a hand, and where. config/hand.toml is an example.
#pragma once

#include "base/error.h"
#include "touch/hand.h"

#include <tl/expected.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace traction::contacts {

struct HandFile {
  struct Finger {
    std::string instance;  ///< of tractiond; no two are the same
    std::string link;      ///< name of its gel's frame in the robot's description; no two are the same
    touch::Pose pose;
  };
  std::string name;             ///< of the hand: valid for an instance
  std::vector<Finger> fingers;  ///< 1 to kMostFingers
};

inline constexpr std::size_t kMostFingers = 16;

/// Parses the text of a hand file. EX_CONFIG: it is wrong.
/// \param name of the file in errors
tl::expected<HandFile, tractiond::Error> parseHand(std::string_view text, const std::string& name);
/// Parses a file. EX_NOINPUT: it cannot be read. Otherwise as parseHand().
tl::expected<HandFile, tractiond::Error> loadHand(const std::string& path);

}  // namespace traction::contacts
