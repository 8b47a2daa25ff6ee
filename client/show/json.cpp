#include "client/show/json.h"

#include "base/json_writer.h"
#include "client/show/base64.h"
#include "client/show/reflection.h"
#include "client/show/scene.h"
#include "client/src/fields.h"

#include <array>
#include <type_traits>

namespace traction::client {

namespace {

// Write a value, of the kinds that fields() has. The last parameter tells by its type what the value is in the
// protocol.

template <typename Own, typename Wire>
void put(JsonWriter& json, const Own& value, const Wire& from);

void put(JsonWriter& json, const Id& id, const std::string&) {
  json.string(toHex(id));
}

void put(JsonWriter& json, const std::vector<std::uint8_t>& mask, const std::string&) {
  json.booleans(mask);
}

template <typename Own, typename Wire>
void put(JsonWriter& json, const std::vector<Own>& messages, const google::protobuf::RepeatedPtrField<Wire>&) {
  json.open('[');
  for (const Own& message : messages) put(json, message, Wire());
  json.close(']');
}

template <typename Own>
void put(JsonWriter& json, const std::optional<Own>& number, const std::optional<Own>&) {
  using Number = std::conditional_t<std::is_floating_point_v<Own>, double, Own>;
  number ? json.number(Number{*number}) : json.null();
}

template <typename Own, typename Wire>
void put(JsonWriter& json, const std::optional<Own>& message, const Wire*) {
  if (message)
    put(json, *message, Wire());
  else
    json.null();
}

template <typename Own, typename Wire>
void put(JsonWriter& json, const Given<Own>& value, const Wire& from) {
  if (value.isGiven)
    put(json, value.member, from);
  else
    json.null();
}

void put(JsonWriter& json, const Flags<const std::uint32_t>& flags, std::uint32_t) {
  json.open('[');
  for (std::uint32_t bit = 1; bit != 0; bit <<= 1U) {
    for (const FlagText& each : kFlagTexts) {
      if (each.flag == bit && (flags.member & bit) != 0) json.string(each.name);
    }
  }
  json.close(']');
}

void put(JsonWriter& json, const Contrast<const bool>& darker, bool) {
  json.string(darker.member ? "darker" : "brighter");
}

/// Returns what writes a member under its name.
auto member(JsonWriter& json) {
  return [&json](const char* name, const auto& value, const auto& from) {
    if (name == nullptr) return;
    json.key(name);
    put(json, value, from);
  };
}

template <typename Own, typename Wire>
void put(JsonWriter& json, const Own& value, const Wire& from) {
  if constexpr (std::is_base_of_v<google::protobuf::MessageLite, Wire>) {
    if constexpr (std::is_same_v<Wire, pb::Vector2> || std::is_same_v<Wire, pb::Vector3>) {
      json.numbers(value);
    } else {
      json.open('{');
      fields(value, from, member(json));
      json.close('}');
    }
  } else if constexpr (std::is_enum_v<Own>) {
    json.string(wordOf(std::get<WireEnum<Own>>(kEnums).name, static_cast<int>(value)));
  } else if constexpr (std::is_same_v<Own, std::string>) {
    json.string(value);
  } else if constexpr (std::is_same_v<Own, bool>) {
    json.boolean(value);
  } else if constexpr (std::is_arithmetic_v<Own>) {
    json.number(value);
  } else if constexpr (std::is_arithmetic_v<typename Own::value_type>) {
    json.numbers(value);
  } else {
    json.vectors(value);
  }
}

void putHeader(JsonWriter& json, const char* topic, const Header& header) {
  json.key("topic").string(topic);
  fields(header, pb::Header(), member(json));
  json.key("arrived_ns").number(header.arrived_ns);
}

/// Writes a message whose header and fields() are all that it has.
template <typename Wire>
void putMessage(JsonWriter& json, const char* topic, const auto& message) {
  putHeader(json, topic, message.header);
  fields(message, Wire(), member(json));
}

void put(JsonWriter& json, const Field& field) {
  putMessage<pb::Field>(json, "field", field);
}
void put(JsonWriter& json, const Markers& markers) {
  putMessage<pb::Markers>(json, "markers", markers);
}
void put(JsonWriter& json, const Contacts& contacts) {
  putMessage<pb::Contacts>(json, "contacts", contacts);
}
void put(JsonWriter& json, const Grasp& grasp) {
  putMessage<pb::Grasp>(json, "grasp", grasp);
}
void put(JsonWriter& json, const Description& description) {
  putMessage<pb::Description>(json, "description", description);
}

void put(JsonWriter& json, const Preview& preview) {
  putHeader(json, "preview", preview.header);
  json.key("width").number(preview.width);
  json.key("height").number(preview.height);
  json.key("format").string(preview.channels == 1 ? "mono8" : "rgb8");
  json.key("scale").number(preview.scale);
  json.key("origin_px").numbers(preview.origin_px);
  json.key("pixels").string(base64({reinterpret_cast<const char*>(preview.pixels.data()), preview.pixels.size()}));
}

/// Writes the fields of a message under their names, in the order of their declaration.
void putFields(JsonWriter& json, const Reflected& message);

void putScalar(JsonWriter& json, const Scalar& value) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    json.string(*text);
  } else if (const auto* boolean = std::get_if<bool>(&value)) {
    json.boolean(*boolean);
  } else if (const auto* number = std::get_if<double>(&value)) {
    json.number(*number);
  } else if (const auto* count = std::get_if<std::uint64_t>(&value)) {
    json.number(*count);
  } else {
    json.number(std::get<std::int64_t>(value));
  }
}

