// Strategy. A chunk's number is a feature that leads, by pValue, to a register at an address within a port, and the
// port names the chunk. What is computed on the way (converters, bit masks) is left out and named: it would have to be
// evaluated for every frame.
#include "daemon/capture/chunk_description.h"

#include <array>
#include <cstdlib>
#include <optional>

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

/// None: it is computed, or not described.
std::optional<ChunkField> fieldOf(ArvGc* description, const Known& known) {
  ArvGcNode* node = nodeOf(description, known.feature);
  for (int depth = 0; node != nullptr && !ARV_IS_GC_REGISTER_NODE(node) && depth < 8; ++depth) {
    if (!elementText(node, "FormulaFrom").empty() || !elementText(node, "Formula").empty()) return {};
    node = nodeOf(description, elementText(node, "pValue"));
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
      if (ticks_Hz > 0) field->perUnit = 1e9 / ticks_Hz;
    }
    all.fields.push_back(*field);
    all.names.emplace_back(known.feature);
  }
  return all;
}

}  // namespace tractiond::capture
