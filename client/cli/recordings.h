// tractionctl record, replay, info, recover, export: commands on recordings. docs/recordings.md describes the format.
#pragma once

#include "traction/subscriber.h"

#include <stdexcept>
#include <string>

namespace traction::cli {

/// A failed or incomplete operation, with an exit code of sysexits.h.
class RecordingError : public std::runtime_error {
 public:
  RecordingError(int exitCode, const std::string& what)
      : std::runtime_error(what)
      , exitCode_(exitCode) {}
  int exitCode() const { return exitCode_; }

 private:
  int exitCode_;
};

// All functions below throw RecordingError: EX_NOINPUT, EX_DATAERR or EX_PROTOCOL if a recording cannot be read, is
// none, is damaged or is of a newer version; EX_CANTCREAT or EX_IOERR if a file cannot be created or written; EX_USAGE.
// They block until they are done, and print on standard output (OutputError if that cannot be written). A file that is
// created must not exist yet, except where the comment says that it is replaced.

/// Records every message of the chosen topics into a new file until SIGINT, SIGTERM or SIGHUP, whose handlers it sets,
/// or until the time is over. \throws Error kNoAnswer if no publisher was found for 3 s, and those of Subscriber
/// \param truth endpoint of a traction-twin's true states; empty: none \param seconds duration; infinity: no limit
void record(const SubscriberOptions& options, const std::string& file, const std::string& truth, double seconds);

/// Publishes the recorded stream (topics "traction/...") at `endpoint`, at `speed` times its own rate; starts when a
/// client subscribes. Returns after the last message, or early on SIGINT, SIGTERM or SIGHUP, whose handlers it sets.
/// \param speed larger than 0
/// \throws Error kBadEndpoint; RecordingError also after sending, if the recording is cut off or damaged
void replay(const std::string& file, const std::string& endpoint, double speed);

/// Prints a summary of the recording, as text or as JSON. \throws OutputError; RecordingError also after printing, if
/// it is cut off or damaged
void info(const std::string& file, bool json);

/// Writes a new recording of all readable messages, and prints how many chunks were copied and what was left out.
/// Deletes `to` on failure.
void recover(const std::string& from, const std::string& to);

/// Exports the fields as CSV or NumPy arrays, or all as illustrate() does, by the file extension of `to`: .csv, .npz or
/// .mcap; replaces `to`. \param sensor empty: the only one
/// \throws RecordingError also after writing, if the recording is cut off or damaged
void exportFields(const std::string& from, const std::string& to, const std::string& sensor);

/// Writes a recording of all messages and of their drawings for Foxglove; replaces `to`, which must not be `from`.
/// \param sensor whose drawings are added; empty: all
/// \throws RecordingError also after writing, if the recording is cut off or damaged
void illustrate(const std::string& from, const std::string& to, const std::string& sensor);

}  // namespace traction::cli
