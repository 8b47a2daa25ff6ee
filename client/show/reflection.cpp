#include "client/show/reflection.h"

#include "client/show/page.h"
#include "proto/traction/v1/descriptors.h"

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdio>
#include <stdexcept>
#include <type_traits>

namespace traction::client {

namespace {

namespace protobuf = google::protobuf;

/// Returns the descriptors that are part of the program.
class Schema {
 public:
  Schema() {
    v1::Metric::descriptor();  // registers the options, which would otherwise be unknown fields to the parser
    const std::string_view bytes = descriptors();
    protobuf::FileDescriptorSet files;
    if (!files.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) throw std::logic_error("descriptors");
    for (const protobuf::FileDescriptorProto& file : files.file()) pool_.BuildFile(file);
    status_ = pool_.FindMessageTypeByName("traction.v1.Status");
    if (status_ == nullptr) throw std::logic_error("no descriptor of the status");
  }
  const protobuf::Descriptor& status() const { return *status_; }
  const protobuf::EnumDescriptor& enumeration(const std::string& name) const { return *pool_.FindEnumTypeByName(name); }
  std::unique_ptr<Reflected> make() { return std::unique_ptr<Reflected>(factory_.GetPrototype(status_)->New()); }

 private:
  protobuf::DescriptorPool pool_;
  protobuf::DynamicMessageFactory factory_;
  const protobuf::Descriptor* status_ = nullptr;
};

Schema& schema() {
  static Schema schema;
  return schema;
}

bool isCounter(const std::string& metric) {
  const protobuf::FileOptions& options = statusDescriptor().file()->options();
  for (int i = 0; i < options.ExtensionSize(v1::family); ++i) {
    const v1::Family& family = options.GetExtension(v1::family, i);
    if (family.name() == metric) return family.kind() == v1::Family::KIND_COUNTER;
  }
  return false;
}

struct Ranked {
  int rank;
  TopNumber number;
};

// NOLINTBEGIN(misc-no-recursion): as deep as the messages of the schema
void collect(const Reflected& message, std::string_view row, std::vector<Ranked>& to) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (isMessage(field)) {
      forEachMessage(message, field, [&](const Reflected& part, int) { collect(part, row, to); });
      continue;
    }
    const v1::Top& top = field.options().GetExtension(v1::top);
    if (top.row() != row) continue;
    TopNumber number{top.word(), std::get<std::uint64_t>(scalarOf(message, field)), top.loss(),
                     isCounter(field.options().GetExtension(v1::metric).name())};
    if (number.word.empty()) {
      number.word = field.name();
      std::replace(number.word.begin(), number.word.end(), '_', ' ');
    }
    to.push_back({top.rank(), std::move(number)});
  }
}
// NOLINTEND(misc-no-recursion)

}  // namespace

std::unique_ptr<Reflected> reflected(const v1::Status& status) {
  auto message = schema().make();
  message->ParseFromString(status.SerializeAsString());
  return message;
}

const protobuf::Descriptor& statusDescriptor() {
  return schema().status();
}

Scalar scalarOf(const Reflected& message, const FieldDescriptor& field, int index) {
  const protobuf::Reflection& access = *message.GetReflection();
  const bool isOne = index < 0;
  switch (field.cpp_type()) {
  case FieldDescriptor::CPPTYPE_DOUBLE:
    return isOne ? access.GetDouble(message, &field) : access.GetRepeatedDouble(message, &field, index);
  case FieldDescriptor::CPPTYPE_FLOAT:
    return double{isOne ? access.GetFloat(message, &field) : access.GetRepeatedFloat(message, &field, index)};
  case FieldDescriptor::CPPTYPE_UINT64:
    return isOne ? access.GetUInt64(message, &field) : access.GetRepeatedUInt64(message, &field, index);
  case FieldDescriptor::CPPTYPE_UINT32:
    return std::uint64_t{isOne ? access.GetUInt32(message, &field) : access.GetRepeatedUInt32(message, &field, index)};
  case FieldDescriptor::CPPTYPE_INT64:
    return isOne ? access.GetInt64(message, &field) : access.GetRepeatedInt64(message, &field, index);
  case FieldDescriptor::CPPTYPE_INT32:
    return std::int64_t{isOne ? access.GetInt32(message, &field) : access.GetRepeatedInt32(message, &field, index)};
  case FieldDescriptor::CPPTYPE_BOOL:
    return isOne ? access.GetBool(message, &field) : access.GetRepeatedBool(message, &field, index);
  case FieldDescriptor::CPPTYPE_STRING:
    return isOne ? access.GetString(message, &field) : access.GetRepeatedString(message, &field, index);
  case FieldDescriptor::CPPTYPE_ENUM:
    return wordOf(*field.enum_type(),
                  isOne ? access.GetEnumValue(message, &field) : access.GetRepeatedEnumValue(message, &field, index));
  case FieldDescriptor::CPPTYPE_MESSAGE:
    break;
  }
  throw std::logic_error("a message has no scalar value");
}

std::string wordOf(const protobuf::EnumDescriptor& type, int value) {
  const protobuf::EnumValueDescriptor* known = type.FindValueByNumber(value);
  const std::string& name = (known != nullptr ? known : type.value(0))->name();
  // The names begin with the type's: CAMERA_STATE_ in CameraState.
  const auto words = std::count_if(type.name().begin() + 1, type.name().end(),
                                   [](unsigned char letter) { return std::isupper(letter) != 0; });
  std::string word = name.substr(type.name().size() + static_cast<std::size_t>(words) + 1);
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return word;
}

std::string wordOf(const std::string& type, int value) {
  return wordOf(schema().enumeration("traction.v1." + type), value);
}

bool isSet(const Reflected& message, const FieldDescriptor& field) {
  const protobuf::Reflection& access = *message.GetReflection();
  return field.is_repeated() ? access.FieldSize(message, &field) > 0 : access.HasField(message, &field);
}

bool isAbsent(const Reflected& message, const FieldDescriptor& field) {
  return field.options().GetExtension(v1::null_if_absent) && !message.GetReflection()->HasField(message, &field);
}

std::string formatted(double number, const std::string& pattern) {
  std::array<char, 400> text{};
  if (pattern.empty()) return {text.data(), std::to_chars(text.begin(), text.end(), number).ptr};
  std::snprintf(text.data(), text.size(), pattern.c_str(), number);
  return withoutNegativeZeros(text.data(), pattern.starts_with("%+"));
}

std::string textOf(const Scalar& value, const std::string& pattern, double factor) {
  return std::visit(
      [&](const auto& one) -> std::string {
        using One = std::decay_t<decltype(one)>;
        if constexpr (std::is_same_v<One, std::string>) {
          return one;
        } else if constexpr (std::is_same_v<One, double>) {
          return formatted(one * factor, pattern);
        } else {
          return std::to_string(one);
        }
      },
      value);
}

std::vector<TopNumber> topNumbers(const v1::Status& status, std::string_view row) {
  std::vector<Ranked> all;
  collect(*reflected(status), row, all);
  std::stable_sort(all.begin(), all.end(), [](const Ranked& a, const Ranked& b) { return a.rank < b.rank; });
  std::vector<TopNumber> numbers;
  numbers.reserve(all.size());
  for (Ranked& one : all) numbers.push_back(std::move(one.number));
  return numbers;
}

}  // namespace traction::client
