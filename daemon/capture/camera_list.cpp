#include "daemon/capture/camera_list.h"

#include "base/directory.h"
#include "daemon/capture/aravis.h"
#include "daemon/capture/inspection.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>

namespace tractiond::capture {
namespace {

namespace fs = std::filesystem;

std::string firstLine(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// What a process of its own finds wrong with a camera's description.
Inspection seenInChild(const std::string& inspector, const CameraName& camera) {
  if (inspector.empty() || camera.protocol == "Fake") return {.outcome = Inspection::Outcome::kHarmless, .text = {}};
  return inspectInChild(handleOf(camera), {.program = inspector});
}

/// The interface in whose network an address lies; empty: in none.
std::string interfaceTowards(const std::string& address) {
  in_addr camera{};
  ifaddrs* all = nullptr;
  std::string found;
  if (inet_pton(AF_INET, address.c_str(), &camera) != 1 || getifaddrs(&all) != 0) return found;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_netmask == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    const auto own = reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr;
    const auto mask = reinterpret_cast<const sockaddr_in*>(one->ifa_netmask)->sin_addr.s_addr;
    if ((own & mask) == (camera.s_addr & mask)) found = one->ifa_name;
  }
  freeifaddrs(all);
  return found;
}

}  // namespace

std::optional<Unreachable> unreachable(const std::string& address) {
  if (!isAddress(address) || !interfaceTowards(address).empty()) return std::nullopt;
  return Unreachable{.what = "its address " + address + " is in no network of this host",
                     .remedy =
                         "give it one with \"arv-tool-0.8 network\" or the maker's tool (persistent or forced IP), "
                         "or give this host's interface an address in the camera's network"};
}

std::pair<std::string, std::string> makeOf(ArvDevice* device) {
  ArvDomElement* root = arv_dom_document_get_document_element(ARV_DOM_DOCUMENT(arv_device_get_genicam(device)));
  if (root == nullptr || !ARV_IS_GC_REGISTER_DESCRIPTION_NODE(root)) return {};
  auto* description = ARV_GC_REGISTER_DESCRIPTION_NODE(root);
  return {text(arv_gc_register_description_node_get_vendor_name(description)),
          text(arv_gc_register_description_node_get_model_name(description))};
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

std::vector<UsbCamera> usbCameras(const fs::path& sys, const fs::path& dev) {
  std::vector<UsbCamera> cameras;
  std::set<fs::path> seen;
  for (const fs::path& interface : entriesOf(sys / "bus/usb/devices")) {
    // An interface, "1-2:1.0", of its device, "1-2". Class EF, subclass 05: USB3 Vision.
    const std::string name = interface.filename();
    const auto colon = name.find(':');
    if (colon == std::string::npos || firstLine(interface / "bInterfaceClass") != "ef" ||
        firstLine(interface / "bInterfaceSubClass") != "05")
      continue;
    const fs::path device = interface.parent_path() / name.substr(0, colon);
    if (!seen.insert(device).second) continue;
    UsbCamera camera;
    camera.vendor = firstLine(device / "manufacturer");
    camera.product = firstLine(device / "product");
    camera.serial = firstLine(device / "serial");
    std::array<char, 16> place{};
    std::snprintf(place.data(), place.size(), "%03d/%03d", std::atoi(firstLine(device / "busnum").c_str()),
                  std::atoi(firstLine(device / "devnum").c_str()));
    camera.node = dev / "bus/usb" / place.data();
    camera.permitted = access(camera.node.c_str(), R_OK | W_OK) == 0;
    cameras.push_back(std::move(camera));
  }
  std::sort(cameras.begin(), cameras.end(), [](const auto& a, const auto& b) { return a.node < b.node; });
  return cameras;
}

std::vector<CameraSight> inspectCameras(const std::string& inspector, bool withFake) {
  std::vector<CameraSight> all;
  std::map<std::string, std::vector<std::size_t>> onInterface;  // which of them
  for (const CameraName& name : listCameras(withFake)) {
    CameraSight sight{.name = name, .obstacle = {}, .remedy = {}, .notes = {}};
    if (const auto elsewhere = name.protocol == "GigEVision" ? unreachable(name.address) : std::nullopt) {
      sight.obstacle = elsewhere->what;
      sight.remedy = elsewhere->remedy;
    } else if (const Inspection seen = seenInChild(inspector, name); seen.outcome == Inspection::Outcome::kFault) {
      sight.obstacle = seen.text;
      sight.remedy = "its firmware may be damaged, or it is not what it says";
    } else if (seen.outcome == Inspection::Outcome::kUnreadable) {
      sight.obstacle = seen.text;
    } else {
      Failure failure;
      const Ref<ArvCamera> camera(arv_camera_new(handleOf(name).c_str(), failure.into()));
      ArvDevice* device = camera ? arv_camera_get_device(camera.get()) : nullptr;
      if (device == nullptr) {
        sight.obstacle = "it does not open: " + failure.text();
        sight.remedy = "power it off and on; look at its link light, the cable and the firewall";
      } else if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) {
        sight.obstacle = "another client holds it";
        sight.remedy = "close that client; one that died loses it within some seconds";
      }
      if (device != nullptr && arv_camera_is_uv_device(camera.get())) {
        const guint payload = arv_camera_get_payload(camera.get(), nullptr);
        if (const std::string warning = usbMemoryWarning(payload * std::size_t{10}); !warning.empty())
          sight.notes.push_back(warning);
      }
    }
    if (name.protocol == "GigEVision" && sight.obstacle.empty())
      onInterface[interfaceTowards(name.address)].push_back(all.size());
    all.push_back(std::move(sight));
  }
  for (const auto& [interface, sharers] : onInterface) {
    const double mbit_per_s = std::atof(firstLine(fs::path("/sys/class/net") / interface / "speed").c_str());
    const int mtu = std::atoi(firstLine(fs::path("/sys/class/net") / interface / "mtu").c_str());
    const std::string advice = shareAdvice(static_cast<int>(sharers.size()), mbit_per_s * 1e6 / 8, std::min(mtu, 9000));
    for (const std::size_t one : sharers)
      if (!advice.empty()) all[one].notes.push_back(advice);
  }
  for (const UsbCamera& usb : usbCameras()) {
    const bool listed = std::any_of(all.begin(), all.end(), [&](const auto& s) { return s.name.serial == usb.serial; });
    if (listed && usb.permitted) continue;
    CameraSight sight;
    sight.name.vendor = usb.vendor;
    sight.name.model = usb.product;
    sight.name.serial = usb.serial;
    sight.name.protocol = "USB3Vision";
    sight.name.physicalId = usb.node;
    sight.obstacle = usb.permitted ? "Aravis does not see it" : "there is no permission to open " + usb.node.string();
    sight.remedy = usb.permitted ? "unplug it and plug it in again"
                                 : "install the udev rules and join the group tractiond, then plug it in again";
    all.push_back(std::move(sight));
  }
  return all;
}

}  // namespace tractiond::capture
