// Strategy. A value is checked against the camera's own description before it is written, so that a refusal can say
// what would be allowed, and is read back afterwards. "No answer" is told apart from "no".
#include "base/clock.h"
#include "daemon/capture/aravis.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>

namespace tractiond::capture {

std::string Failure::text() const {
  return error_ == nullptr ? "unknown error" : capture::text(error_->message);
}

bool Failure::noAnswer() const {
  return error_ != nullptr && error_->domain == ARV_DEVICE_ERROR &&
         (error_->code == ARV_DEVICE_ERROR_TIMEOUT || error_->code == ARV_DEVICE_ERROR_NOT_CONNECTED ||
          error_->code == ARV_DEVICE_ERROR_TRANSFER_ERROR);
}

int Failure::exitCode() const {
  return noAnswer() ? EX_UNAVAILABLE : EX_CONFIG;
}

bool Failure::noDescription() const {
  return error_ != nullptr && error_->domain == ARV_DEVICE_ERROR && error_->code == ARV_DEVICE_ERROR_GENICAM_NOT_FOUND;
}

tl::unexpected<Error> failed(int exitCode, std::string what, std::string remedy) {
  return tl::unexpected(Error{exitCode, std::move(what), "", std::move(remedy)});
}

std::string text(const char* string) {
  if (string == nullptr) return {};
  const std::unique_ptr<char, decltype(&g_free)> valid(g_utf8_make_valid(string, -1), &g_free);
  return valid.get();
}

std::string number(double value) {
  return fmt::format("{:.10g}", value);
}

std::string joined(const std::vector<std::string>& items) {
  return fmt::format("{}", fmt::join(items, ", "));
}

std::vector<std::string> taken(const char** names, guint count) {
  std::vector<std::string> all;
  for (guint i = 0; names != nullptr && i < count; ++i) all.emplace_back(text(names[i]));
  g_free(names);
  return all;
}

void pauseUntil(std::int64_t until_ns, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  const auto left = std::chrono::nanoseconds(until_ns - monotonicNow());
  if (left.count() > 0) never.wait_for(lock, stop, left, [] { return false; });
}

bool hasFeature(ArvDevice* device, const char* name) {
  return arv_device_is_feature_available(device, name, nullptr) != FALSE;
}

std::vector<std::string> elementTexts(ArvGcNode* node, std::initializer_list<const char*> names) {
  std::vector<std::string> texts;
  for (ArvDomNode* child = arv_dom_node_get_first_child(ARV_DOM_NODE(node)); child != nullptr;
       child = arv_dom_node_get_next_sibling(child)) {
    const char* name = arv_dom_node_get_node_name(child);
    if (std::none_of(names.begin(), names.end(), [&](const char* one) { return g_strcmp0(name, one) == 0; })) continue;
    ArvDomNode* content = arv_dom_node_get_first_child(child);
    if (content != nullptr) texts.push_back(text(arv_dom_node_get_node_value(content)));
  }
  return texts;
}

std::string elementText(ArvGcNode* node, const char* element) {
  const std::vector<std::string> texts = elementTexts(node, {element});
  return texts.empty() ? "" : texts.front();
}

std::vector<std::string> offeredEntries(ArvDevice* device, const char* name) {
  guint count = 0;
  const char** entries = arv_device_dup_available_enumeration_feature_values_as_strings(device, name, &count, nullptr);
  return taken(entries, count);
}

std::string textOf(const Feature& feature) {
  struct {
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(std::int64_t value) const { return std::to_string(value); }
    std::string operator()(double value) const { return number(value); }
    std::string operator()(const std::string& value) const { return value; }
  } spell;
  return std::visit(spell, feature.value);
}

namespace {

using Done = tl::expected<std::string, Error>;

/// Returns a number whose text has nothing else.
template <class Number>
std::optional<Number> parsedAs(const std::string& text) {
  Number value{};
  const auto [behind, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && behind == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

tl::unexpected<Error> refuse(const Feature& feature, const std::string& why, const std::string& remedy = {}) {
  return failed(EX_CONFIG, "the camera refuses " + feature.name + " = " + textOf(feature) + ": " + why, remedy);
}

tl::unexpected<Error> refuse(const Feature& feature, const Failure& failure) {
  if (failure.noAnswer())
    return failed(EX_UNAVAILABLE, "the camera does not answer to " + feature.name + ": " + failure.text());
  return refuse(feature, failure.text());
}

Done readBack(const Feature& feature, const std::string& got, const Failure& failure) {
  if (failure) return refuse(feature, failure);
  if (got != textOf(feature)) return refuse(feature, "it still says " + got);
  return feature.name + " = " + got;
}

Done readBack(const Feature& feature, double asked, double got, const Failure& failure) {
  if (failure) return refuse(feature, failure);
  const bool rounded = std::abs(got - asked) > 1e-9 * std::abs(asked);
  return feature.name + " = " + number(got) + (rounded ? " (asked: " + number(asked) + ")" : "");
}

/// A command is done when its register no longer holds the value that started it (GenICam standard, ICommand::IsDone).
Done awaitCommand(ArvDevice* device, ArvGcNode* command, const Feature& feature) {
  constexpr std::int64_t kPatience_ns = 10'000'000'000;
  const std::string name = elementText(command, "pValue");
  ArvGcNode* value = name.empty() ? nullptr : arv_gc_get_node(arv_device_get_genicam(device), name.c_str());
  if (value == nullptr || !ARV_IS_GC_INTEGER(value)) return feature.name + " executed";
  const std::string started = elementText(command, "CommandValue");
  const std::int64_t until_ns = monotonicNow() + kPatience_ns;
  Failure failure;
  for (;;) {
    const gint64 now = arv_gc_integer_get_value(ARV_GC_INTEGER(value), failure.into());
    // Registers that can only be written cannot be asked; a camera that is loading may be silent for a while.
    if (failure && !failure.noAnswer()) break;
    if (!failure && (started.empty() || now != std::strtoll(started.c_str(), nullptr, 0))) break;
    if (monotonicNow() > until_ns)
      return failed(EX_UNAVAILABLE, "the camera has not finished " + feature.name + " within 10 s");
    pauseUntil(monotonicNow() + 5'000'000, {});
  }
  return feature.name + " executed";
}

Done writeCommand(ArvDevice* device, ArvGcNode* node, const Feature& feature) {
  if (textOf(feature) != "true") return refuse(feature, "it is a command", "write " + feature.name + " = true");
  Failure failure;
  arv_device_execute_command(device, feature.name.c_str(), failure.into());
  if (failure) return refuse(feature, failure);
  return awaitCommand(device, node, feature);
}

Done writeBoolean(ArvDevice* device, const Feature& feature) {
  const std::string value = textOf(feature);
  if (value != "true" && value != "false") return refuse(feature, "it is true or false");
  Failure failure;
  arv_device_set_boolean_feature_value(device, feature.name.c_str(), value == "true", failure.into());
  if (failure) return refuse(feature, failure);
  const bool got = arv_device_get_boolean_feature_value(device, feature.name.c_str(), failure.into()) != FALSE;
  return readBack(feature, got ? "true" : "false", failure);
}

Done writeText(ArvDevice* device, const Feature& feature) {
  Failure failure;
  arv_device_set_string_feature_value(device, feature.name.c_str(), textOf(feature).c_str(), failure.into());
  if (failure) return refuse(feature, failure);
  const std::string got = text(arv_device_get_string_feature_value(device, feature.name.c_str(), failure.into()));
  return readBack(feature, got, failure);
}

Done writeEnumeration(ArvDevice* device, const Feature& feature) {
  const std::vector<std::string> offered = offeredEntries(device, feature.name.c_str());
  if (std::find(offered.begin(), offered.end(), textOf(feature)) == offered.end())
    return refuse(feature, "it is one of " + joined(offered));
  return writeText(device, feature);
}

Done writeInteger(ArvDevice* device, const Feature& feature) {
  const auto value = parsedAs<std::int64_t>(textOf(feature));
  if (!value) return refuse(feature, "it is a whole number");
  const char* name = feature.name.c_str();
  Failure failure;
  gint64 low = 0, high = 0;
  arv_device_get_integer_feature_bounds(device, name, &low, &high, failure.into());
  if (!failure && (*value < low || *value > high))
    return refuse(feature, "it may be " + std::to_string(low) + " to " + std::to_string(high));
  arv_device_set_integer_feature_value(device, name, *value, failure.into());
  if (failure) {
    const gint64 step = arv_device_get_integer_feature_increment(device, name, nullptr);
    if (!failure.noAnswer() && step > 1)
      return refuse(feature, failure.text(), "it goes in steps of " + std::to_string(step));
    return refuse(feature, failure);
  }
  const gint64 got = arv_device_get_integer_feature_value(device, name, failure.into());
  return readBack(feature, static_cast<double>(*value), static_cast<double>(got), failure);
}

Done writeFloat(ArvDevice* device, const Feature& feature) {
  const double* exact = std::get_if<double>(&feature.value);  // its text is rounded
  const auto value = exact != nullptr ? *exact : parsedAs<double>(textOf(feature));
  if (!value || !std::isfinite(*value)) return refuse(feature, "it is a number");
  const char* name = feature.name.c_str();
  Failure failure;
  double low = 0, high = 0;
  arv_device_get_float_feature_bounds(device, name, &low, &high, failure.into());
  if (!failure && (*value < low || *value > high))
    return refuse(feature, "it may be " + number(low) + " to " + number(high));
  arv_device_set_float_feature_value(device, name, *value, failure.into());
  if (failure) return refuse(feature, failure);
  const double got = arv_device_get_float_feature_value(device, name, failure.into());
  return readBack(feature, *value, got, failure);
}

}  // namespace

tl::expected<std::string, Error> writeFeature(ArvDevice* device, const Feature& feature) {
  const char* name = feature.name.c_str();
  ArvGcNode* node = arv_device_get_feature(device, name);
  if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node))
    return failed(EX_CONFIG, "the camera has no feature " + feature.name, "see what \"arv-tool-0.8 features\" lists");
  constexpr const char* kOrder = "the order of the features may matter";
  Failure failure;
  const bool available = arv_gc_feature_node_is_available(ARV_GC_FEATURE_NODE(node), failure.into());
  if (failure.noAnswer()) return refuse(feature, failure);
  if (!available) return refuse(feature, "it is not available", kOrder);
  if (arv_gc_feature_node_is_locked(ARV_GC_FEATURE_NODE(node), nullptr)) return refuse(feature, "it is locked", kOrder);
  if (arv_device_get_feature_access_mode(device, name) == ARV_GC_ACCESS_MODE_RO)
    return refuse(feature, "it can only be read");
  // The order matters: an enumeration is an integer and a text as well.
  if (ARV_IS_GC_COMMAND(node)) return writeCommand(device, node, feature);
  if (ARV_IS_GC_BOOLEAN(node)) return writeBoolean(device, feature);
  if (ARV_IS_GC_ENUMERATION(node)) return writeEnumeration(device, feature);
  if (ARV_IS_GC_INTEGER(node)) return writeInteger(device, feature);
  if (ARV_IS_GC_FLOAT(node)) return writeFloat(device, feature);
  if (ARV_IS_GC_STRING(node)) return writeText(device, feature);
  return refuse(feature, "a feature of this kind cannot be written");
}

std::optional<Feature> standingAt(ArvDevice* device, const char* name) {
  ArvGcNode* node = arv_device_get_feature(device, name);
  if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node) || ARV_IS_GC_COMMAND(node) || !hasFeature(device, name) ||
      arv_device_get_feature_access_mode(device, name) == ARV_GC_ACCESS_MODE_RO)
    return {};
  Failure failure;
  Feature feature{name, {}};
  if (ARV_IS_GC_BOOLEAN(node))
    feature.value = arv_device_get_boolean_feature_value(device, name, failure.into()) != FALSE;
  else if (ARV_IS_GC_ENUMERATION(node) || ARV_IS_GC_STRING(node))
    feature.value = text(arv_device_get_string_feature_value(device, name, failure.into()));
  else if (ARV_IS_GC_INTEGER(node))
    feature.value = std::int64_t{arv_device_get_integer_feature_value(device, name, failure.into())};
  else if (ARV_IS_GC_FLOAT(node))
    feature.value = arv_device_get_float_feature_value(device, name, failure.into());
  else
    return {};
  return failure ? std::nullopt : std::optional(feature);
}

