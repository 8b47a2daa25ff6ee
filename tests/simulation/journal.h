// Records what happened in a run, and which law was broken.
#pragma once

#include "daemon/records/marker_field.h"
#include "tests/simulation/account.h"
#include "tests/simulation/world.h"

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>

namespace tractiond::simulation {

struct Broken {
  std::string law;
  std::string what;
  std::int64_t at_ms = 0;
};

struct Result {
  std::optional<Broken> broken;
  std::string log;  ///< a line for each thing that happened
  Account account;
  std::uint64_t zerosAsked = 0, zerosTaken = 0, undone = 0, restarts = 0;
  std::uint64_t answers = 0;  ///< to requests for a zero or a step
  std::int64_t reached_ms = 0;
};

class Journal {
 public:
  /// Starts the record of a run that begins at now().
  Journal();

  std::int64_t begin_ns() const { return begin_ns_; }
  std::int64_t now_ms() const { return (now() - begin_ns_) / kMs; }

  void say(const std::string& line);
  /// Throws Broken with these texts unless `holds`.
  void law(bool holds, const char* name, const std::string& what) const;
  /// The same, for a law that is checked for each frame: `what` returns the text.
  template <std::invocable What>
  void law(bool holds, const char* name, const What& what) const {
    if (!holds) law(false, name, std::string(what()));
  }

  Result result;

 private:
  std::int64_t begin_ns_;
};

/// Returns the first digits of an id.
std::string nameOf(const Id& id);

}  // namespace tractiond::simulation
