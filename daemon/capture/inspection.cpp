#include "daemon/capture/inspection.h"

#include "daemon/capture/aravis.h"
#include "daemon/capture/gvcp_search.h"
#include "daemon/capture/paper_device.h"

#include <algorithm>
#include <iostream>

namespace tractiond::capture {
namespace {

/// Asks for everything that a feature can be asked for; what it answers does not matter.
void evaluate(ArvGcNode* node) {
  Failure failure;
  auto* feature = ARV_GC_FEATURE_NODE(node);
  arv_gc_feature_node_is_implemented(feature, failure.into());
  arv_gc_feature_node_is_available(feature, failure.into());
  arv_gc_feature_node_is_locked(feature, failure.into());
  arv_gc_feature_node_get_actual_access_mode(feature);
  arv_gc_feature_node_get_value_as_string(feature, failure.into());
  if (ARV_IS_GC_INTEGER(node)) {
    arv_gc_integer_get_min(ARV_GC_INTEGER(node), failure.into());
    arv_gc_integer_get_max(ARV_GC_INTEGER(node), failure.into());
    arv_gc_integer_get_inc(ARV_GC_INTEGER(node), failure.into());
  }
  if (ARV_IS_GC_FLOAT(node)) {
    arv_gc_float_get_min(ARV_GC_FLOAT(node), failure.into());
    arv_gc_float_get_max(ARV_GC_FLOAT(node), failure.into());
    arv_gc_float_get_inc(ARV_GC_FLOAT(node), failure.into());
  }
  if (ARV_IS_GC_ENUMERATION(node)) {
    guint count = 0;
    taken(arv_gc_enumeration_dup_available_string_values(ARV_GC_ENUMERATION(node), &count, failure.into()), count);
  }
  if (ARV_IS_GC_REGISTER(node)) {
    arv_gc_register_get_address(ARV_GC_REGISTER(node), failure.into());
    arv_gc_register_get_length(ARV_GC_REGISTER(node), failure.into());
  }
}

Inspection fault(const std::string& sentence) {
  return {.outcome = Inspection::Outcome::kFault, .text = sentence};
}

Inspection inspect(ArvDevice* device) {
  std::size_t size = 0;
  const char* const xml = arv_device_get_genicam_xml(device, &size);
  if (xml == nullptr) return fault("the camera has no description");
  Failure failure;
  const Ref<ArvDevice> paper = makePaperDevice(std::string(xml, size), failure);
  if (!paper) return fault(failure.text());
  for (ArvGcNode* const node : nodesOf(arv_device_get_genicam(paper.get()))) evaluate(node);
  return {.outcome = Inspection::Outcome::kHarmless, .text = hashOf({xml, size})};
}

/// Aravis says the same of a network camera that is not there and of one whose description it cannot read.
Inspection unopened(const std::string& id, const Failure& failure) {
  constexpr std::chrono::milliseconds kAnswer{300};
  const bool answers = failure.noDescription() || (isAddress(id) && !GvcpSearch().ask(id, kAnswer).empty());
  if (!answers) return {.outcome = Inspection::Outcome::kAbsent, .text = failure.text()};
  return {.outcome = Inspection::Outcome::kUnreadable,
          .text = "the camera answers, but its description cannot be read: " + failure.text() +
                  "; close a client that may hold it alone, power it off and on, or load its firmware again"};
}

Inspection inspect(const std::string& id) {
  Failure failure;
  const Ref<ArvDevice> device(arv_open_device(id.c_str(), failure.into()));
  return device ? inspect(device.get()) : unopened(id, failure);
}

}  // namespace

std::string hashOf(std::string_view xml) {
  char* digits =
      g_compute_checksum_for_data(G_CHECKSUM_SHA256, reinterpret_cast<const guchar*>(xml.data()), xml.size());
  std::string hash = text(digits);
  g_free(digits);
  return hash;
}

int printInspection(const std::string& id) {
  limitChild();
  // What Aravis and GLib say of a description that is none is said better, and once, by the result.
  g_log_set_default_handler([](auto...) {}, nullptr);
  const Inspection inspection = inspect(id);
  std::cout << inspection.text << std::flush;
  return static_cast<int>(inspection.outcome);
}

Inspection inspectInChild(const std::string& id, const ChildOptions& options, const std::stop_token& stop) {
  constexpr std::size_t kLongest = 500;
  const ChildEnd end = runChild({"--inspect", id}, options, stop);
  if (const std::string what = misdeed(end); !what.empty()) return fault("the camera's description " + what);
  std::string said = end.output.substr(0, kLongest);
  if (said.empty() || end.code > static_cast<int>(Inspection::Outcome::kAbsent))
    return fault("the camera's description makes what evaluates it talk nonsense");
  std::replace_if(
      said.begin(), said.end(), [](char c) { return g_ascii_isprint(c) == 0; }, '?');
  return {.outcome = static_cast<Inspection::Outcome>(end.code), .text = said};
}

}  // namespace tractiond::capture
