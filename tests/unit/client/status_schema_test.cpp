// A field that is in the schema is printed: each one is changed alone, and what is printed must change.

#include "client/show/board.h"
#include "client/show/json.h"
#include "client/show/metrics.h"
#include "client/show/reflection.h"
#include "client/show/status_text.h"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

namespace traction::client::status_schema_test {
namespace {

constexpr unsigned kOther = 1'000'000;  // than all numbers of fill()

/// Sets a field that is no message to a value that the number says. Arrays get one element.
void set(Reflected& message, const FieldDescriptor& field, unsigned number) {
  const auto& access = *message.GetReflection();
  if (field.is_repeated()) {
    access.ClearField(&message, &field);
    for (unsigned k = 0; k < (field.name() == "count" ? 2U : 1U); ++k) {
      field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ? access.AddDouble(&message, &field, number)
                                                          : access.AddUInt64(&message, &field, number);
    }
    return;
  }
  switch (field.cpp_type()) {
  case FieldDescriptor::CPPTYPE_DOUBLE:
    return access.SetDouble(&message, &field, number);
  case FieldDescriptor::CPPTYPE_UINT64:
    return access.SetUInt64(&message, &field, number);
  case FieldDescriptor::CPPTYPE_UINT32:
    return access.SetUInt32(&message, &field, number);
  case FieldDescriptor::CPPTYPE_BOOL:
    return access.SetBool(&message, &field, number != kOther);
  case FieldDescriptor::CPPTYPE_ENUM:
    return access.SetEnumValue(&message, &field, number == kOther ? 2 : 1);
  case FieldDescriptor::CPPTYPE_STRING:
    return access.SetString(&message, &field, "text" + std::to_string(number));
  default:
    ADD_FAILURE() << field.full_name() << " has a type that no test fills";
  }
}

/// Sets every field of a message and of those in it, each to another number; arrays of messages get one element.
void fill(Reflected& message, unsigned& next) {
  const auto& access = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    ++next;
    if (field->full_name() == "traction.v1.Status.header") continue;
    if (isMessage(*field)) {
      fill(field->is_repeated() ? *access.AddMessage(&message, field) : *access.MutableMessage(&message, field), next);
    } else {
      set(message, *field, next);
    }
  }
}

struct Printed {
  std::string json, text, top, metrics;
};

struct Shown {
  bool json, text, top, metrics;
};

Printed print(const Reflected& message) {
  const auto generated = std::make_shared<v1::Status>();
  generated->ParseFromString(message.SerializeAsString());
  const Status status{{}, generated};
  Watched watched{"name", {}, {}, {}};
  watched.scene.setConnected(true, 1);
  watched.scene.add(status);
  return {toJson(status), statusText(status), boardText(watched, 1), metricsText({{"name", status}})};
}

/// Calls visit(path, message, field, whether an enclosing field is json_only) for each field that is no message.
using Visit = std::function<void(const std::string&, Reflected&, const FieldDescriptor&, bool)>;
void forEachField(Reflected& message, const std::string& path, bool isJsonOnly, const Visit& visit) {
  const auto& access = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    const std::string name = path + (path.empty() ? "" : ".") + field.name();
    const bool isOnly = isJsonOnly || field.options().GetExtension(v1::json_only);
    if (name == "header" || name == "timestamp") continue;  // of every message, and not part of the schema of this one
    if (!isMessage(field)) {
      visit(name, message, field, isOnly);
    } else if (field.is_repeated()) {
      forEachField(*access.MutableRepeatedMessage(&message, &field, 0), name, isOnly, visit);
    } else {
      forEachField(*access.MutableMessage(&message, &field), name, isOnly, visit);
    }
  }
}

/// Changes each field in turn, and records in which of the outputs it shows.
std::map<std::string, Shown> shownBy(Reflected& message) {
  std::map<std::string, Shown> all;
  const Printed before = print(message);
  forEachField(message, "", false, [&](const std::string& path, Reflected& in, const FieldDescriptor& field, bool) {
    const std::unique_ptr<Reflected> kept(in.New());
    kept->CopyFrom(in);
    set(in, field, kOther);
    const Printed after = print(message);
    in.CopyFrom(*kept);
    all[path] = {after.json != before.json, after.text != before.text, after.top != before.top,
                 after.metrics != before.metrics};
  });
  return all;
}

TEST(StatusSchema, EachFieldIsPrinted) {
  unsigned next = 100;
  const auto message = reflected(v1::Status{});
  fill(*message, next);
  const auto granted = shownBy(*message);
  // What was asked for is printed where the kernel did not grant it.
  v1::Status refusing;
  refusing.ParseFromString(message->SerializeAsString());
  refusing.mutable_scheduling()->mutable_threads(0)->set_priority(0);
  refusing.mutable_scheduling()->set_locked_bytes(0);
  const auto refused = shownBy(*reflected(refusing));

  forEachField(*message, "", false, [&](const auto& path, Reflected&, const FieldDescriptor& field, bool isJsonOnly) {
    const Shown& one = granted.at(path);
    const Shown& other = refused.at(path);
    EXPECT_TRUE(one.json) << path;
    EXPECT_EQ(one.text || one.top || other.text || other.top, !isJsonOnly)
        << path << (isJsonOnly ? " is marked json_only" : " is neither in the text nor in top");
    const google::protobuf::FieldOptions& options = field.options();
    EXPECT_TRUE(one.metrics || !options.HasExtension(v1::metric)) << path;
    EXPECT_TRUE(one.text || !options.HasExtension(v1::text)) << path;
    EXPECT_TRUE(one.top || !options.HasExtension(v1::top)) << path;
  });
  EXPECT_GT(granted.size(), 80U);
}

}  // namespace
}  // namespace traction::client::status_schema_test
