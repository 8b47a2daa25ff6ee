// Strategy. Aravis lists and opens; what it is vague about is asked again: which of the listed it is, whether we
// control it, and why it cannot be opened.
#include "base/clock.h"
#include "base/directory.h"
#include "daemon/capture/aravis.h"
#include "daemon/capture/camera_list.h"
#include "daemon/capture/inspection.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

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

/// The error of a network camera that this host cannot reach: its address is in none of the networks of this host.
std::optional<Error> unreachable(const std::string& address) {
  if (!isAddress(address) || !interfacesTowards(address).empty()) return std::nullopt;
  return Error{.exitCode = EX_UNAVAILABLE,
               .what = "its address " + address + " is in no network of this host",
               .remedy = "give it one with \"arv-tool-0.8 network\" or the maker's tool (persistent or forced IP), or "
                         "give this host's interface an address in the camera's network"};
}

/// What Aravis opens the camera by; without an id the first in the list that can be reached. Looks in the list itself:
/// Aravis would ask the name server for an unknown id, and opens another as the first than it lists.
tl::expected<std::string, Error> idFor(const CameraOptions& options) {
  showFake(options.fakeInterface);
  const std::string& id = options.id;
  if (isAddress(id)) return id;
  const std::vector<CameraName> all = listCameras(options.fakeInterface);
  auto found = std::find_if(all.begin(), all.end(), [&](const CameraName& camera) {
    return id.empty() ? !unreachable(handleOf(camera)) : matches(camera, id);
  });
  if (id.empty() && found == all.end()) found = all.begin();
  if (found != all.end()) return handleOf(*found);
  if (id.empty()) return failed(EX_UNAVAILABLE, "no camera answers", kWhatToCheck);
  std::vector<std::string> ids;
  for (const CameraName& camera : all) ids.push_back(camera.id);
  return failed(EX_UNAVAILABLE, "there is no camera \"" + id + "\"",
                ids.empty() ? "no camera answers: " + std::string(kWhatToCheck) : "there are: " + joined(ids));
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

std::string firstLine(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
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

tl::expected<Ref<ArvCamera>, Error> findCamera(const CameraOptions& options, const std::stop_token& stop) {
  const auto id = idFor(options);
  if (!id) return tl::unexpected(id.error());
  const std::string camera = "camera \"" + (options.id.empty() ? *id : options.id) + "\"";
  const auto silent = [&](const std::string& why) {
    if (const auto elsewhere = unreachable(*id))
      return failed(EX_UNAVAILABLE, camera + " cannot be reached: " + elsewhere->what, elsewhere->remedy);
    const std::string ambiguous = ambiguity(*id);
    return failed(EX_UNAVAILABLE, camera + " does not answer", ambiguous.empty() ? why : why + "; " + ambiguous);
  };
  if (!options.inspector.empty() && !options.fakeInterface) {
    const Inspection inspection = inspectInChild(*id, {.program = options.inspector}, stop);
    if (inspection.outcome == Inspection::Outcome::kAbsent) return silent(inspection.text);
    if (inspection.outcome == Inspection::Outcome::kUnreadable)
      return failed(EX_UNAVAILABLE, camera + ": " + inspection.text);
    if (inspection.outcome == Inspection::Outcome::kFault)
      return failed(EX_UNAVAILABLE, inspection.text, "its firmware may be damaged, or it is not what it says");
  }
  Failure failure;
  const Ref<ArvDevice> device(arv_open_device(id->c_str(), failure.into()));
  Ref<ArvCamera> opened(device ? arv_camera_new_with_device(device.get(), failure.into()) : nullptr);
  if (!opened) return silent(failure.text());
  return opened;
}

tl::expected<Ref<ArvCamera>, Error> connectCamera(const CameraOptions& options, const Opening& opening,
                                                  ControlGuard& guard) {
  // A camera forgets a client that died 3 s after its last heartbeat, and one try may take Aravis 2.5 s.
  constexpr std::int64_t kPatience_ns = 8'000'000'000;
  const std::int64_t until_ns = monotonicNow() + kPatience_ns;
  auto camera = findCamera(options, opening.stop);
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

std::string shareAdvice(int cameras, double link_bytes_per_s, int packet_bytes) {
  if (cameras < 2 || link_bytes_per_s <= 0) return {};
  const double share = 0.9 * link_bytes_per_s / cameras;
  const double delay_ns = packet_bytes * (cameras - 1) / link_bytes_per_s * 1e9;
  return std::to_string(cameras) +
         " cameras share this link: give each throughput_bytes_per_s = " + std::to_string(std::llround(share)) +
         ", or packet_delay_ns = " + std::to_string(std::llround(delay_ns)) + " with packets of " +
         std::to_string(packet_bytes) + " bytes";
}

std::vector<CameraSight> closedUsbCameras(const std::vector<CameraSight>& listed, const std::filesystem::path& sys,
                                          const std::filesystem::path& dev) {
  std::map<std::filesystem::path, CameraSight> found;  // by the file of the device
  for (const std::filesystem::path& interface : entriesOf(sys / "bus/usb/devices")) {
    // An interface, "1-2:1.0", of its device, "1-2". Class EF, subclass 05: USB3 Vision.
    const std::string name = interface.filename();
    if (firstLine(interface / "bInterfaceClass") != "ef" || firstLine(interface / "bInterfaceSubClass") != "05")
      continue;
    const std::filesystem::path device = interface.parent_path() / name.substr(0, name.find(':'));
    std::array<char, 16> place{};
    std::snprintf(place.data(), place.size(), "%03d/%03d", std::atoi(firstLine(device / "busnum").c_str()),
                  std::atoi(firstLine(device / "devnum").c_str()));
    const std::filesystem::path node = dev / "bus/usb" / place.data();
    const bool isPermitted = access(node.c_str(), R_OK | W_OK) == 0;
    const std::string serial = firstLine(device / "serial");
    const bool isListed = std::ranges::any_of(listed, [&](const auto& one) { return one.name.serial == serial; });
    if (isListed && isPermitted) continue;
    CameraSight& sight = found[node];
    sight.name.vendor = firstLine(device / "manufacturer");
    sight.name.model = firstLine(device / "product");
    sight.name.serial = serial;
    sight.name.protocol = "USB3Vision";
    sight.name.physicalId = node;
    sight.obstacle = isPermitted ? "Aravis does not see it" : "there is no permission to open " + node.string();
    sight.remedy = isPermitted ? "unplug it and plug it in again"
                               : "install the udev rules and join the group tractiond, then plug it in again";
  }
  std::vector<CameraSight> closed;
  for (auto& [node, sight] : found) closed.push_back(std::move(sight));
  return closed;
}

std::vector<CameraSight> inspectCameras(const std::string& inspector, bool withFake) {
  std::vector<CameraSight> all;
  std::map<std::string, std::vector<std::size_t>> onInterface;  // which of them
  for (const CameraName& name : listCameras(withFake)) {
    CameraSight sight{.name = name, .obstacle = {}, .remedy = {}, .notes = {}};
    const auto camera =
        findCamera({.id = handleOf(name), .inspector = inspector, .fakeInterface = name.protocol == "Fake"}, {});
    ArvDevice* device = camera ? arv_camera_get_device(camera->get()) : nullptr;
    if (!camera) {
      sight.obstacle = camera.error().what;
      sight.remedy = camera.error().remedy;
    } else if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) {
      sight.obstacle = "another client holds it";
      sight.remedy = "close that client; one that died loses it within some seconds";
    } else if (arv_camera_is_uv_device(camera->get())) {
      const guint payload = arv_camera_get_payload(camera->get(), nullptr);
      if (const std::string warning = usbMemoryWarning(payload * std::size_t{10}); !warning.empty())
        sight.notes.push_back(warning);
    }
    const std::vector<std::string> towards = interfacesTowards(name.address);
    if (name.protocol == "GigEVision" && sight.obstacle.empty() && !towards.empty())
      onInterface[towards.back()].push_back(all.size());
    if (towards.size() > 1) sight.notes.push_back(ambiguity(name.address));
    all.push_back(std::move(sight));
  }
  for (const auto& [interface, sharers] : onInterface) {
    const double mbit_per_s =
        std::atof(firstLine(std::filesystem::path("/sys/class/net") / interface / "speed").c_str());
    const int mtu = std::atoi(firstLine(std::filesystem::path("/sys/class/net") / interface / "mtu").c_str());
    const std::string advice = shareAdvice(static_cast<int>(sharers.size()), mbit_per_s * 1e6 / 8, std::min(mtu, 9000));
    for (const std::size_t one : sharers)
      if (!advice.empty()) all[one].notes.push_back(advice);
  }
  for (CameraSight& usb : closedUsbCameras(all)) all.push_back(std::move(usb));
  return all;
}

}  // namespace tractiond::capture
