#include "client/show/metrics.h"

#include "base/printable.h"
#include "client/show/health.h"
#include "client/show/json.h"
#include "client/show/reflection.h"
#include "traction/error.h"

#include <google/protobuf/descriptor.pb.h>

#include <array>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>

namespace traction::client {
namespace {

const std::string kExact = "%.17g";

std::string escaped(const std::string& text) {
  std::string result;
  for (const char letter : printable(text)) {
    if (letter == '\\' || letter == '"') result += '\\';
    result += letter;
  }
  return result;
}

std::string headOf(const std::string& name, std::string_view kind, const std::string& help) {
  return "# HELP traction_" + name + " " + help + "\n# TYPE traction_" + name + " " + std::string(kind) + "\n";
}

/// The samples of one instance, by metric.
class Samples {
 public:
  explicit Samples(std::string instance)
      : instance_(std::move(instance)) {}

  void add(const std::string& metric, const std::string& labels, const std::string& number, const char* suffix = "") {
    text_[metric] += "traction_" + metric + suffix + "{instance=\"" + instance_ + "\"" + labels + "} " + number + "\n";
  }

  // NOLINTBEGIN(misc-no-recursion): as deep as the messages of the schema
  /// Adds the samples of a message's fields.
  /// \param index in its array; -1: it is in none
  void add(const Reflected& message, int index = -1) {
    for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
      const FieldDescriptor& field = *message.GetDescriptor()->field(i);
      const v1::Metric& metric = field.options().GetExtension(v1::metric);
      const bool isSummed = index >= 0 && metric.labels().empty();
      if (!metric.name().empty() && !isSummed) add(message, field, metric, index);
      if (!isMessage(field)) continue;
      forEachMessage(message, field, [&](const Reflected& part, int at) { add(part, at); });
      if (field.is_repeated()) addSums(message, field);
    }
  }
  // NOLINTEND(misc-no-recursion)

  const std::string& of(const std::string& metric) { return text_[metric]; }

 private:
  void add(const Reflected& message, const FieldDescriptor& field, const v1::Metric& metric, int index) {
    if (!metric.part().empty()) {
      const Reflected& whole = message.GetReflection()->GetMessage(message, &field);
      const FieldDescriptor& part = *whole.GetDescriptor()->FindFieldByName(metric.part());
      addHistogram(metric.name(), labelsOf(message, field, metric, index),
                   whole.GetReflection()->GetMessage(whole, &part));
      return;
    }
    if ((field.has_optional_keyword() || metric.unknown_if_zero()) && !isSet(message, field)) return;
    const Scalar value = scalarOf(message, field);
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_ENUM)
      return add(metric.name(), labelsOf(message, field, metric, index), textOf(value, kExact));
    for (int i = 0; i < field.enum_type()->value_count(); ++i) {
      const std::string word = wordOf(*field.enum_type(), field.enum_type()->value(i)->number());
      add(metric.name(), labelsOf(message, field, metric, index, word),
          word == std::get<std::string>(value) ? "1" : "0");
    }
  }

  /// Adds the sums over an array's elements of the fields that have a metric without labels.
  void addSums(const Reflected& message, const FieldDescriptor& array) {
    for (int i = 0; i < array.message_type()->field_count(); ++i) {
      const FieldDescriptor& field = *array.message_type()->field(i);
      const v1::Metric& metric = field.options().GetExtension(v1::metric);
      if (metric.name().empty() || !metric.labels().empty()) continue;
      std::uint64_t sum = 0;
      forEachMessage(message, array, [&](const Reflected& one, int) { sum += isSet(one, field) ? 1 : 0; });
      add(metric.name(), "", std::to_string(sum));
    }
  }

  void addHistogram(const std::string& metric, const std::string& labels, const Reflected& from) {
    v1::Histogram histogram;
    histogram.ParseFromString(from.SerializeAsString());
    std::uint64_t below = 0;
    for (int i = 0; i < histogram.count_size(); ++i) {
      below += histogram.count(i);
      const std::string bound = i < histogram.bound_s_size() ? formatted(histogram.bound_s(i), "%.6g") : "+Inf";
      std::string all = labels;
      add(metric, all.append(",le=\"").append(bound).append("\""), std::to_string(below), "_bucket");
    }
    if (histogram.count().empty()) return;
    add(metric, labels, formatted(histogram.sum_s(), kExact), "_sum");
    add(metric, labels, std::to_string(below), "_count");
  }

  /// Returns the labels as they are printed.
  /// \param word of the enum's value that this sample is of
  static std::string labelsOf(const Reflected& message, const FieldDescriptor& field, const v1::Metric& metric,
                              int index, const std::string& word = "") {
    const auto valueOf = [&](const std::string& rule) -> std::string {
      if (rule == "@") return field.name();
      if (rule == "#") return std::to_string(index);
      if (rule == "*") return word;
      if (rule.front() != '{') return rule;
      const std::string name = rule.substr(1, rule.size() - 2);
      return std::get<std::string>(scalarOf(message, *message.GetDescriptor()->FindFieldByName(name)));
    };
    std::string text;
    std::istringstream rules(metric.labels());
    for (std::string rule; std::getline(rules, rule, ',');) {
      const std::size_t equals = rule.find('=');
      text += "," + rule.substr(0, equals) + "=\"" + escaped(valueOf(rule.substr(equals + 1))) + "\"";
    }
    return text;
  }

  std::string instance_;
  std::map<std::string, std::string> text_;
};

}  // namespace

std::string metricsText(const std::vector<Measured>& all) {
  std::vector<Samples> samples;
  for (const Measured& one : all) {
    Samples& of = samples.emplace_back(one.instance);
    of.add("up", "", one.status ? "1" : "0");
    if (!one.status) continue;
    const Header& header = one.status->header;
    of.add("info", ",sensor=\"" + escaped(header.sensor) + "\",boot=\"" + toHex(header.boot) + "\"", "1");
    const Health health = healthOf(problems(*one.status->message));
    for (const Health each : {Health::kMeasuring, Health::kDoubtful, Health::kNoForces, Health::kNoFields})
      of.add("health", std::string(",state=\"") + nameOf(each) + "\"", each == health ? "1" : "0");
    of.add(*reflected(*one.status->message));
  }
  std::string text;
  const auto family = [&](const std::string& name, const char* kind, const std::string& help) {
    std::string lines;
    for (Samples& one : samples) lines += one.of(name);
    if (!lines.empty()) text += headOf(name, kind, help) + lines;
  };
  family("up", "gauge", "1 where the daemon answers");
  family("info", "gauge", "What runs: always 1");
  family("health", "gauge", "1 for how well it measures, by its status");
  const google::protobuf::FileOptions& options = statusDescriptor().file()->options();
  for (int i = 0; i < options.ExtensionSize(v1::family); ++i) {
    constexpr std::array kKinds = {"untyped", "gauge", "counter", "histogram"};
    const v1::Family& one = options.GetExtension(v1::family, i);
    family(one.name(), kKinds.at(static_cast<std::size_t>(one.kind())), one.help());
  }
  return text;
}

}  // namespace traction::client
