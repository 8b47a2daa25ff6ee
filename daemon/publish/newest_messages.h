// Interface of the publisher through which its newest messages are read.
#pragma once

#include <string>

namespace tractiond::publish {

/// Both functions are thread-safe.
class NewestMessages {
 public:
  /// Returns the status that was sent last, as bytes of the message; rarely the one before it.
  virtual std::string lastStatus() const = 0;
  /// Returns the newest description, as bytes of the message, also if it has not been sent yet. Its header has the
  /// sequence 0 and names no frame, as these bytes are not part of the topic.
  virtual std::string lastDescription() const = 0;

 protected:
  ~NewestMessages() = default;
};

}  // namespace tractiond::publish