// NOLINTBEGIN(misc-no-recursion): as deep as the messages of the schema
void putField(JsonWriter& json, const Reflected& message, const FieldDescriptor& field) {
  json.key(field.name());
  if (field.is_repeated()) json.open('[');
  if (isMessage(field)) {
    if (isAbsent(message, field)) json.null();
    forEachMessage(message, field, [&](const Reflected& part, int) {
      json.open('{');
      putFields(json, part);
      json.close('}');
    });
  } else if (field.is_repeated()) {
    for (int i = 0; i < message.GetReflection()->FieldSize(message, &field); ++i)
      putScalar(json, scalarOf(message, field, i));
  } else if (field.has_optional_keyword() && !isSet(message, field)) {
    json.null();
  } else {
    putScalar(json, scalarOf(message, field));
  }
  if (field.is_repeated()) json.close(']');
}

void putFields(JsonWriter& json, const Reflected& message) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i)
    putField(json, message, *message.GetDescriptor()->field(i));
}
// NOLINTEND(misc-no-recursion)

void put(JsonWriter& json, const Status& status) {
  putHeader(json, "status", status.header);
  const auto message = reflected(*status.message);
  for (int i = 0; i < statusDescriptor().field_count(); ++i) {
    const FieldDescriptor& field = *statusDescriptor().field(i);
    if (field.name() != "timestamp" && field.name() != "header") putField(json, *message, field);
  }
}

const char* nameOf(CameraFeature::Access access) {
  constexpr std::array kNames = {"none", "read", "write", "read-write"};
  return kNames.at(static_cast<std::size_t>(access));
}

/// Returns false if the text is not such a number.
template <typename Number>
bool putNumber(JsonWriter& json, const std::string& text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return false;
  json.number(number);
  return true;
}

void putValue(JsonWriter& json, const char* key, const std::string& text, CameraFeature::Kind kind) {
  using Kind = CameraFeature::Kind;
  json.key(key);
  if (text.empty() && kind != Kind::kString) {
    json.null();
  } else if (kind == Kind::kBoolean && (text == "true" || text == "false")) {
    json.boolean(text == "true");
  } else if (!(kind == Kind::kInteger && putNumber<std::int64_t>(json, text)) &&
             !(kind == Kind::kFloat && putNumber<double>(json, text))) {
    json.string(text);
  }
}

void put(JsonWriter& json, const CameraFeature& feature) {
  json.open('{');
  json.key("name").string(feature.name);
  putValue(json, "value", feature.value, feature.kind);
  json.key("unit").string(feature.unit);
  json.key("kind").string(wordOf("CameraFeatureKind", static_cast<int>(feature.kind)));
  json.key("access").string(nameOf(feature.access));
  member(json)("minimum", feature.minimum, feature.minimum);
  member(json)("maximum", feature.maximum, feature.maximum);
  member(json)("increment", feature.increment, feature.increment);
  json.key("entries").strings(feature.entries);
  json.key("description").string(feature.description);
  putValue(json, "configured", feature.configured, feature.configured.empty() ? CameraFeature::Kind{} : feature.kind);
  putValue(json, "first", feature.first, feature.first.empty() ? CameraFeature::Kind{} : feature.kind);
  json.key("category").string(feature.category);
  json.key("selected").strings(feature.selected);
  json.close('}');
}

void put(JsonWriter& json, const CameraReport& report) {
  json.key("camera").string(report.camera);
  json.key("features").open('[');
  for (const CameraFeature& feature : report.features) put(json, feature);
  json.close(']');
  json.key("remarks").strings(report.remarks);
}

template <typename Any>
std::string object(const Any& any) {
  JsonWriter json;
  json.open('{');
  put(json, any);
  return json.close('}').take();
}

}  // namespace

std::string toHex(const Id& id) {
  std::string text;
  if (id == Id{}) return text;
  for (const auto byte : id) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

std::string toJson(const Message& message) {
  return std::visit([](const auto& any) { return object(any); }, message);
}

std::string toJson(const ZeroResult& result) {
  JsonWriter json;
  json.open('{');
  identityFields(result.zero, pb::Zero(), member(json));
  json.key("markers_present").number(result.markersPresent);
  json.key("markers_expected").number(result.markersExpected);
  json.key("noise_levels").number(result.noise_levels);
  json.key("remark").string(result.remark);
  return json.close('}').take();
}

std::string toJson(const CameraReport& report) {
  return object(report);
}

std::string toJson(const std::string& step, const CalibrationReport& report) {
  JsonWriter json;
  json.open('{');
  json.key("step").string(step);
  json.key("figures").open('{');
  for (const CalibrationReport::Figure& figure : report.figures) {
    json.key(figure.name.c_str()).open('{');
    json.key("value").number(figure.value);
    json.key("deviation").number(figure.deviation).close('}');
  }
  json.close('}');
  json.key("remarks").strings(report.remarks);
  json.key("path").string(report.path);
  return json.close('}').take();
}

}  // namespace traction::client
