// Strategy. A chunk's number is a feature that leads, by pValue, to a register at an address within a port, and the
// port names the chunk. What is computed on the way is mostly a scale: its formula is tried at three numbers, once.
// What is no scale (offsets, bit masks) is left out and named: it would have to be evaluated for every frame.
#include "daemon/capture/chunk_description.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

namespace tractiond::capture {
namespace {

struct Known {
  const char* feature;
  ChunkField::Meaning meaning;
};
constexpr std::array<Known, 6> kKnown{{{"ChunkExposureTime", ChunkField::Meaning::kExposure_us},
                                       {"ChunkGain", ChunkField::Meaning::kGain},
                                       {"ChunkTimestamp", ChunkField::Meaning::kTimestamp_ns},
                                       {"ChunkFrameID", ChunkField::Meaning::kFrameId},
                                       {"ChunkFrameCounter", ChunkField::Meaning::kFrameId},
                                       {"ChunkLineStatusAll", ChunkField::Meaning::kLines}}};

ArvGcNode* nodeOf(ArvGc* description, const std::string& name) {
  return name.empty() ? nullptr : arv_gc_get_node(description, name.c_str());
}

/// The names that a formula uses, and what they stand for.
std::vector<std::pair<std::string, std::string>> variablesOf(ArvGcNode* node) {
  std::vector<std::pair<std::string, std::string>> variables;
  for (ArvDomNode* child = arv_dom_node_get_first_child(ARV_DOM_NODE(node)); child != nullptr;
       child = arv_dom_node_get_next_sibling(child)) {
    if (g_strcmp0(arv_dom_node_get_node_name(child), "pVariable") != 0) continue;
    ArvDomNode* content = arv_dom_node_get_first_child(child);
    if (content == nullptr) continue;
    variables.emplace_back(text(arv_dom_element_get_attribute(ARV_DOM_ELEMENT(child), "Name")),
                           text(arv_dom_node_get_node_value(content)));
  }
  return variables;
}

/// What the formula makes of 1, if it makes of every number that many times as much. `given` are the other variables.
std::optional<double> scaleOf(const std::string& formula, const std::string& variable,
                              const std::vector<std::pair<std::string, double>>& given) {
  const Ref<ArvEvaluator> evaluator(arv_evaluator_new(formula.c_str()));
  for (const auto& [name, value] : given) arv_evaluator_set_double_variable(evaluator.get(), name.c_str(), value);
  std::array<double, 3> at{};
  for (std::size_t i = 0; i < at.size(); ++i) {
    Failure failure;
    // Large: integer division must not hide a scale below 1.
    arv_evaluator_set_double_variable(evaluator.get(), variable.c_str(), static_cast<double>(i) * 1e6);
    at[i] = arv_evaluator_evaluate_as_double(evaluator.get(), failure.into());
    if (failure) return {};
  }
  const bool isScale = at[0] == 0 && at[1] != 0 && std::abs(at[2] - 2 * at[1]) <= 1e-9 * std::abs(at[2]);
  return isScale ? std::optional(at[1] * 1e-6) : std::nullopt;
}

/// One step from a feature towards its register.
struct Step {
  ArvGcNode* to = nullptr;
  double scale = 1.0;
};
std::optional<Step> follow(ArvGc* description, ArvGcNode* node) {
  const std::string from = elementText(node, "FormulaFrom"), knife = elementText(node, "Formula");
  const auto variables = variablesOf(node);
  if (from.empty() && knife.empty()) return Step{nodeOf(description, elementText(node, "pValue"))};
  if (from.empty() && variables.size() != 1) return {};
  std::vector<std::pair<std::string, double>> given;
  for (const auto& [name, feature] : variables) {
    if (from.empty()) break;
    ArvGcNode* other = nodeOf(description, feature);
    Failure failure;
    if (other != nullptr && ARV_IS_GC_INTEGER(other))
      given.emplace_back(name, static_cast<double>(arv_gc_integer_get_value(ARV_GC_INTEGER(other), failure.into())));
    else if (other != nullptr && ARV_IS_GC_FLOAT(other))
      given.emplace_back(name, arv_gc_float_get_value(ARV_GC_FLOAT(other), failure.into()));
    else
      return {};
    if (failure) return {};
  }
  const auto scale = from.empty() ? scaleOf(knife, variables[0].first, {}) : scaleOf(from, "TO", given);
  if (!scale) return {};
  return Step{nodeOf(description, from.empty() ? variables[0].second : elementText(node, "pValue")), *scale};
}

/// None: it is computed, or not described.
std::optional<ChunkField> fieldOf(ArvGc* description, const Known& known) {
  ArvGcNode* node = nodeOf(description, known.feature);
  double scale = 1.0;
  for (int depth = 0; node != nullptr && !ARV_IS_GC_REGISTER_NODE(node) && depth < 8; ++depth) {
    const auto step = follow(description, node);
    if (!step) return {};
    node = step->to;
    scale *= step->scale;
  }
  if (node == nullptr || !ARV_IS_GC_REGISTER_NODE(node)) return {};
  const std::string kind = text(arv_dom_node_get_node_name(ARV_DOM_NODE(node)));
  if (kind != "IntReg" && kind != "FloatReg") return {};
  ArvGcNode* port = nodeOf(description, elementText(node, "pPort"));
  const std::string chunk = port == nullptr ? "" : elementText(port, "ChunkID");
  const std::string address = elementText(node, "Address"), length = elementText(node, "Length");
  if (chunk.empty() || address.empty() || length.empty() || !elementText(node, "pAddress").empty() ||
      !elementText(node, "pIndex").empty())
    return {};
  ChunkField field;
  field.meaning = known.meaning;
  field.perUnit = scale;
  field.chunk = std::strtoull(chunk.c_str(), nullptr, 16);
  field.offset = std::strtoull(address.c_str(), nullptr, 0);
  field.length = std::strtoull(length.c_str(), nullptr, 0);
  field.isFloat = kind == "FloatReg";
  field.isSigned = elementText(node, "Sign") == "Signed";
  field.bigEndian = elementText(node, "Endianess") == "BigEndian";  // as the standard spells it
  const bool sound = field.isFloat ? field.length == 4 || field.length == 8 : field.length >= 1 && field.length <= 8;
  return sound ? std::optional(field) : std::nullopt;
}

}  // namespace

ChunkDescription describeChunks(ArvDevice* device) {
  ChunkDescription all;
  ArvGc* description = arv_device_get_genicam(device);
  for (const Known& known : kKnown) {
    if (arv_device_get_feature(device, known.feature) == nullptr) continue;
    auto field = fieldOf(description, known);
    if (!field) {
      all.unread.emplace_back(known.feature);
      continue;
    }
    if (known.meaning == ChunkField::Meaning::kTimestamp_ns) {
      const auto ticks_Hz = std::strtod(readFeature(device, "GevTimestampTickFrequency").c_str(), nullptr);
      if (ticks_Hz > 0) field->perUnit *= 1e9 / ticks_Hz;
    }
    all.fields.push_back(*field);
    all.names.emplace_back(known.feature);
  }
  return all;
}

}  // namespace tractiond::capture
