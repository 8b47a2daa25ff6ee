// Strategy. Aravis lists and opens; what it is vague about is asked again: which of the listed it is, and whether we
// control it.
#include "base/clock.h"
#include "daemon/capture/aravis.h"
#include "daemon/capture/camera_list.h"
#include "daemon/capture/inspection.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>

namespace tractiond::capture {
namespace {

CameraName nameInList(unsigned index) {
  return {text(arv_get_device_id(index)),      text(arv_get_device_physical_id(index)),
          text(arv_get_device_address(index)), text(arv_get_device_vendor(index)),
          text(arv_get_device_model(index)),   text(arv_get_device_serial_nbr(index)),
          text(arv_get_device_protocol(index))};
}

/// Where it is shown, Aravis's in-process camera comes first.
void showFake(bool shown) {
  if (shown)
    arv_enable_interface("Fake");
  else
    arv_disable_interface("Fake");
}

bool matches(const CameraName& name, const std::string& id) {
  const auto same = [&](const std::string& other) { return g_ascii_strcasecmp(other.c_str(), id.c_str()) == 0; };
  return same(name.id) || same(name.physicalId) || same(name.address) || same(name.vendor + "-" + name.serial);
}

/// What Aravis opens the camera by; without an id the first in the list that can be reached. Looks in the list itself:
/// Aravis would ask the name server for an unknown id, and opens another as the first than it lists.
tl::expected<std::string, Error> idFor(const CameraOptions& options) {
  showFake(options.fakeInterface);
  const std::string& id = options.id;
  if (isAddress(id)) return id;
  const std::vector<CameraName> all = listCameras(options.fakeInterface);
  const auto found = std::find_if(all.begin(), all.end(), [&](const CameraName& c) { return matches(c, id); });
  if (all.empty() && id.empty()) return failed(EX_UNAVAILABLE, "no camera answers", kWhatToCheck);
  if (found == all.end() && !id.empty()) {
    std::vector<std::string> ids;
    for (const CameraName& camera : all) ids.push_back(camera.id);
    return failed(EX_UNAVAILABLE, "there is no camera \"" + id + "\"",
                  ids.empty() ? "no camera answers: " + std::string(kWhatToCheck) : "there are: " + joined(ids));
  }
  if (!id.empty()) return handleOf(*found);
  const auto near = std::find_if(all.begin(), all.end(), [](const CameraName& c) { return !unreachable(handleOf(c)); });
  return handleOf(near == all.end() ? all.front() : *near);
}

tl::unexpected<Error> damaged(const std::string& fault) {
  return failed(EX_UNAVAILABLE, fault, "its firmware may be damaged, or it is not what it says");
}

tl::expected<Ref<ArvCamera>, Error> find(const CameraOptions& options, const std::stop_token& stop) {
  const auto id = idFor(options);
  if (!id) return tl::unexpected(id.error());
  const std::string camera = "camera \"" + (options.id.empty() ? *id : options.id) + "\"";
  const auto silent = [&](const std::string& why) {
    if (const auto elsewhere = unreachable(*id))
      return failed(EX_UNAVAILABLE, camera + " cannot be reached: " + elsewhere->what, elsewhere->remedy);
    return failed(EX_UNAVAILABLE, camera + " does not answer", why);
  };
  std::string harmless;
  if (!options.inspector.empty() && !options.fakeInterface) {
    const Inspection inspection = inspectInChild(*id, {.program = options.inspector}, stop);
    if (inspection.outcome == Inspection::Outcome::kAbsent) return silent(inspection.text);
    if (inspection.outcome == Inspection::Outcome::kUnreadable)
      return failed(EX_UNAVAILABLE, camera + ": " + inspection.text);
    if (inspection.outcome == Inspection::Outcome::kFault) return damaged(inspection.text);
    harmless = inspection.text;
  }
  Failure failure;
  const Ref<ArvDevice> device(arv_open_device(id->c_str(), failure.into()));
  if (device && !harmless.empty()) {
    std::size_t size = 0;
    const char* const xml = arv_device_get_genicam_xml(device.get(), &size);
    if (xml == nullptr || hashOf({xml, size}) != harmless)
      return damaged("the camera's description is not the one of a moment ago");
  }
  Ref<ArvCamera> opened(device ? arv_camera_new_with_device(device.get(), failure.into()) : nullptr);
  if (!opened) return silent(failure.text());
  return opened;
}

/// Aravis opens a camera that another client controls without an error. The controlling client is not read while
/// waiting: some cameras, such as Aravis's fake, take any reading of that register for that client's heartbeat.
bool takeControl(ArvGvDevice* device, std::int64_t until_ns, const std::stop_token& stop) {
  while (!arv_gv_device_is_controller(device) && !arv_gv_device_take_control(device, nullptr)) {
    if (stop.stop_requested() || monotonicNow() > until_ns) return false;
    pauseUntil(monotonicNow() + 200'000'000, stop);
  }
  return true;
}

}  // namespace

bool isAddress(const std::string& id) {
  in_addr address{};
  return inet_pton(AF_INET, id.c_str(), &address) == 1;
}

std::string handleOf(const CameraName& camera) {
  return camera.protocol == "GigEVision" && isAddress(camera.address) ? camera.address : camera.id;
}

std::vector<CameraName> listCameras(bool withFake) {
  showFake(withFake);
  arv_update_device_list();
  std::vector<CameraName> all;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) all.push_back(nameInList(i));
  return all;
}

