// The command line of traction-twin.
#pragma once

#include "twin/truth_writer.h"

#include <optional>

namespace twin {

struct Options {
  std::string scenario;  ///< a path, or the name of a shipped one
  std::string address = "127.0.0.1";
  std::optional<Format> format;   ///< in place of the scenario's
  std::optional<double> rate_hz;  ///< in place of the scenario's
  std::uint32_t seed = 0;
  TruthOptions truth;
  double lostRatio = 0.0;
  double seconds = 0.0;          ///< 0: until a signal
  std::filesystem::path cache;   ///< empty: none
  std::filesystem::path served;  ///< raw pictures, in place of the scenario's; empty: the scenario is drawn
  std::string images;            ///< where to write pictures to, in place of serving them; empty: they are served
};

/// The options; or how the program ends at once (help, version or a mistake), with exit code and text for the user.
tl::expected<Options, Failure> parseCommandLine(int argc, const char* const* argv);

/// The file of a scenario: a path as it is, a name among the shipped ones.
tl::expected<std::filesystem::path, Failure> findScenario(const std::string& scenario);

}  // namespace twin
