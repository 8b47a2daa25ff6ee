// Encodes records as the messages of proto/traction/v1 that are published.
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

/// Content of a message's header besides the identity.
struct Heading {
  std::uint64_t sequence = 0;  ///< number of the message within its topic, from 1; 0: not sent
  FrameInfo frame;
  std::uint32_t flags = 0;       ///< Flags
  Id zero{};                     ///< of the zero in force
  std::int64_t sent_ns = 0;      ///< CLOCK_MONOTONIC
  std::int64_t sentReal_ns = 0;  ///< CLOCK_REALTIME
};

/// A description that is encoded once and sent many times. Thread-bound.
class DescriptionMessage {
 public:
  /// Encodes the description, except for the header that fill() sets; neither argument need outlive the call. \param
  /// topics names of all topics of the stream, which the message lists
  DescriptionMessage(const Description& description, const std::vector<std::string>& topics);
  ~DescriptionMessage();

  /// Sets the header; its zero is the description's, not the heading's. Returns the size of the message [bytes].
  std::size_t fill(const Heading& heading);
  /// Writes the message; `bytes` must have room for the size that fill() returned.
  void write(std::uint8_t* bytes) const;
  /// Returns the message as write() writes it; without fill(), with the identity alone in its header.
  std::string bytes() const;

 private:
  std::unique_ptr<traction::v1::Description> message_;
};

/// A preview message. Thread-bound, so that a preview can be encoded on another thread than the publishing one.
class PreviewMessage {
 public:
  /// \param identity part of every message; copied
  explicit PreviewMessage(const Identity& identity);
  ~PreviewMessage();

  /// Sets the whole message; neither argument need outlive the call. \param heading only its sequence and times of
  /// sending are used \return size [bytes]
  std::size_t fill(const Preview& preview, const Heading& heading);
  /// Writes the message; `bytes` must have room for the size that fill() returned.
  void write(std::uint8_t* bytes) const;

 private:
  std::unique_ptr<traction::v1::Preview> message_;
};

/// Encodes messages, one of each kind, in the same memory every time: nothing is allocated after the first of a kind.
/// Each fill function returns the size [bytes]; the write function of the same kind then writes as many, and `bytes`
/// must have room for them. Header and timestamp are from `heading` alone: frame, flags and zero of the record are not
/// used. Thread-bound.
class Wire {
 public:
  /// \param identity part of every message; copied
  explicit Wire(const Identity& identity);
  ~Wire();

  std::size_t fill(const TractionField& field, const Heading& heading);  ///< Sets the whole message of a field.
  std::size_t fill(const MarkerField& markers, const Heading& heading);  ///< Sets the whole message of markers.
  /// Sets ledger, header and timestamp of status(), which must not be changed before writeStatus().
  std::size_t fillStatus(const Ledger& ledger, const Heading& heading);
  /// Returns the status, for the caller to set everything except ledger and header before fillStatus(). It keeps its
  /// values from one status to the next, and lives as long as this.
  traction::v1::Status& status();
  void writeField(std::uint8_t* bytes) const;
  void writeMarkers(std::uint8_t* bytes) const;
  void writeStatus(std::uint8_t* bytes) const;

 private:
  struct Messages;
  std::unique_ptr<Messages> messages_;
};

}  // namespace tractiond::publish