CameraName nameOf(ArvCamera* camera) {
  CameraName name;
  name.vendor = text(arv_camera_get_vendor_name(camera, nullptr));
  name.model = text(arv_camera_get_model_name(camera, nullptr));
  name.serial = text(arv_camera_get_device_serial_number(camera, nullptr));
  name.id = name.vendor + "-" + name.model + "-" + name.serial;
  name.protocol = arv_camera_is_gv_device(camera)   ? "GigEVision"
                  : arv_camera_is_uv_device(camera) ? "USB3Vision"
                                                    : "Fake";
  if (arv_camera_is_gv_device(camera)) {
    auto* address =
        G_INET_SOCKET_ADDRESS(arv_gv_device_get_device_address(ARV_GV_DEVICE(arv_camera_get_device(camera))));
    char* dotted = g_inet_address_to_string(g_inet_socket_address_get_address(address));
    name.address = text(dotted);
    g_free(dotted);
  }
  return name;
}

tl::expected<Ref<ArvCamera>, Error> connectCamera(const CameraOptions& options, const Opening& opening,
                                                  ControlGuard& guard) {
  // A camera forgets a client that died 3 s after its last heartbeat, and one try may take Aravis 2.5 s.
  constexpr std::int64_t kPatience_ns = 8'000'000'000;
  const std::int64_t until_ns = monotonicNow() + kPatience_ns;
  auto camera = find(options, opening.stop);
  if (!camera) return camera;
  ArvDevice* device = arv_camera_get_device(camera->get());
  if (!ARV_IS_GV_DEVICE(device)) return camera;
  if (auto guarded = guard.guard(ARV_GV_DEVICE(device)); !guarded) return tl::unexpected(guarded.error());
  if (!arv_gv_device_is_controller(ARV_GV_DEVICE(device))) {
    const CameraName name = nameOf(camera->get());
    const std::string held = "camera " + name.id + " at " + name.address + " is held by another client";
    if (opening.say) opening.say(LogLevel::kWarning, held);
    if (!takeControl(ARV_GV_DEVICE(device), until_ns, opening.stop))
      return failed(EX_TEMPFAIL, held, "close that client");
  }
  // It may still send to a client that died; some cameras continue with that, such as Aravis's fake.
  arv_camera_stop_acquisition(camera->get(), nullptr);
  return camera;
}

}  // namespace tractiond::capture
