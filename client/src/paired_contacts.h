// Gives each contact that begins its end, also where messages were lost, or traction-touch was killed.
#pragma once

#include "traction/messages.h"

namespace traction {

/// The contacts of one topic, as the messages that a subscriber has received leave them. Thread-bound.
class PairedContacts {
 public:
  /// Takes the next message, and changes it so that begins and ends pair: adds, first, the ends of those that have
  /// begun and are of another run or missing in it; lets one that has not begun begin where it is seen; leaves out
  /// others.
  void complete(Contacts& contacts);

  /// Returns a message with the ends of all that have begun; its header is that of the last message.
  Contacts endAll();

  /// Returns whether any has begun and not ended.
  bool areOpen() const { return !open_.contacts.empty(); }

 private:
  Contacts open_;  ///< the last message, with those that have not ended
};

}  // namespace traction
