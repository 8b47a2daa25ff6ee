#include "daemon/capture/inspection.h"

#include "daemon/capture/aravis.h"
#include "daemon/capture/gvcp_search.h"
#include "daemon/capture/paper_device.h"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
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
  return {.outcome = Inspection::Outcome::kHarmless, .text = "harmless"};
}

/// Aravis says the same of a network camera that is not there and of one whose description it cannot read.
Inspection unopened(const std::string& id, const Failure& failure) {
  constexpr std::chrono::milliseconds kAnswer{300};
  const bool answers = failure.noDescription() || (isAddress(id) && answersSearch(id, kAnswer));
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

void limitChild() {
  constexpr rlim_t kMemory_bytes = rlim_t{1} << 30, kProcessor_s = 5;
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  const auto limit = [](__rlimit_resource what, rlim_t most) {
    rlimit now{};
    if (getrlimit(what, &now) != 0 || now.rlim_cur <= most) return;
    now.rlim_cur = now.rlim_max = most;
    setrlimit(what, &now);
  };
  limit(RLIMIT_AS, pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + kMemory_bytes);
  limit(RLIMIT_CPU, kProcessor_s);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
}

std::string misdeed(const ChildEnd& end) {
  using How = ChildEnd::How;
  switch (end.how) {
  case How::kExit:
    return {};
  case How::kSignal:
    if (end.code == SIGXCPU || end.code == SIGKILL) return "takes more time or memory than is allowed";
    return "crashes what evaluates it (signal " + std::to_string(end.code) + ")";
  case How::kLate:
    return "takes longer than is allowed";
  case How::kTooMuch:
    return "makes what evaluates it talk without end";
  case How::kStopped:
    return "was not evaluated to its end";
  case How::kNotStarted:
    break;
  }
  return std::string("cannot be evaluated: no process can be started: ") + std::strerror(end.code);
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
