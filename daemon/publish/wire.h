// Records -> bytes of the messages of proto/traction/v1 that are published.
#pragma once

#include "daemon/publish/description.h"
#include "daemon/records/ledger.h"
#include "daemon/records/preview.h"
#include "daemon/records/traction_field.h"

#include <memory>
#include <string>
#include <vector>

namespace traction::v1 {
class Description;
class Preview;
class Status;
}  // namespace traction::v1

namespace tractiond::publish {

/// What the header of a message says besides the identity.
struct Heading {
  std::uint64_t sequence = 0;
  FrameInfo frame;
  std::uint32_t flags = 0;
  Id zero{};
  std::int64_t sent_ns = 0;      ///< CLOCK_MONOTONIC
  std::int64_t sentReal_ns = 0;  ///< CLOCK_REALTIME
};

/// A description is encoded once and sent many times.
class DescriptionMessage {
 public:
  DescriptionMessage(const Description& description, const std::vector<std::string>& topics);
  ~DescriptionMessage();

  /// Fills the header anew; bytes of the message.
  std::size_t fill(const Heading& heading);
  /// What was filled last.
  void write(std::uint8_t* bytes) const;
  std::string bytes() const;

 private:
  std::unique_ptr<traction::v1::Description> message_;
};

/// A picture is encoded beside the publishing thread.
class PreviewMessage {
 public:
  explicit PreviewMessage(const Identity& identity);
  ~PreviewMessage();

  /// Of the heading the sequence and the time of sending count. \return bytes of the message, for write()
  std::size_t fill(const Preview& preview, const Heading& heading);
  void write(std::uint8_t* bytes) const;

 private:
  std::unique_ptr<traction::v1::Preview> message_;
};

/// Fills one message of each kind again and again in the same memory: after the first of a kind nothing is allocated.
/// Each returns the size in bytes and must be followed by its write.
class Wire {
 public:
  explicit Wire(const Identity& identity);
  ~Wire();

  std::size_t fill(const TractionField& field, const Heading& heading);
  std::size_t fill(const MarkerField& markers, const Heading& heading);
  std::size_t fillStatus(const Ledger& ledger, const Heading& heading);  ///< sets ledger and header
  /// Returns the status, of which everything but ledger and header is set outside, before fillStatus().
  traction::v1::Status& status();
  void writeField(std::uint8_t* bytes) const;
  void writeMarkers(std::uint8_t* bytes) const;
  void writeStatus(std::uint8_t* bytes) const;

 private:
  struct Messages;
  std::unique_ptr<Messages> messages_;
};

}  // namespace tractiond::publish
