// Command line of traction-twin.
#pragma once

#include "twin/truth_writer.h"

#include <optional>

namespace twin {

struct Options {
  std::string scenario;  ///< a path, or the name of a shipped scenario
  std::string address = "127.0.0.1";
  std::optional<Format> format;   ///< replaces the scenario's
  std::optional<double> rate_hz;  ///< replaces the scenario's
  std::uint32_t seed = 0;
  TruthOptions truth;
  double lostRatio = 0.0;
  double seconds = 0.0;          ///< 0: until a signal
  std::filesystem::path cache;   ///< empty: none
  std::filesystem::path served;  ///< file of raw pictures to serve instead of drawing the scenario; empty: none
  std::string images;            ///< file to write pictures to instead of serving them; empty: they are served
};

/// Parses the command line. If the program must end (help, version or an error), returns exit code and text.
tl::expected<Options, Failure> parseCommandLine(int argc, const char* const* argv);

/// Returns the file of a scenario: a path unchanged, a name as a shipped file. Error: EX_NOINPUT if no shipped scenario
/// has that name.
tl::expected<std::filesystem::path, Failure> findScenario(const std::string& scenario);

}  // namespace twin
