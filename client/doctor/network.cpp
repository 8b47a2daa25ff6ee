// Checks the link from the camera to this machine.

#include "client/doctor/checks.h"

#include <arpa/inet.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdlib>

namespace traction::doctor {

namespace {

/// Returns an IPv4 address in network byte order, as in /proc/net/route.
std::optional<std::uint32_t> ipOf(const std::string& text) {
  in_addr address{};
  if (inet_pton(AF_INET, text.c_str(), &address) != 1) return std::nullopt;
  return address.s_addr;
}

bool isMac(const std::string& text) {
  if (text.size() != 17) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i % 3 == 2 ? text[i] != ':' : std::isxdigit(static_cast<unsigned char>(text[i])) == 0) return false;
  }
  return true;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Returns the interface of the longest matching route; empty: there is none.
std::string interfaceTo(const Box& box, std::uint32_t address) {
  if ((ntohl(address) >> 24) == 127) return "lo";
  std::string interface;
  int longest = -1;
  for (const std::string& line : box.lines("/proc/net/route")) {
    const auto words = wordsOf(line);  // interface destination gateway flags count use metric mask
    if (words.size() < 8 || words[0] == "Iface") continue;
    const auto hex = [&](std::size_t i) {
      return static_cast<std::uint32_t>(std::strtoul(words[i].c_str(), nullptr, 16));
    };
    const std::uint32_t mask = hex(7);
    constexpr std::uint32_t kUp = 1;
    if ((hex(3) & kUp) == 0 || (address & mask) != hex(1) || std::popcount(mask) <= longest) continue;
    longest = std::popcount(mask);
    interface = words[0];
  }
  return interface;
}

/// Returns the interface that the camera is connected to; empty: not known.
std::string interfaceOf(const Box& box, const std::string& cameraId) {
  if (const auto address = ipOf(cameraId)) return interfaceTo(box, *address);
  for (const std::string& line : box.lines("/proc/net/arp")) {
    const auto words = wordsOf(line);  // address type flags MAC mask interface
    if (isMac(cameraId) && words.size() >= 6 && lower(words[3]) == lower(cameraId)) return words[5];
  }
  return "";
}

std::string bytes(double number) {
  return std::to_string(std::llround(number)) + " bytes";
}

Finding checkReceiveBuffer(const Box& box, const Settings& settings) {
  const auto most = box.number("/proc/sys/net/core/rmem_max");
  const double asked = settings.receiveBuffer_bytes;
  const std::string wanted = "camera.receive_buffer_bytes = " + std::to_string(std::llround(asked));
  if (!most) return unknown("/proc/sys/net/core/rmem_max cannot be read");
  if (*most >= asked) return ok("the kernel grants " + bytes(*most) + ", " + wanted);
  const std::string line = "net.core.rmem_max=" + std::to_string(std::llround(std::max(asked, 16'777'216.0)));
  return {{},
          isAddress(settings.cameraId) ? Verdict::kFail : Verdict::kWarn,
          "the kernel grants at most " + bytes(*most) + ", " + wanted,
          "sudo sysctl -w " + line + " && echo " + line + " | sudo tee /etc/sysctl.d/60-tractiond.conf"};
}

Finding checkMtu(const Box& box, const Settings& settings, const std::string& interface) {
  constexpr double kJumbo = 9000.0;
  const auto mtu = box.number("/sys/class/net/" + interface + "/mtu");
  const std::string raise = "sudo ip link set " + interface + " mtu 9000";
  if (!mtu) return unknown("that of " + interface + " cannot be read");
  if (settings.packetSize_bytes > *mtu)
    return fail(interface + " has " + bytes(*mtu) + ", camera.packet_size_bytes = " +
                    std::to_string(std::llround(settings.packetSize_bytes)) + ": the camera is refused",
                "sudo ip link set " + interface + " mtu " + std::to_string(std::llround(settings.packetSize_bytes)) +
                    ", or camera.packet_size_bytes = 0");
  if (settings.packetSize_bytes == 0.0 && *mtu < kJumbo)
    return warn(interface + " has " + bytes(*mtu) + ": small packets cost time",
                raise + ", or, where camera or card take no larger ones, camera.packet_size_bytes = " +
                    std::to_string(std::llround(*mtu)));
  return ok(interface + " has " + bytes(*mtu));
}

Finding checkReversePath(const Box& box, const std::string& interface) {
  const std::string folder = "/proc/sys/net/ipv4/conf/";
  const auto all = box.number(folder + "all/rp_filter"), one = box.number(folder + interface + "/rp_filter");
  if (!all || !one) return unknown("rp_filter of " + interface + " cannot be read");
  if (std::max(*all, *one) == 1.0) {  // the larger value applies; 2 accepts any return path
    const std::string line = "net.ipv4.conf." + interface + ".rp_filter=2";
    return warn(interface + " drops what comes from where it would not answer to: cameras with another address",
                "sudo sysctl -w " + line + " && echo " + line + " | sudo tee /etc/sysctl.d/61-tractiond-camera.conf");
  }
  return ok(interface + " takes packets from everywhere");
}

Finding checkNetworkManager(const Box& box, const std::string& interface) {
  if (interface == "lo") return ok("the camera is on the loopback");
  const auto index = box.line("/sys/class/net/" + interface + "/ifindex");
  if (!index) return unknown("whether it manages " + interface);
  const auto lines = box.lines("/run/NetworkManager/devices/" + *index);
  const bool manages = std::find(lines.begin(), lines.end(), "managed=true") != lines.end();
  if (!manages) return ok("does not run, or leaves " + interface + " alone");
  return warn("manages " + interface + ", and takes its address away when the cable was out",
              "printf '[keyfile]\\nunmanaged-devices=interface-name:" + interface +
                  "\\n' | sudo tee /etc/NetworkManager/conf.d/tractiond.conf && sudo systemctl reload NetworkManager"
                  "    # its address then belongs into /etc/network/interfaces");
}

}  // namespace

bool isAddress(const std::string& cameraId) {
  return ipOf(cameraId).has_value() || isMac(cameraId);
}

void checkNetwork(const Patient& patient, const Instance& instance, std::vector<Finding>& findings) {
  if (!instance.settings) return add(findings, "network", unknown(instance.whyUnknown));
  const Settings& settings = *instance.settings;
  add(findings, "receive buffer", checkReceiveBuffer(patient.box, settings));
  const std::string interface = interfaceOf(patient.box, settings.cameraId);
  if (interface.empty())
    return add(findings, "camera's link",
               unknown("camera.id = \"" + settings.cameraId + "\" " +
                       (isAddress(settings.cameraId) ? "is on no network of this machine"
                                                     : "is no address; tractiond --cameras lists them")));
  add(findings, "MTU", checkMtu(patient.box, settings, interface));
  add(findings, "reverse path", checkReversePath(patient.box, interface));
  add(findings, "NetworkManager", checkNetworkManager(patient.box, interface));
}

}  // namespace traction::doctor
