// The configuration file and the operator who edits it; and the law of what a reload takes over.
#pragma once

#include "daemon/app/reload.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/journal.h"

#include <cstdint>
#include <string>
#include <vector>

namespace tractiond::simulation {

/// What the operator does to the file, by the amount of Event::kReopen.
enum class Edit : std::uint8_t {
  kGain,     ///< another gain of the camera
  kRefused,  ///< a feature that the camera does not have
  kLevel,    ///< another level of the log
  kNothing,
  kBound,    ///< another gain and level, and a key that needs a restart
  kMistake,  ///< the same, and a key that there is not
  kGel,      ///< the same, and the gel file holds another gel
};

class Operator {
 public:
  /// Writes a first configuration. Both references must outlive it.
  Operator(Disk& disk, Journal& journal);

  void edit(Edit how);

  // The daemon.

  /// Starts with the file, in which mistakes are mended before. Returns what it reads.
  Reread start();
  /// Reads the file for a reload.
  tl::expected<Reread, Error> read();
  /// Returns how long the last reload reads.
  std::int64_t readUntil_ns() const { return readUntil_ns_; }

  /// Law: a reload takes all of a configuration or nothing.
  /// \param opened options that the camera was opened with last
  void check(const capture::CameraOptions& opened);

 private:
  struct File {
    int gain = 1;
    bool isDebug = false;
    bool isRefused = false, isBound = false, isMistaken = false, isOfOtherGel = false;
    bool canBeTaken() const { return !isBound && !isMistaken && !isOfOtherGel; }
  };

  void write(const File& file);
  tl::expected<Reread, Error> load() const;

  Disk& disk_;
  Journal& journal_;
  int newest_ = 1;  ///< gain that was written
  std::int64_t readUntil_ns_ = 0;
  File file_;   ///< on the disk
  File taken_;  ///< by the last start or reload that took anything
  bool isCameraRefusing_ = false;
  std::vector<int> gains_;  ///< that the camera may have been opened with last
};

}  // namespace tractiond::simulation
