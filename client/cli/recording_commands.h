// Command-line options of tractionctl record, replay, info, recover, export.
#pragma once

#include "traction/subscriber.h"

#include <CLI/CLI.hpp>

#include <limits>
#include <string>

namespace traction::cli {

class RecordingCommands {
 public:
  explicit RecordingCommands(CLI::App& app);

  /// Runs the command that was given, if it is one of these. \throws RecordingError, Error, OutputError
  void run(const SubscriberOptions& subscription) const;

 private:
  CLI::App &record_, &replay_, &info_, &recover_, &export_;
  double seconds_ = std::numeric_limits<double>::infinity(), speed_ = 1.0;
  std::string file_, output_, sensor_, truth_, endpoint_ = "tcp://127.0.0.1:9892";
  bool json_ = false, pictures_ = false;
};

}  // namespace traction::cli