std::string firstFeature(ArvDevice* device, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (hasFeature(device, name)) return name;
  return {};
}

Quantity exposureOf(ArvDevice* device) {
  Quantity exposure{.feature = firstFeature(device, {"ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw"})};
  ArvGcNode* node = exposure.feature.empty() ? nullptr : arv_device_get_feature(device, exposure.feature.c_str());
  std::string unit = node == nullptr ? "" : elementText(node, "Unit");
  if (unit == "ms") exposure.perUnit = 1e-3;
  if (unit == "s") exposure.perUnit = 1e-6;
  if (unit == "ns") exposure.perUnit = 1e3;
  return exposure;
}

Quantity gainOf(ArvDevice* device) {
  return {.feature = firstFeature(device, {"Gain", "GainRaw", "GainAbs"})};
}

std::optional<double> readQuantity(ArvDevice* device, const Quantity& quantity) {
  if (quantity.feature.empty()) return {};
  const char* name = quantity.feature.c_str();
  Failure failure;
  const bool whole = ARV_IS_GC_INTEGER(arv_device_get_feature(device, name));
  const double value = whole ? static_cast<double>(arv_device_get_integer_feature_value(device, name, failure.into()))
                             : arv_device_get_float_feature_value(device, name, failure.into());
  return failure ? std::optional<double>() : value / quantity.perUnit;
}

std::string readFeature(ArvDevice* device, const std::string& name) {
  ArvGcNode* node = arv_device_get_feature(device, name.c_str());
  Failure failure;
  if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node) ||
      !arv_gc_feature_node_is_available(ARV_GC_FEATURE_NODE(node), failure.into()))
    return {};
  if (ARV_IS_GC_ENUMERATION(node)) {
    const std::string entry = text(arv_gc_enumeration_get_string_value(ARV_GC_ENUMERATION(node), failure.into()));
    return failure ? "" : entry;
  }
  const std::string value = text(arv_gc_feature_node_get_value_as_string(ARV_GC_FEATURE_NODE(node), failure.into()));
  return failure ? "" : value;
}

}  // namespace tractiond::capture
