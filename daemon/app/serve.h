// Runs `tractiond`: serves a camera, or computes a recording again. Both return an exit code of sysexits.h.
#pragma once

#include "daemon/app/arguments.h"
#include "daemon/app/config.h"

#include <tl/expected.hpp>

namespace tractiond {

/// Prints an error that prevents the start to standard error, in the form of a log line, and returns its exit code.
/// Does not end the process. Any thread.
int failed(const Error& error);

/// Reads the configuration file of `places`, or takes the defaults if that is empty, and adds what the command line
/// states (pictures from a file, recording), and this program as CameraOptions::inspector. Does not complete it
/// (completed()). EX_NOINPUT: the file cannot be read. EX_CONFIG: it is wrong. Reentrant.
/// \param places located()
tl::expected<Config, Error> configured(const Arguments& arguments, const Places& places);

/// Serves until SIGTERM or SIGINT, or until the source ends by itself: the pictures of a file are over, or the camera
/// cannot be used. Reloads the configuration on SIGHUP (catchSignals()). Returns EX_OK, or the code of an error, which
/// it logs: that of the start (raiseDescriptorLimit(), Instrument::make()), of the source, EX_SOFTWARE if the ledger
/// does not balance, or that of the recording. A stop signal during a long start ends the process with EX_OK. Must be
/// called by the main thread before this program starts its first thread.
/// \param config not completed()
/// \param places located()
/// \param argv of main(), with which the program replaces itself when a gel file has been adopted
int serve(const Arguments& arguments, const Config& config, const Places& places, char** argv);

/// Computes the recording that the arguments name again; see replay(). Logs the error if it returns one.
int replayRecording(const Arguments& arguments, const Config& config, const Places& places);

}  // namespace tractiond
