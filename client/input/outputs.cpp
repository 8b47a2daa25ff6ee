#include "client/input/outputs.h"

#include "client/input/devices.h"
#include "client/input/keyboard.h"
#include "client/input/osc.h"
#include "client/input/spacenav.h"
#include "client/input/tuio.h"

#include <sysexits.h>

#include <algorithm>
#include <utility>

namespace traction::input {
namespace {

using Made = tl::expected<std::unique_ptr<Output>, tractiond::Error>;

template <typename Device, typename... Options>
Made onDevice(const EventDevice::Ability& ability, const Options&... options) {
  auto device = EventDevice::make(ability);
  if (!device) return tl::unexpected(device.error());
  return std::make_unique<Device>(*std::move(device), options...);
}

Made oneOrSeveral(const Profile& profile) {
  auto one = EventDevice::make(PointerDevice::ability());
  if (!one) return tl::unexpected(one.error());
  auto several = EventDevice::make(TouchDevice::ability(profile.area, *profile.touch));
  if (!several) return tl::unexpected(several.error());
  return std::make_unique<OneOrSeveral>(PointerDevice(*std::move(one), *profile.pointer),
                                        TouchDevice(*std::move(several), profile.area, *profile.touch));
}

Made keyboard(const TextOptions& options) {
  const auto path = options.alphabet.empty() ? shippedFolder() / "strokes/alphabet.toml" : options.alphabet;
  const auto alphabet = loadAlphabet(path);
  if (!alphabet) return tl::unexpected(alphabet.error());
  const auto strange = std::find_if(alphabet->begin(), alphabet->end(),
                                    [](const Template& each) { return !Keyboard::canType(each.symbol); });
  if (strange != alphabet->end()) {
    return tl::unexpected(
        tractiond::Error{EX_CONFIG, "no key types '" + strange->symbol + "'", path.string(),
                         "symbols are a to z, 0 to 9, digits, letters, and names of keys: docs/input.md"});
  }
  return onDevice<Keyboard>(Keyboard::ability(), *alphabet, options);
}

Made tuio(const TuioOptions& options, TuioOutput::Version version, const Area& area) {
  auto datagrams = Datagrams::open(options.address);
  if (!datagrams) return tl::unexpected(datagrams.error());
  return std::make_unique<TuioOutput>(*std::move(datagrams), version, area, options.fullPress_N);
}

Made osc(const OscOptions& options) {
  auto datagrams = Datagrams::open(options.address);
  if (!datagrams) return tl::unexpected(datagrams.error());
  return std::make_unique<OscOutput>(*std::move(datagrams), options);
}

}  // namespace

tl::expected<std::vector<std::unique_ptr<Output>>, tractiond::Error> openOutputs(const Profile& profile) {
  std::vector<Made> made;
  if (profile.pointer && profile.touch) {
    made.push_back(oneOrSeveral(profile));
  } else if (profile.pointer) {
    made.push_back(onDevice<PointerDevice>(PointerDevice::ability(), *profile.pointer));
  } else if (profile.touch) {
    made.push_back(
        onDevice<TouchDevice>(TouchDevice::ability(profile.area, *profile.touch), profile.area, *profile.touch));
  } else if (profile.pen) {
    made.push_back(onDevice<PenDevice>(PenDevice::ability(profile.area), profile.area, *profile.pen));
  }
  if (profile.zoom) made.push_back(onDevice<ZoomDevice>(ZoomDevice::ability(), *profile.zoom));
  if (profile.text) made.push_back(keyboard(*profile.text));
  if (profile.spacenav) {
    const auto& socket = profile.spacenav->socket;
    made.push_back(Spacenav::open(socket.empty() ? spacenavSocket() : socket, profile.spacenav->axes));
  }
  if (profile.tuio11) made.push_back(tuio(*profile.tuio11, TuioOutput::Version::k11, profile.area));
  if (profile.tuio20) made.push_back(tuio(*profile.tuio20, TuioOutput::Version::k20, profile.area));
  if (profile.osc) made.push_back(osc(*profile.osc));
  std::vector<std::unique_ptr<Output>> outputs;
  for (Made& output : made) {
    if (!output) return tl::unexpected(output.error());
    outputs.push_back(*std::move(output));
  }
  return outputs;
}

}  // namespace traction::input
