// Makes the messages of contacts of the messages of fields.
#pragma once

#include "base/clock.h"
#include "touch/contact_tracker.h"
#include "touch/critical_point_tracker.h"
#include "traction/description.h"
#include "traction/messages.h"
#include "traction/v1/contacts.pb.h"
#include "traction/v1/field.pb.h"

#include <cstdint>
#include <string_view>
#include <vector>

namespace traction::contacts {

/// Follows the contacts of one sensor. Thread-bound.
class Follower {
 public:
  struct Options {
    Id run{};                                                    ///< of the messages
    std::int64_t (*monotonicClock)() = tractiond::monotonicNow;  ///< [ns], of Header::sent_ns
    std::int64_t (*realClock)() = tractiond::realNow;            ///< [ns], of messages without a field
  };
  explicit Follower(const Options& options)
      : options_(options) {}

  /// Takes where the nodes are, without which there are no critical points.
  void describe(const Description& description);
  /// Returns the nodes of a field; null: they are not known, or on a body.
  const Grid* nodesOf(const Field& field) const;

  // The messages that these return are valid until the next call.

  /// Returns the contacts of a field.
  /// \param field with Header::arrived_ns
  /// \param bytes of its message, of which the header is copied
  const v1::Contacts& take(const Field& field, std::string_view bytes);

  /// Returns whether contacts have begun and not ended.
  bool hasContacts() const { return hasContacts_; }
  /// Returns the contacts of the last message, as they were before they were encoded. They are valid until the next
  /// call of one of the functions below. A field must have been taken.
  const std::vector<touch::Contact>& contacts() const { return *contacts_; }
  /// Returns the time of the last message [ns], on the clock of fields.
  std::int64_t time_ns() const { return time_ns_; }
  /// Returns when the last field arrived [ns]; 0: none did.
  std::int64_t arrived_ns() const { return arrived_ns_; }
  /// Returns the time without a field after which it is late [ns], so that wait() is to be called: some intervals
  /// between fields, and short enough for clients, which end contacts after a second without a message.
  std::int64_t silence_ns() const;
  /// Returns the contacts where no field has come since: unknown, and ended after ContactTracker::patience_s(). A field
  /// must have been taken.
  /// \param now_ns on the clock of Header::arrived_ns
  const v1::Contacts& wait(std::int64_t now_ns);
  /// Returns the ends of all contacts. A field must have been taken.
  const v1::Contacts& endAll();

 private:
  const v1::Contacts& fill(const std::vector<touch::Contact>& contacts, const std::vector<touch::CriticalPoint>& points,
                           bool valid, std::int64_t real_ns);

  Options options_;
  touch::ContactTracker tracker_;
  touch::CriticalPointTracker pointTracker_;
  Grid nodes_;  ///< of fields with this calibration; none of a body
  Id calibration_{};
  touch::Field observed_;  ///< of the last field
  v1::Field field_;        ///< the last field
  v1::Contacts message_;
  const std::vector<touch::Contact>* contacts_ = nullptr;  ///< of the tracker
  std::int64_t arrived_ns_ = 0;
  std::int64_t time_ns_ = 0;
  std::uint64_t sequence_ = 0;
  bool hasContacts_ = false;
};

}  // namespace traction::contacts
