// Reads the machine that `tractionctl doctor` examines: its files below a root, and what is not a file. Tests replace
// it.
#pragma once

#include "traction/status.h"

#include <tl/expected.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

namespace traction::doctor {

/// The examined machine. Reentrant. Paths are those of that machine, without the root: "/proc/net/route"; they must
/// name a file or directory below "/". What cannot be had is stated in the result.
class Box {
 public:
  /// \param root directory under which the machine's files are; run(), status() and keepsTime() concern this machine,
  /// whatever it is
  explicit Box(std::filesystem::path root = "/")
      : root_(std::move(root)) {}
  virtual ~Box() = default;
  Box(const Box&) = delete;
  Box& operator=(const Box&) = delete;

  /// Returns the text of a file of at most 1 MiB. Does not wait for a pipe or a device. Fails as
  /// tractiond::readWholeFile().
  tl::expected<std::string, std::error_code> read(const std::string& path) const;
  /// Returns the lines of a file, as linesOf(); none if it cannot be read.
  std::vector<std::string> lines(const std::string& path) const;
  /// Returns the first line without blanks (space, tab, final '\r') at its ends; empty if the file is; nothing if it
  /// cannot be read.
  std::optional<std::string> line(const std::string& path) const;
  /// Returns the number that the first line consists of; nothing if it is not a number, or cannot be read.
  std::optional<double> number(const std::string& path) const;
  /// Returns the names in a directory, sorted; those that came before an error, if there is one.
  std::vector<std::string> list(const std::string& path) const;
  /// Returns whether the path, with its symbolic links followed, exists and can be reached.
  bool exists(const std::string& path) const { return fileStatus(path).error == 0; }

  struct FileStatus {
    int error = 0;                                ///< errno; 0: the rest is known
    std::uint32_t user = 0, group = 0, mode = 0;  ///< mode: permissions alone
  };
  /// Returns owner, group and permissions of a file or directory, with symbolic links followed.
  virtual FileStatus fileStatus(const std::string& path) const;

  struct Ran {
    int exitCode = 0;
    std::string output, complaint;  ///< standard output and error
  };
  /// Runs a program, found by PATH, with its arguments and without input, and waits for it. Returns nothing if it
  /// cannot be started, is ended by a signal, takes longer than 10 s or prints more than 1 MiB; it is then killed.
  /// \param words path or name of the program, then its arguments; not empty
  virtual std::optional<Ran> run(const std::vector<std::string>& words) const;

  /// Asks the daemon of an instance for its status, on this machine whatever the root is. Waits up to 3 s for the
  /// connection, and up to 3 s for the answer. Fails with the text of the traction::Error.
  virtual tl::expected<traction::Status, std::string> status(const std::string& instance) const;

  /// Returns whether the kernel reports the time of day as synchronised; nothing if it does not tell.
  virtual std::optional<bool> keepsTime() const;

 private:
  std::filesystem::path at(const std::string& path) const { return root_ / path.substr(path.find_first_not_of('/')); }

  std::filesystem::path root_;
};

/// Splits a line at its blanks; no word is empty.
std::vector<std::string> wordsOf(const std::string& line);
/// Splits a text at each '\n', which is left out; empty lines are kept, but none follows the last '\n'.
std::vector<std::string> linesOf(const std::string& text);

}  // namespace traction::doctor
