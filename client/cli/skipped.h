// Counts the messages of a recording that an export leaves out.
#pragma once

#include "client/src/sources.h"
#include "recording/reader.h"
#include "traction/subscriber.h"

#include <sysexits.h>

#include <cstdint>
#include <string>

namespace traction::client {

/// One bad message must not cost the others: they are exported, and the export fails afterwards with what was left out.
/// Thread-bound.
class Skipped {
 public:
  /// Counts a message that cannot be decoded.
  /// \param sequence of its record
  void add(const Error& error, std::uint32_t sequence) {
    if (count_++ != 0) return;
    first_ = "number " + std::to_string(sequence) + ": " + error.what();
    if (error.code() == ErrorCode::kVersion) exitCode_ = EX_PROTOCOL;
  }

  bool isEmpty() const { return count_ == 0; }  ///< Returns whether none was left out.
  /// Returns EX_PROTOCOL if the first is of another version, EX_DATAERR otherwise.
  int exitCode() const { return exitCode_; }
  /// Returns how many were left out, and why the first was, as text.
  std::string text() const {
    return (count_ == 1 ? "1 message was" : std::to_string(count_) + " messages were") + " left out, the first " +
           first_;
  }

 private:
  std::uint64_t count_ = 0;
  int exitCode_ = EX_DATAERR;
  std::string first_;
};

/// Returns what keeps an export from being all of a recording, as text; empty: nothing.
inline std::string troubleOf(const recording::Extent& extent, const Skipped& skipped, const Sources& sources) {
  std::string all;
  for (const std::string& each : {extent.trouble, skipped.isEmpty() ? "" : skipped.text(), sources.trouble()})
    all += (all.empty() || each.empty() ? "" : "; ") + each;
  return all;
}

}  // namespace traction::client
