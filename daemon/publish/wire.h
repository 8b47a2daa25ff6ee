// Encodes records as the messages of proto/traction/v1 that are published.
#pragma once

#include "daemon/publish/description.h"
#include "daemon/records/ledger.h"
#include "daemon/records/preview.h"
#include "daemon/records/traction_field.h"

#include <memory>

namespace google::protobuf {
class MessageLite;
}
namespace traction::v1 {
class Status;
}

namespace tractiond::publish {

/// Content of a message's header besides the identity.
struct Heading {
  std::uint64_t sequence = 0;  ///< number of the message within its topic, from 1; 0: not sent
  FrameInfo frame;
  std::uint32_t flags = 0;       ///< Flags
  Id zero{};                     ///< of the zero in force
  std::int64_t sent_ns = 0;      ///< CLOCK_MONOTONIC
  std::int64_t sentReal_ns = 0;  ///< CLOCK_REALTIME
};

/// Sets the fields of messages, one of each kind, in the same memory every time: nothing is allocated after the first
/// of a kind. Each fill function sets the whole message, and returns it, valid until its next call; its arguments need
/// not outlive the call. Header and timestamp of fields and markers are from `heading` alone: frame, flags and zero of
/// the record are not used. Each kind is for one thread.
class Wire {
 public:
  /// \param identity part of every message; copied
  explicit Wire(const Identity& identity);
  ~Wire();

  const google::protobuf::MessageLite& fill(const TractionField& field, const Heading& heading);
  const google::protobuf::MessageLite& fill(const MarkerField& markers, const Heading& heading);
  /// \param heading only its sequence and times of sending are used
  const google::protobuf::MessageLite& fill(const Preview& preview, const Heading& heading);
  /// Sets ledger, header and timestamp of status().
  const google::protobuf::MessageLite& fillStatus(const Ledger& ledger, const Heading& heading);
  /// Returns the status, for the caller to set everything except ledger and header before fillStatus(). It keeps its
  /// values from one status to the next, and lives as long as this.
  traction::v1::Status& status();

 private:
  struct Messages;
  std::unique_ptr<Messages> messages_;
};

}  // namespace tractiond::publish
