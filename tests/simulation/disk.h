// Simulates a disk that can be slow, full or failing, and that can lose its power between any two of its operations.
// disk.cpp defines the daemon's calls to files by it.
#pragma once

#include "tests/simulation/world.h"

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tractiond::simulation {

/// What a program does takes effect at once for the program itself, and is timed: a loss of power at some moment leaves
/// what had been done until then. Of that, what was synchronised is kept; of each file's other content a part, chosen
/// by chance, and of the other changes of names the first ones.
class Disk {
 public:
  static constexpr std::int64_t kCall_ns = 20'000;
  struct Condition {
    std::int64_t sync_ns = 2 * kMs;   ///< that fsync takes
    std::int64_t open_ns = kCall_ns;  ///< that it takes to open a file for reading
    bool isFull = false;
    bool failsToSync = false;
  };
  /// Returns the condition of the disk at a time, which may be later than now(), for work that goes on. Empty: it is
  /// well.
  std::function<Condition(std::int64_t at_ns)> condition;

  /// Between these two, calls take the time of a thread of its own, not the caller's. endWork() returns the time at
  /// which the work is done.
  void beginWork(std::int64_t begin_ns = now());
  std::int64_t endWork();
  /// Returns how far the work has come.
  std::int64_t workUntil_ns() const { return work_ns_; }
  /// Returns how long calls outside of such work have taken in all.
  std::int64_t waitedFor() const { return waited_ns_; }

  /// Set the content to what is left after the processes have been killed, or the power was lost, at `now_ns`.
  void kill(std::int64_t now_ns);
  void losePower(std::int64_t now_ns, Chance& chance);

  /// Writes a file at once, and synchronises it.
  void put(const std::string& path, const std::string& content);
  /// Returns the content of a file if the power was lost now and all was lost that can be.
  std::optional<std::string> synchronised(const std::string& path) const;

  // The calls, see base/files.h.
  int open(const std::string& path, int flags);
  long read(int file, void* bytes, std::size_t count);
  long write(int file, const void* bytes, std::size_t count);
  int fsync(int file);
  int close(int file);
  int rename(const std::string& from, const std::string& to);
  int unlink(const std::string& path);

 private:
  enum class Kind { kName, kUnname, kRename, kAppend, kSync, kSyncNames };
  struct Operation {
    Kind kind;
    int node = 0;
    std::string path = {}, other = {}, bytes = {};
    std::int64_t at_ns = 0;
  };
  struct State {
    std::map<std::string, int> names, safeNames;
    std::map<int, std::string> content, safeContent;
    std::vector<Operation> unsafe;  ///< changes of names

    void apply(const Operation& operation);
    static void applyName(std::map<std::string, int>& names, const Operation& operation);
  };
  struct OpenFile {
    int node;
    std::size_t at = 0;
  };

  Condition is() const;
  std::int64_t spend(std::int64_t cost_ns);
  int record(Operation operation, std::int64_t cost_ns);
  State until(std::int64_t now_ns) const;

  State before_, now_;
  std::vector<Operation> recent_;  ///< that lead from one to the other
  std::map<int, OpenFile> files_;
  int nextNode_ = 1, nextFile_ = 1000;
  bool working_ = false;
  std::int64_t work_ns_ = 0, waited_ns_ = 0;
};

/// Returns the pointer to the disk that the daemon's files are on, which may be set. The disk must outlive the daemon.
Disk*& disk();

}  // namespace tractiond::simulation
