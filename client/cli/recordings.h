// tractionctl record, replay, info, recover, export: recordings as files. docs/recordings.md has their format.
#pragma once

#include "traction/subscriber.h"

#include <stdexcept>
#include <string>

namespace traction::cli {

/// It cannot be done, or was not done to the end; with an exit code of sysexits.h.
class RecordingError : public std::runtime_error {
 public:
  RecordingError(int exitCode, const std::string& what)
      : std::runtime_error(what)
      , exitCode_(exitCode) {}
  int exitCode() const { return exitCode_; }

 private:
  int exitCode_;
};

// All of them \throw RecordingError.

/// Every message of the topics that are asked for, into a new file, until a signal comes or the time is over. \throws
/// Error \param truth endpoint at which a traction-twin tells what is true; empty: none
void record(const SubscriberOptions& options, const std::string& file, const std::string& truth, double seconds);

/// Sends the stream again at an endpoint of its own, from when somebody subscribes there, at `speed` times its own
/// pace. \throws Error; RecordingError also after it was sent: where the recording is cut off or damaged
void replay(const std::string& file, const std::string& endpoint, double speed);

/// What is in it. \throws OutputError; RecordingError also after it was printed: where it is cut off or damaged
void info(const std::string& file, bool json);

/// A new recording of all that can be read.
void recover(const std::string& from, const std::string& to);

/// Its fields, as CSV or NumPy's arrays, or all as illustrate() does: by the ending of `to`, which is replaced.
/// \param sensor empty: there is one
/// \throws RecordingError also after it was written: where the recording is cut off or damaged
void exportFields(const std::string& from, const std::string& to, const std::string& sensor);

/// A recording of all that is there, and of what Foxglove draws of it. \param sensor of whom is drawn; empty: of all
void illustrate(const std::string& from, const std::string& to, const std::string& sensor);

}  // namespace traction::cli
