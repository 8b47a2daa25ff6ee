// A profile: what a gel is used as. config/input has those that are shipped.
#pragma once

#include "base/error.h"
#include "client/input/affine.h"
#include "client/input/devices.h"
#include "client/input/keyboard.h"
#include "client/input/osc.h"
#include "client/input/pointer.h"
#include "client/input/tuio.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace traction::input {

struct SpacenavOptions {
  std::filesystem::path socket;  ///< empty: spacenavSocket()
  AxesOptions axes;
};

/// Each output that is there is used.
struct Profile {
  double turn_rad = 0.0;  ///< View
  Area area;
  std::optional<PointerOptions> pointer;
  std::optional<TouchOptions> touch;  ///< with `pointer`: several touches only
  std::optional<PenOptions> pen;      ///< without those
  std::optional<TextOptions> text;    ///< without all of these
  std::optional<ZoomOptions> zoom;
  std::optional<SpacenavOptions> spacenav;
  std::optional<TuioOptions> tuio11, tuio20;
  std::optional<OscOptions> osc;
};

/// Returns the folder of what is shipped: share/tractiond/input beside the directory of this program.
std::filesystem::path shippedFolder();

/// Parses the text of a profile. EX_CONFIG: it is wrong.
/// \param name of the file in errors
tl::expected<Profile, tractiond::Error> parseProfile(std::string_view text, const std::string& name);
/// Parses a file, or a shipped profile: NAME.toml in shippedFolder(). EX_NOINPUT: it cannot be read. Otherwise as
/// parseProfile().
tl::expected<Profile, tractiond::Error> loadProfile(const std::string& nameOrPath);

}  // namespace traction::input
