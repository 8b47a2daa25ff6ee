#include "daemon/capture/description_check.h"

#include <algorithm>
#include <cstdlib>
#include <unordered_map>

namespace tractiond::capture {
namespace {

void walk(ArvDomNode* node, const std::function<void(ArvGcNode*)>& visit) {
  for (ArvDomNode* child = arv_dom_node_get_first_child(node); child != nullptr;
       child = arv_dom_node_get_next_sibling(child)) {
    if (ARV_IS_GC_FEATURE_NODE(child))
      visit(ARV_GC_NODE(child));
    else if (g_strcmp0(arv_dom_node_get_node_name(child), "Group") == 0)
      walk(child, visit);
  }
}

/// Tables for shading correction are some hundred kilobytes.
constexpr long long kLargestRegister_bytes = 16 << 20;

/// What a node's value is made of.
std::vector<std::string> ingredients(ArvGcNode* node) {
  return elementTexts(node, {"pValue", "pVariable", "pAddress", "pIndex", "pLength", "pValueIndexed", "pValueDefault"});
}

}  // namespace

void forEachNode(ArvGc* description, const std::function<void(ArvGcNode*)>& visit) {
  ArvDomElement* root = arv_dom_document_get_document_element(ARV_DOM_DOCUMENT(description));
  if (root != nullptr) walk(ARV_DOM_NODE(root), visit);
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

std::string faultOf(ArvGc* description) {
  std::unordered_map<std::string, std::vector<std::string>> madeOf;
  std::string claim;
  forEachNode(description, [&](ArvGcNode* node) {
    const std::string name = text(arv_gc_feature_node_get_name(ARV_GC_FEATURE_NODE(node)));
    madeOf[name] = ingredients(node);
    // Aravis takes the memory for it without a second thought.
    const std::string length = elementText(node, "Length");
    const long long bytes = std::strtoll(length.c_str(), nullptr, 0);
    if (bytes < 0 || bytes > kLargestRegister_bytes) claim = "register " + name + " claims " + length + " bytes";
  });
  if (!claim.empty()) return "the camera's description is impossible: " + claim;
  if (madeOf.empty()) return "the camera's description is empty or cut short";

  // Depth first, without recursion: a chain may be as long as the file.
  enum class State { kNew, kOpen, kDone };
  std::unordered_map<std::string, State> states;
  for (const auto& entry : madeOf) {
    std::vector<std::pair<std::string, std::size_t>> path{{entry.first, 0}};
    if (states[entry.first] != State::kNew) continue;
    states[entry.first] = State::kOpen;
    while (!path.empty()) {
      auto& [name, next] = path.back();
      const std::vector<std::string>& parts = madeOf[name];
      if (next == parts.size()) {
        states[name] = State::kDone;
        path.pop_back();
        continue;
      }
      const std::string part = parts[next++];
      if (madeOf.count(part) == 0) continue;
      if (states[part] == State::kOpen) return "the camera's description goes in a circle at " + part;
      if (path.size() > 200) return "the camera's description is nested too deeply at " + part;
      if (states[part] == State::kNew) {
        states[part] = State::kOpen;
        path.emplace_back(part, 0);
      }
    }
  }
  return {};
}

}  // namespace tractiond::capture
