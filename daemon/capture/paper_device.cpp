// Strategy. A subclass of Aravis's device over a sparse map of bytes. Many makes ask inquiry registers whether a
// feature or an entry exists: those that are only read, and lead from pIsImplemented or pIsAvailable, are seeded with
// ones; those that give an upper limit, with a large number. Aravis parses what it can of a file that was cut short:
// the end of its root element shows that it is whole.
#include "daemon/capture/paper_device.h"

#include <algorithm>
#include <set>
#include <unordered_map>

namespace {

struct Paper {
  std::string xml;
  tractiond::capture::Ref<ArvGc> description;
  std::unordered_map<guint64, guint8> bytes;
};

struct PaperDevice {
  ArvDevice parent;
  Paper* paper;
};
struct PaperDeviceClass {
  ArvDeviceClass parent;
};

gpointer parentClass = nullptr;

Paper& paperOf(void* device) {
  return *static_cast<PaperDevice*>(device)->paper;
}

gboolean readMemory(ArvDevice* device, guint64 address, guint32 size, void* buffer, GError** /*error*/) {
  auto* to = static_cast<guint8*>(buffer);
  for (guint32 i = 0; i < size; ++i) {
    const auto found = paperOf(device).bytes.find(address + i);
    to[i] = found == paperOf(device).bytes.end() ? guint8{0} : found->second;
  }
  return TRUE;
}

gboolean writeMemory(ArvDevice* device, guint64 address, guint32 size, tractiond::aravis::WriteMemoryData buffer,
                     GError** /*error*/) {
  for (guint32 i = 0; i < size; ++i) paperOf(device).bytes[address + i] = static_cast<const guint8*>(buffer)[i];
  return TRUE;
}

gboolean readRegister(ArvDevice* device, guint64 address, guint32* value, GError** error) {
  guint32 raw = 0;
  readMemory(device, address, sizeof raw, &raw, error);
  *value = GUINT32_FROM_BE(raw);
  return TRUE;
}

gboolean writeRegister(ArvDevice* device, guint64 address, guint32 value, GError** error) {
  guint32 raw = GUINT32_TO_BE(value);
  return writeMemory(device, address, sizeof raw, &raw, error);
}

void begin(GTypeInstance* instance, gpointer /*type*/) {
  // NOLINTNEXTLINE(cppcoreguidelines-owning-memory): GLib constructs and ends the object
  reinterpret_cast<PaperDevice*>(instance)->paper = new Paper;
}

void finish(GObject* object) {
  delete reinterpret_cast<PaperDevice*>(object)->paper;  // NOLINT(cppcoreguidelines-owning-memory)
  G_OBJECT_CLASS(parentClass)->finalize(object);
}

void beginClass(gpointer given, gpointer /*data*/) {
  auto* type = static_cast<PaperDeviceClass*>(given);
  parentClass = g_type_class_peek_parent(given);
  G_OBJECT_CLASS(type)->finalize = finish;
  type->parent.create_stream = [](ArvDevice*, ArvStreamCallback, void*, GDestroyNotify, GError** error) -> ArvStream* {
    g_set_error(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NO_STREAM_CHANNEL, "there is no camera");
    return nullptr;
  };
  type->parent.get_genicam_xml = [](ArvDevice* device, std::size_t* size) -> const char* {
    *size = paperOf(device).xml.size();
    return paperOf(device).xml.c_str();
  };
  type->parent.get_genicam = [](ArvDevice* device) { return paperOf(device).description.get(); };
  type->parent.read_memory = readMemory;
  type->parent.write_memory = writeMemory;
  type->parent.read_register = readRegister;
  type->parent.write_register = writeRegister;
}

GType paperType() {
  static const GType type =
      g_type_register_static_simple(ARV_TYPE_DEVICE, "TractionPaperDevice", sizeof(PaperDeviceClass), beginClass,
                                    sizeof(PaperDevice), begin, GTypeFlags{});
  return type;
}

}  // namespace

