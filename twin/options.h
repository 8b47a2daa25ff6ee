// Command line of traction-twin.
#pragma once

#include "base/error.h"
#include "twin/format.h"

#include <tl/expected.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace twin {

struct Options {
  std::string scenario;               ///< a path, or the name of a shipped scenario
  std::string address = "127.0.0.1";  ///< local IPv4 address to serve on
  // Of a scenario with a gripper.
  std::string secondAddress = "127.0.0.2";        ///< of the second finger's camera
  std::string commands = "tcp://127.0.0.1:9878";  ///< ZeroMQ endpoint that takes commands: PULL, binds
  bool lockstep = false;                          ///< each pair of pictures waits for a command
  std::string gel;                                ///< gel file in place of the scenario's gel; empty: none
  std::optional<Format> format;                   ///< replaces the scenario's
  std::optional<double> rate_hz;                  ///< replaces the scenario's
  std::uint32_t seed = 0;                         ///< of the noise
  std::filesystem::path truth;                    ///< file for the true states; empty: none
  bool truthMarkers = false;                      ///< with displacement_px
  double lostRatio = 0.0;                         ///< share of the stream's packets that are not sent, 0 to 1
  double seconds = 0.0;          ///< time after which to end, of the scenario with `images`; 0: until a signal
  std::filesystem::path cache;   ///< directory for GelModel; empty: none
  std::filesystem::path served;  ///< file of raw pictures to serve instead of drawing the scenario; empty: none
  std::string images;            ///< file or pipe ("-": standard output) to write pictures to; empty: they are served
};

/// Parses the command line. On failure returns an exit code, as manual::parse() does.
tl::expected<Options, int> parseCommandLine(int argc, char** argv);

/// Returns the file of a scenario: a name, which consists of letters, digits and underscores, as a shipped file;
/// anything else unchanged as a path, which need not exist. Error: EX_NOINPUT if no shipped scenario has that name.
tl::expected<std::filesystem::path, tractiond::Error> findScenario(const std::string& scenario);

}  // namespace twin
