# Writes the ledger's counters, a C++ struct, from message Ledger of status.proto: a member for each of its fields, the sum
# of those that are causes of loss, their copy into the message, and a loop over them. traction_ledger(PROTO HEADER)
function(traction_ledger proto header)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${proto})
  file(READ ${proto} text)
  string(REGEX REPLACE "//[^\n]*" "" text "${text}")
  string(FIND "${text}" "message Ledger {" begin)
  string(SUBSTRING "${text}" ${begin} -1 text)
  string(FIND "${text}" "\n}" end)
  string(SUBSTRING "${text}" 0 ${end} fields)  # separated by semicolons: a list

  foreach(field IN LISTS fields)
    if(NOT field MATCHES "uint64 ([a-z_]+) = " OR CMAKE_MATCH_1 STREQUAL "in_flight")
      continue()  # what is in flight is the rest
    endif()
    set(name ${CMAKE_MATCH_1})
    set(member ${name})
    string(REGEX MATCHALL "_[a-z]" initials ${name})
    foreach(initial IN LISTS initials)
      string(TOUPPER ${initial} capital)
      string(REPLACE ${initial} ${capital} member ${member})
    endforeach()
    string(REPLACE "_" "" member ${member})
    string(APPEND members "  Counter ${member};\n")
    string(APPEND copies "    message.set_${name}(${member}.get());\n")
    string(APPEND uses "    use(\"${name}\", ${member}.get());\n")
    if(field MATCHES "frames_lost_total")
      string(APPEND losses " + ${member}.get()")
      string(APPEND copiedLosses " + message.${name}()")
    endif()
  endforeach()

  file(CONFIGURE OUTPUT ${header} @ONLY CONTENT [[
// Written from proto/traction/v1/status.proto by cmake/ledger.cmake.
#pragma once

#include "base/counter.h"

namespace tractiond {

/// The fields of message Ledger.
struct LedgerCounters {
@members@
  /// Returns the number of frames that were received and lost, over all causes.
  std::uint64_t losses() const { return 0@losses@; }

  /// Copies all counters into a traction::v1::Ledger. Returns the sum of published and lost frames as copied.
  template <typename Message>
  std::uint64_t copyTo(Message& message) const {
@copies@    return message.published()@copiedLosses@;
  }

  /// Calls use(name, number) for each counter, by the name of its field.
  template <typename Use>
  void each(Use use) const {
@uses@  }
};

}  // namespace tractiond
]])
endfunction()