namespace tractiond::capture {
namespace {

/// Adds each feature node below a node. Groups are feature nodes in Aravis, but have no value.
void collect(ArvDomNode* node, std::vector<ArvGcNode*>& nodes) {
  for (ArvDomNode* child = arv_dom_node_get_first_child(node); child != nullptr;
       child = arv_dom_node_get_next_sibling(child)) {
    if (ARV_IS_GC_FEATURE_NODE(child) && !ARV_IS_GC_GROUP_NODE(child)) nodes.push_back(ARV_GC_NODE(child));
    collect(child, nodes);
  }
}

/// The registers that a node's value is read from.
void registersBelow(ArvGc* description, const std::string& name, std::set<std::string>& seen,
                    std::vector<ArvGcNode*>& registers) {
  if (!seen.insert(name).second) return;
  ArvGcNode* node = arv_gc_get_node(description, name.c_str());
  if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node)) return;
  if (ARV_IS_GC_REGISTER_NODE(node)) {
    registers.push_back(node);
    return;
  }
  for (const std::string& next : elementTexts(node, {"pValue", "pVariable"}))
    registersBelow(description, next, seen, registers);
}

void seed(ArvDevice* device, ArvGcNode* node, std::initializer_list<const char*> by, bool ability) {
  ArvGc* description = arv_device_get_genicam(device);
  for (const std::string& name : elementTexts(node, by)) {
    std::set<std::string> seen;
    std::vector<ArvGcNode*> registers;
    registersBelow(description, name, seen, registers);
    for (ArvGcNode* one : registers) {
      if (elementText(one, "AccessMode") != "RO") continue;
      Failure failure;
      const guint64 address = arv_gc_register_get_address(ARV_GC_REGISTER(one), failure.into());
      const guint64 length = failure ? 0 : arv_gc_register_get_length(ARV_GC_REGISTER(one), failure.into());
      if (failure || length == 0 || length > 8) continue;
      const bool big = elementText(one, "Endianess") == "BigEndian";
      auto& bytes = paperOf(device).bytes;
      for (guint64 i = 0; i < length; ++i) {
        if (ability)
          bytes[address + i] = 0xff;
        else if (bytes.count(address + i) == 0)  // 4096
          bytes[address + i] = (big ? length - 1 - i : i) == 1 ? 0x10 : 0x00;
      }
    }
  }
}

}  // namespace

std::vector<ArvGcNode*> nodesOf(ArvGc* description) {
  std::vector<ArvGcNode*> nodes;
  ArvDomElement* root = arv_dom_document_get_document_element(ARV_DOM_DOCUMENT(description));
  if (root != nullptr) collect(ARV_DOM_NODE(root), nodes);
  return nodes;
}

Ref<ArvDevice> makePaperDevice(const std::string& xml, Failure& failure) {
  auto* object = static_cast<PaperDevice*>(g_object_new(paperType(), nullptr));
  Ref<ArvDevice> device(reinterpret_cast<ArvDevice*>(object));
  const auto refused = [&](const std::string& why) {
    g_set_error(failure.into(), ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_GENICAM_NOT_FOUND, "%s", why.c_str());
    return Ref<ArvDevice>();
  };
  if (xml.find("</RegisterDescription>") == std::string::npos)
    return refused("the camera's description is cut short or damaged");
  object->paper->xml = xml;
  object->paper->description.reset(arv_gc_new(device.get(), object->paper->xml.c_str(), object->paper->xml.size()));
  if (!object->paper->description) return refused("it is no GenICam description");
  const auto nodes = nodesOf(object->paper->description.get());
  if (nodes.empty()) return refused("the camera's description is empty");
  for (ArvGcNode* const node : nodes) seed(device.get(), node, {"pIsImplemented", "pIsAvailable"}, true);
  for (ArvGcNode* const node : nodes) seed(device.get(), node, {"pMax"}, false);
  return device;
}

}  // namespace tractiond::capture
