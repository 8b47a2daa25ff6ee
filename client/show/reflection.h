// The status as Protobuf's reflection sees it, with the options of its fields (proto/traction/v1/options.proto).
#pragma once

#include "traction/v1/options.pb.h"
#include "traction/v1/status.pb.h"

#include <google/protobuf/message.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace traction::client {

using google::protobuf::FieldDescriptor;
using Reflected = google::protobuf::Message;

/// Returns a copy of the status that has a descriptor. Its pool is private to this file: the generated code is lite.
std::unique_ptr<Reflected> reflected(const v1::Status& status);

/// Returns the descriptor of traction.v1.Status, which lives as long as the program.
const google::protobuf::Descriptor& statusDescriptor();

/// Value of a field that is no message. Enums are words: "streaming" for CAMERA_STATE_STREAMING.
using Scalar = std::variant<double, std::uint64_t, std::int64_t, bool, std::string>;

/// Returns the value of a field that is no message; floats as double, 32-bit integers as 64-bit ones.
/// \param index of the element in an array, not checked; -1: the field is no array
/// \throws std::logic_error if the field is a message
Scalar scalarOf(const Reflected& message, const FieldDescriptor& field, int index = -1);

/// Returns the word of an enum's value; that of 0 if the value is not known, as from a later daemon.
std::string wordOf(const google::protobuf::EnumDescriptor& type, int value);
/// \param type name of an enum of the protocol: "Colour"; it must exist
std::string wordOf(const std::string& type, int value);

/// Returns whether a field, or each element of an array, is a message.
inline bool isMessage(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
}

/// Returns whether a field is not 0, false or empty; of an optional one or a message, whether it is present.
bool isSet(const Reflected& message, const FieldDescriptor& field);

/// Returns whether a field has the option null_if_absent and its message is absent; false for all other fields.
bool isAbsent(const Reflected& message, const FieldDescriptor& field);

/// Returns the number as printf does, without a negative zero.
/// \param pattern "%.2f", "%+.2f" or the like, not checked. Empty: the shortest text that reads back as the same number
std::string formatted(double number, const std::string& pattern);

/// Returns a value as text.
/// \param pattern of formatted() for a double, which is multiplied by `factor` before
std::string textOf(const Scalar& value, const std::string& pattern, double factor = 1.0);

// NOLINTBEGIN(misc-no-recursion): as deep as the messages of the schema
/// Calls visit(message, index) within the call: for a field that is an array of messages, for each element in order,
/// with its index from 0; for one that is a message, once with -1 unless isAbsent(). Requires isMessage(field).
template <typename Visit>
void forEachMessage(const Reflected& message, const FieldDescriptor& field, Visit&& visit) {
  const auto& access = *message.GetReflection();
  if (field.is_repeated()) {
    for (int i = 0; i < access.FieldSize(message, &field); ++i) visit(access.GetRepeatedMessage(message, &field, i), i);
  } else if (!isAbsent(message, field)) {
    visit(access.GetMessage(message, &field), -1);
  }
}
// NOLINTEND(misc-no-recursion)

/// One number of a row of `tractionctl top`.
struct TopNumber {
  std::string word;  ///< as it is shown
  std::uint64_t number = 0;
  v1::Top::Loss loss = v1::Top::LOSS_NONE;  ///< kind of loss that it counts
  bool isCounter = false;                   ///< true: only increases, so that a rate can be stated
};

/// Returns the numbers of a row, in the order in which they are shown.
/// \param row "frames" or "packets"; none for any other
std::vector<TopNumber> topNumbers(const v1::Status& status, std::string_view row);

}  // namespace traction::client
