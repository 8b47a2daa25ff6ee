#include "daemon/capture/camera_plan.h"

#include "daemon/capture/aravis.h"
#include "daemon/capture/chunk_description.h"
#include "daemon/capture/paper_device.h"

#include <fstream>
#include <iterator>
#include <tuple>

namespace tractiond::capture {
namespace {

std::string orNone(std::string feature) {
  return feature.empty() ? "none" : feature;
}

std::vector<std::string> entriesOf(ArvDevice* device, const char* name) {
  guint count = 0;
  if (!hasFeature(device, name)) return {};
  const char** entries = arv_device_dup_available_enumeration_feature_values_as_strings(device, name, &count, nullptr);
  return taken(entries, count);
}

}  // namespace

tl::expected<CameraPlan, Error> planCamera(const std::string& file, const CameraOptions& options) {
  constexpr std::size_t kLargest_bytes = 64 << 20;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return tl::unexpected(Error{.exitCode = EX_NOINPUT, .what = "it cannot be read", .where = file});
  std::string xml{std::istreambuf_iterator<char>(stream), {}};
  const auto refuse = [&](std::string what) {
    return tl::unexpected(Error{.exitCode = EX_DATAERR, .what = std::move(what), .where = file});
  };
  if (xml.size() > kLargest_bytes) return refuse("a description of " + std::to_string(xml.size()) + " bytes is none");
  // What tools print before the description itself.
  const std::size_t begin = xml.find('<');
  if (begin == std::string::npos) return refuse("it is no GenICam description");
  xml.erase(0, begin);

  // What is wrong is said below, in one line.
  g_log_set_handler(
      "XML", GLogLevelFlags(G_LOG_LEVEL_MASK), [](auto...) {}, nullptr);
  Failure failure;
  const Ref<ArvDevice> device = makePaperDevice(xml, failure);
  if (!device) return refuse(failure.text());
  const Ref<ArvCamera> camera(arv_camera_new_with_device(device.get(), failure.into()));
  if (!camera) return refuse("Aravis does not open it: " + failure.text());

  CameraPlan plan;
  std::tie(plan.vendor, plan.model) = makeOf(device.get());
  plan.rate = orNone(firstFeature(device.get(), {"AcquisitionFrameRate", "AcquisitionFrameRateAbs", "FPS"}));
  plan.exposure = orNone(exposureOf(device.get()).feature);
  plan.gain = orNone(gainOf(device.get()).feature);
  plan.trigger = orNone(joined(entriesOf(device.get(), "TriggerSource")));
  plan.clock = orNone(firstFeature(device.get(), {"PtpEnable", "GevIEEE1588", "PtpMode"}));
  plan.link = orNone(firstFeature(device.get(), {"DeviceLinkThroughputLimit", "GevSCPD"}));
  const ChunkDescription chunks = describeChunks(device.get());
  plan.chunks = joined(chunks.names);
  for (const std::string& unread : chunks.unread) plan.notes.push_back(unread + " is computed: it is left out");
  plan.chunks = orNone(plan.chunks);
  if (const std::string note = byteOrderNote(device.get()); !note.empty()) plan.notes.push_back(note);
  if (!hasFeature(device.get(), "TLParamsLocked")) plan.notes.emplace_back("it has no TLParamsLocked");
  for (const PixelFormatTraits* format : readableFormats(camera.get())) plan.formats.emplace_back(format->name);

  CameraInfo info;
  const auto withPlace = [&](Error error) {
    error.where = file;
    error.exitCode = EX_CONFIG;  // nobody can fail to answer here
    return tl::unexpected(error);
  };
  std::vector<Feature> undo;  // a description is nobody's camera
  if (auto set = applySettings(camera.get(), options, nullptr, info, undo); !set) return withPlace(set.error());
  if (auto read = readPicture(camera.get(), info); !read) {
    // Registers of 0 are no size: that it is read is what can be known here.
    if (read.error().what.find("size") == std::string::npos) return withPlace(read.error());
  }
  plan.settings = info.settings;
  plan.picture = std::string(traitsOf(info.format).name);
  return plan;
}

}  // namespace tractiond::capture
