// Makes the messages of grasps of the messages of fields.
#pragma once

#include "base/clock.h"
#include "client/touch/hand_file.h"
#include "touch/hand.h"
#include "traction/messages.h"
#include "traction/v1/grasp.pb.h"

#include <cstddef>
#include <cstdint>

namespace traction::contacts {

/// Joins the fields of a hand's fingers. Thread-bound.
class Grasper {
 public:
  struct Options {
    Id boot{};                                                   ///< of the messages
    std::int64_t (*monotonicClock)() = tractiond::monotonicNow;  ///< [ns], of Header::sent_ns, and that of fields
    std::int64_t (*realClock)() = tractiond::realNow;            ///< [ns], of messages without fields
  };

  Grasper(const HandFile& hand, const Options& options);

  // The messages that these return are valid until the next call.

  /// Takes a field of a finger. Returns the grasp, if it is complete with this field; else null.
  /// \param field with Header::arrived_ns
  const v1::Grasp* take(std::size_t finger, const Field& field);
  /// Returns what is known of the fingers, none of whose fields were captured together for a while.
  const v1::Grasp& wait();
  /// Returns the time without a grasp after which wait() is to be called [ns].
  std::int64_t silence_ns() const { return hand_.silence_ns(); }

 private:
  const v1::Grasp& fill(const touch::Grasp& grasp);
  void fillHeader(const touch::Grasp& grasp);

  Options options_;
  touch::Hand hand_;
  v1::Grasp message_;
  std::uint64_t sequence_ = 0;
};

}  // namespace traction::contacts
