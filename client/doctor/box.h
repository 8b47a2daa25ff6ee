// Reads the machine that `tractionctl doctor` examines: its files below a root, and what is not a file. Tests replace
// it.
#pragma once

#include "traction/status.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
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

  struct Reading {
    std::string text;  ///< what was read before an error, if there is one
    int error = 0;     ///< errno; 0: none; ENOENT: there is no such file
    explicit operator bool() const { return error == 0; }
  };
  /// Reads a file, about 1 MiB of it at most; the rest is left out without an error. Does not wait for a pipe or a
  /// device.
  Reading read(const std::string& path) const;
  /// Returns the first line without blanks (space, tab, final '\r') at its ends; empty if the file is; nothing if
  /// read() has an error, even after some text.
  std::optional<std::string> line(const std::string& path) const;
  /// Returns the number that the first line consists of; nothing if it is not a number, or cannot be read.
  std::optional<double> number(const std::string& path) const;
  struct Listing {
    std::vector<std::string> names;  ///< sorted; those that came before an error, if there is one
    int error = 0;                   ///< errno; 0: none, and these are all
  };
  /// Returns the names in a directory.
  Listing list(const std::string& path) const;
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

  struct Answer {
    std::optional<traction::Status> status;  ///< empty: it could not be had
    std::string why;                         ///< why there is no status
  };
  /// Asks the daemon of an instance for its status, on this machine whatever the root is. Waits up to 3 s for the
  /// connection, and up to 3 s for the answer. Catches traction::Error, whose text is then `why`.
  virtual Answer status(const std::string& instance) const;

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
