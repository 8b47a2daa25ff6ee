#include "daemon/capture/camera_plan.h"

#include "daemon/capture/aravis.h"
#include "daemon/capture/chunk_description.h"
#include "daemon/capture/paper_device.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

namespace tractiond::capture {
namespace {

std::string orNone(std::string feature) {
  return feature.empty() ? "none" : feature;
}

struct Entry {
  std::string name;
  std::int64_t value = 0;
};

/// All that the file names, whether or not a camera whose registers hold zeros offers them.
std::vector<Entry> entriesOf(ArvDevice* device, const char* name) {
  std::vector<Entry> entries;
  ArvGcNode* node = arv_device_get_feature(device, name);
  if (node == nullptr || !ARV_IS_GC_ENUMERATION(node)) return entries;
  for (const GSList* one = arv_gc_enumeration_get_entries(ARV_GC_ENUMERATION(node)); one != nullptr; one = one->next) {
    Failure failure;
    const gint64 value = arv_gc_enum_entry_get_value(ARV_GC_ENUM_ENTRY(one->data), failure.into());
    if (!failure) entries.push_back({text(arv_gc_feature_node_get_name(ARV_GC_FEATURE_NODE(one->data))), value});
  }
  return entries;
}

/// Lets the device stand at a pixel format, as any camera does at one of its own.
void standAt(ArvDevice* device, const PixelFormatTraits& format) {
  ArvGcNode* node = arv_device_get_feature(device, "PixelFormat");
  ArvGcNode* behind = arv_gc_get_node(arv_device_get_genicam(device), elementText(node, "pValue").c_str());
  if (behind != nullptr && ARV_IS_GC_INTEGER(behind))
    arv_gc_integer_set_value(ARV_GC_INTEGER(behind), format.code(), nullptr);
}

/// Fills in the names of the camera and of its features, and notes on what is missing.
void planFeatures(ArvDevice* device, CameraPlan& plan) {
  ArvDomElement* root = arv_dom_document_get_document_element(ARV_DOM_DOCUMENT(arv_device_get_genicam(device)));
  if (root != nullptr && ARV_IS_GC_REGISTER_DESCRIPTION_NODE(root)) {
    auto* description = ARV_GC_REGISTER_DESCRIPTION_NODE(root);
    plan.vendor = text(arv_gc_register_description_node_get_vendor_name(description));
    plan.model = text(arv_gc_register_description_node_get_model_name(description));
  }
  plan.rate = orNone(firstFeature(device, {"AcquisitionFrameRate", "AcquisitionFrameRateAbs", "FPS"}));
  plan.exposure = orNone(exposureOf(device).feature);
  plan.gain = orNone(gainOf(device).feature);
  std::vector<std::string> triggers;
  for (const Entry& one : entriesOf(device, "TriggerSource")) triggers.push_back(one.name);
  plan.trigger = orNone(joined(triggers));
  plan.clock = orNone(firstFeature(device, {"PtpEnable", "GevIEEE1588", "PtpMode"}));
  plan.link = orNone(firstFeature(device, {"DeviceLinkThroughputLimit", "GevSCPD"}));
  const ChunkDescription chunks = describeChunks(device);
  plan.chunks = orNone(joined(chunks.names));
  for (const std::string& unread : chunks.unread) plan.notes.push_back(unread + " is computed: it is left out");
  if (!hasFeature(device, "TLParamsLocked")) plan.notes.emplace_back("it has no TLParamsLocked");
}

/// Fills in the pixel formats that can be read, best first, and lets the device stand at the first. Returns why there
/// is none.
std::string planFormats(ArvDevice* device, CameraPlan& plan) {
  std::vector<const PixelFormatTraits*> readable;
  std::vector<std::string> foreign;
  for (const Entry& one : entriesOf(device, "PixelFormat")) {
    const PixelFormatTraits* known = pixelFormatByCode(static_cast<std::uint32_t>(one.value));
    if (known != nullptr)
      readable.push_back(known);
    else
      foreign.push_back(formatInWords(one.name, one.value));
  }
  bestFirst(readable);
  for (const PixelFormatTraits* format : readable) plan.formats.emplace_back(format->name);
  if (readable.empty() && foreign.empty()) return "it has no PixelFormat: it describes no camera";
  if (readable.empty()) {
    return "none of its pixel formats can be read: " + joined(foreign) +
           "; those that can: " + std::string(kPixelFormatsInWords);
  }
  if (!foreign.empty()) plan.notes.push_back("formats that cannot be read: " + joined(foreign));
  standAt(device, *readable.front());
  return {};
}

}  // namespace

tl::expected<CameraPlan, Error> planCamera(const std::string& file, const CameraOptions& options) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return tl::unexpected(Error{.exitCode = EX_NOINPUT, .what = "it cannot be read", .where = file});
  std::string xml{std::istreambuf_iterator<char>(stream), {}};
  xml.erase(0, xml.find('<'));  // what tools print before it
  // What is wrong is said below, in one line.
  g_log_set_handler(
      "XML", GLogLevelFlags(G_LOG_LEVEL_MASK), [](auto...) {}, nullptr);
  Failure failure;
  const auto refuse = [&](int exitCode, std::string what) {
    return tl::unexpected(Error{.exitCode = exitCode, .what = std::move(what), .where = file});
  };
  const Ref<ArvDevice> device = makePaperDevice(xml, failure);
  if (!device) return refuse(EX_DATAERR, failure.text());
  const Ref<ArvCamera> camera(arv_camera_new_with_device(device.get(), failure.into()));
  if (!camera) return refuse(EX_DATAERR, "Aravis does not open it: " + failure.text());

  CameraPlan plan;
  planFeatures(device.get(), plan);
  if (const std::string why = planFormats(device.get(), plan); !why.empty()) return refuse(EX_CONFIG, why);
  plan.format = options.pixelFormat;
  if (!plan.format.empty() && std::find(plan.formats.begin(), plan.formats.end(), plan.format) == plan.formats.end())
    return refuse(EX_CONFIG, "the camera refuses camera.pixel_format = \"" + plan.format + "\": it offers " +
                                 joined(plan.formats));

  CameraOptions others = options;
  others.pixelFormat.clear();
  CameraInfo info;
  std::vector<Feature> undo;  // not used: there is no camera to restore
  if (auto set = applySettings(camera.get(), others, nullptr, info, undo); !set)
    return refuse(EX_CONFIG, set.error().message());
  if (!plan.format.empty()) plan.settings.push_back("PixelFormat = " + plan.format);
  for (const std::string& setting : info.settings)
    if (setting.find("PixelFormat = ") != 0) plan.settings.push_back(setting);
  return plan;
}

}  // namespace tractiond::capture
