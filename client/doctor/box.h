// The box that is looked at: its files below a root, and the few things that are no files. Tests make boxes of their
// own.
#pragma once

#include "traction/status.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace traction::doctor {

/// Thread-compatible. Paths are those that the box itself has: "/proc/net/route".
class Box {
 public:
  explicit Box(std::filesystem::path root = "/")
      : root_(std::move(root)) {}
  virtual ~Box() = default;
  Box(const Box&) = delete;
  Box& operator=(const Box&) = delete;

  struct Reading {
    std::string text;
    int error = 0;  ///< errno; ENOENT: there is no such file
    explicit operator bool() const { return error == 0; }
  };
  /// At most 1 MiB.
  Reading read(const std::string& path) const;
  /// The first line, without blanks at its ends; none: it cannot be read.
  std::optional<std::string> line(const std::string& path) const;
  std::optional<double> number(const std::string& path) const;
  /// Names in a directory, sorted; none where it cannot be read.
  std::vector<std::string> list(const std::string& path) const;
  /// Where a symbolic link points to.
  std::string target(const std::string& path) const;
  bool exists(const std::string& path) const { return look(path).error == 0; }

  struct Look {
    int error = 0;                                ///< errno; 0: the rest is known
    std::uint32_t user = 0, group = 0, mode = 0;  ///< mode: permissions alone
  };
  virtual Look look(const std::string& path) const;

  struct Space {
    bool readOnly = false;
    std::uint64_t free_bytes = 0;
  };
  /// Of the file system that it is on; none: not known.
  virtual std::optional<Space> space(const std::string& path) const;

  struct Ran {
    int exitCode = 0;
    std::string output, complaint;  ///< standard output and error
  };
  /// A program and its arguments; none: it is not there, or takes longer than 10 s.
  virtual std::optional<Ran> run(const std::vector<std::string>& words) const;

  struct Answer {
    std::optional<traction::Status> status;
    std::string why;  ///< there is no status
  };
  /// Asks the daemon of an instance for its status.
  virtual Answer status(const std::string& instance) const;

  /// The kernel says that somebody keeps the time of day; none: it does not say.
  virtual std::optional<bool> keepsTime() const;

 private:
  std::filesystem::path at(const std::string& path) const { return root_ / path.substr(path.find_first_not_of('/')); }

  std::filesystem::path root_;
};

/// A process of the box.
struct Process {
  int id = 0;
  std::string name;                ///< at most 15 letters
  std::vector<std::string> words;  ///< of its command line
};
std::vector<Process> processesOf(const Box& box);

/// Between blanks.
std::vector<std::string> wordsOf(const std::string& line);
std::vector<std::string> linesOf(const std::string& text);

}  // namespace traction::doctor
