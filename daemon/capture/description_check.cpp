// Strategy. Aravis follows references without a bound and takes memory without asking: what would make it do so
// forever, or take too much, is looked for before it evaluates anything. It parses what it can of a file that was cut
// short, so libxml2 reads the text once more and says whether it is whole.
#include "daemon/capture/description_check.h"

#include <libxml/SAX2.h>
#include <libxml/parser.h>

#include <algorithm>
#include <cstdlib>
#include <unordered_map>

namespace tractiond::capture {
namespace {

/// Tables for shading correction are some hundred kilobytes.
constexpr long long kLargestRegister_bytes = 16 << 20;

/// Adds each feature node below a node. Groups are feature nodes in Aravis, but have no value.
void collect(ArvDomNode* node, std::vector<ArvGcNode*>& nodes) {
  for (ArvDomNode* child = arv_dom_node_get_first_child(node); child != nullptr;
       child = arv_dom_node_get_next_sibling(child)) {
    if (ARV_IS_GC_FEATURE_NODE(child) && !ARV_IS_GC_GROUP_NODE(child)) nodes.push_back(ARV_GC_NODE(child));
    collect(child, nodes);
  }
}

std::vector<std::string> elementTextsOf(ArvDomNode* node, std::initializer_list<const char*> names) {
  std::vector<std::string> texts;
  for (ArvDomNode* child = arv_dom_node_get_first_child(node); child != nullptr;
       child = arv_dom_node_get_next_sibling(child)) {
    const char* name = arv_dom_node_get_node_name(child);
    if (std::none_of(names.begin(), names.end(), [&](const char* one) { return g_strcmp0(name, one) == 0; })) continue;
    ArvDomNode* content = arv_dom_node_get_first_child(child);
    if (content != nullptr) texts.push_back(text(arv_dom_node_get_node_value(content)));
  }
  return texts;
}

constexpr std::initializer_list<const char*> kReferences{"pValue",        "pVariable",  "pAddress",
                                                         "pIndex",        "pLength",    "pValueIndexed",
                                                         "pValueDefault", "pValueCopy", "pCommandValue"};

/// Adds the names of the nodes that a node's value is made of, those of nodes inside it among them: a register may hold
/// the formula of its address.
void addReferences(ArvDomNode* node, std::vector<std::string>& references) {
  const std::vector<std::string> own = elementTextsOf(node, kReferences);
  references.insert(references.end(), own.begin(), own.end());
  for (ArvDomNode* child = arv_dom_node_get_first_child(node); child != nullptr;
       child = arv_dom_node_get_next_sibling(child))
    if (ARV_IS_GC_FEATURE_NODE(child)) addReferences(child, references);
}

/// Returns where references of values lead back to where they came from, lead too far, or multiply; empty: nowhere.
/// Depth first, without recursion: a chain may be as long as the file.
std::string circleIn(const std::unordered_map<std::string, std::vector<std::string>>& madeOf) {
  constexpr std::size_t kDeepest = 200, kMostEvaluations = 100'000;
  enum class State { kNew, kOpen, kDone };
  std::unordered_map<std::string, State> states;
  std::unordered_map<std::string, std::size_t> evaluations;  // for one value, of all that it is made of
  for (const auto& entry : madeOf) {
    std::vector<std::pair<std::string, std::size_t>> path{{entry.first, 0}};
    if (states[entry.first] != State::kNew) continue;
    states[entry.first] = State::kOpen;
    while (!path.empty()) {
      auto& [name, next] = path.back();
      const std::vector<std::string>& parts = madeOf.at(name);
      if (next == parts.size()) {
        std::size_t& count = evaluations[name] = 1;
        for (const std::string& part : parts) {
          const auto known = evaluations.find(part);
          count = std::min(count + (known == evaluations.end() ? 1 : known->second), kMostEvaluations);
        }
        if (count == kMostEvaluations) return "the camera's description takes too long to evaluate at " + name;
        states[name] = State::kDone;
        path.pop_back();
        continue;
      }
      const std::string part = parts[next++];
      if (madeOf.count(part) == 0) continue;
      if (states[part] == State::kOpen) return "the camera's description goes in a circle at " + part;
      if (path.size() > kDeepest) return "the camera's description is nested too deeply at " + part;
      if (states[part] == State::kNew) {
        states[part] = State::kOpen;
        path.emplace_back(part, 0);
      }
    }
  }
  return {};
}

/// Returns the first register that claims more than any camera has; empty: there is none.
std::string claimIn(ArvGc* description) {
  std::string claim;
  for (ArvGcNode* const node : nodesOf(description)) {
    const std::string length = elementText(node, "Length");
    const long long bytes = std::strtoll(length.c_str(), nullptr, 0);
    if (bytes < 0 || bytes > kLargestRegister_bytes)
      claim =
          "register " + text(arv_gc_feature_node_get_name(ARV_GC_FEATURE_NODE(node))) + " claims " + length + " bytes";
  }
  return claim.empty() ? claim : "the camera's description is impossible: " + claim;
}

/// The same of registers whose length the camera tells. The references have been checked.
std::string claimOf(ArvGc* description) {
  std::string claim;
  for (ArvGcNode* const node : nodesOf(description)) {
    if (!ARV_IS_GC_REGISTER(node) || elementText(node, "pLength").empty()) continue;
    Failure failure;
    const guint64 bytes = arv_gc_register_get_length(ARV_GC_REGISTER(node), failure.into());
    if (failure || bytes <= static_cast<guint64>(kLargestRegister_bytes)) continue;
    claim = "register " + text(arv_gc_feature_node_get_name(ARV_GC_FEATURE_NODE(node))) + " has " +
            std::to_string(bytes) + " bytes";
  }
  return claim.empty() ? claim : "the camera cannot be believed: " + claim;
}

}  // namespace

std::vector<ArvGcNode*> nodesOf(ArvGc* description) {
  std::vector<ArvGcNode*> nodes;
  ArvDomElement* root = arv_dom_document_get_document_element(ARV_DOM_DOCUMENT(description));
  if (root != nullptr) collect(ARV_DOM_NODE(root), nodes);
  return nodes;
}

std::vector<std::string> elementTexts(ArvGcNode* node, std::initializer_list<const char*> names) {
  return elementTextsOf(ARV_DOM_NODE(node), names);
}

std::string faultOfText(std::string_view xml) {
  const std::size_t end =
      xml.find_last_not_of(std::string_view(" \t\r\n\0", 5));  // some cameras fill up their last page
  if (end == std::string_view::npos) return "the camera's description is empty";
  xmlSAXHandler handler{};
  handler.initialized = XML_SAX2_MAGIC;
  handler.serror = [](void* /*data*/, xmlErrorPtr /*error*/) {};  // it is said below
  if (xmlSAXUserParseMemory(&handler, nullptr, xml.data(), static_cast<int>(end + 1)) == 0) return {};
  const xmlError* const error = xmlGetLastError();
  std::string why = error == nullptr || error->message == nullptr ? "" : error->message;
  while (!why.empty() && std::isspace(static_cast<unsigned char>(why.back())) != 0) why.pop_back();
  return "the camera's description is cut short or damaged" +
         (error == nullptr ? "" : " at line " + std::to_string(error->line) + ": " + why);
}

std::string faultOf(ArvGc* description) {
  if (std::string claim = claimIn(description); !claim.empty()) return claim;
  std::unordered_map<std::string, std::vector<std::string>> madeOf;
  for (ArvGcNode* const node : nodesOf(description)) {
    // Where two nodes have one name, either may be meant.
    auto& references = madeOf[text(arv_gc_feature_node_get_name(ARV_GC_FEATURE_NODE(node)))];
    addReferences(ARV_DOM_NODE(node), references);
    // An entry of a structure is read at the structure's address.
    for (ArvDomNode* outer = arv_dom_node_get_parent_node(ARV_DOM_NODE(node));
         outer != nullptr && ARV_IS_GC_FEATURE_NODE(outer); outer = arv_dom_node_get_parent_node(outer)) {
      const std::vector<std::string> more = elementTextsOf(outer, kReferences);
      references.insert(references.end(), more.begin(), more.end());
    }
  }
  if (madeOf.empty()) return "the camera's description is empty";
  if (std::string circle = circleIn(madeOf); !circle.empty()) return circle;
  return claimOf(description);
}

}  // namespace tractiond::capture
