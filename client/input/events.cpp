#include "client/input/events.h"

#include <fcntl.h>
#include <linux/uinput.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace traction::input {
namespace {

constexpr const char* kPath = "/dev/uinput";

tractiond::Error unopened() {
  const std::string what = std::string(kPath) + " cannot be opened: " + std::strerror(errno);
  if (errno == EACCES || errno == EPERM)
    return {
        EX_NOPERM, what, "",
        "70-traction-input.rules gives it to the group input: sudo udevadm control --reload && sudo udevadm trigger "
        "/dev/uinput && sudo usermod -aG input $USER, and log in again"};
  return {EX_UNAVAILABLE, what, "", "load the kernel's module: sudo modprobe uinput"};
}

bool setUp(int device, const EventDevice::Ability& ability) {
  const auto allow = [&](unsigned long request, unsigned value) { return ioctl(device, request, value) == 0; };
  const auto allowAll = [&](unsigned type, unsigned long request, const std::vector<std::uint16_t>& codes) {
    return codes.empty() || (allow(UI_SET_EVBIT, type) &&
                             std::all_of(codes.begin(), codes.end(), [&](auto code) { return allow(request, code); }));
  };
  bool good = allowAll(EV_KEY, UI_SET_KEYBIT, ability.keys) && allowAll(EV_REL, UI_SET_RELBIT, ability.relative);
  for (const std::uint16_t property : ability.properties) good = good && allow(UI_SET_PROPBIT, property);
  for (const EventDevice::Axis& axis : ability.absolute) {
    uinput_abs_setup setup{};
    setup.code = axis.code;
    setup.absinfo = {
        .value = 0, .minimum = axis.least, .maximum = axis.most, .fuzz = 0, .flat = 0, .resolution = axis.resolution};
    good = good && allow(UI_SET_EVBIT, EV_ABS) && ioctl(device, UI_ABS_SETUP, &setup) == 0;
  }
  uinput_setup setup{};
  setup.id.bustype = BUS_VIRTUAL;
  ability.name.copy(setup.name, sizeof setup.name - 1);
  return good && ioctl(device, UI_DEV_SETUP, &setup) == 0 && ioctl(device, UI_DEV_CREATE) == 0;
}

}  // namespace

tl::expected<EventDevice, tractiond::Error> EventDevice::make(const Ability& ability) {
  EventDevice device(open(kPath, O_WRONLY | O_NONBLOCK | O_CLOEXEC));
  if (device.descriptor_ < 0) return tl::unexpected(unopened());
  if (!setUp(device.descriptor_, ability))
    return tl::unexpected(
        tractiond::Error{EX_OSERR, "the kernel makes no " + ability.name + ": " + std::strerror(errno)});
  spdlog::info("the input device is \"{}\"", ability.name);
  return device;
}

EventDevice::~EventDevice() {
  if (descriptor_ >= 0) close(descriptor_);  // with which the kernel removes the device
}

void EventDevice::add(std::uint16_t type, std::uint16_t code, int value) {
  input_event event{};
  event.type = type;
  event.code = code;
  event.value = value;
  events_.push_back(event);
}

void EventDevice::report() {
  if (events_.empty()) return;
  add(EV_SYN, SYN_REPORT, 0);
  const auto size = static_cast<ssize_t>(events_.size() * sizeof(input_event));
  if (write(descriptor_, events_.data(), static_cast<std::size_t>(size)) != size)
    spdlog::warn("events are lost: {}", std::strerror(errno));
  events_.clear();
}

}  // namespace traction::input
