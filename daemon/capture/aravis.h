// What the files that know Aravis share. Internal to this folder.
#pragma once

#include "base/error.h"
#include "base/mailbox.h"
#include "daemon/capture/camera_info.h"
#include "daemon/capture/camera_options.h"
#include "daemon/capture/clock_asker.h"
#include "daemon/capture/driver.h"
#include "daemon/capture/stream_filter.h"
#include "daemon/records/camera_features.h"

#include <arv.h>
#include <tl/expected.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace tractiond::capture {

/// Of a GObject.
struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using Ref = std::unique_ptr<T, Unref>;

/// A GError that is freed; into() is the last argument of Aravis's functions.
class Failure {
 public:
  Failure() = default;
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  ~Failure() { g_clear_error(&error_); }
  GError** into() {
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() const { return error_ != nullptr; }
  std::string text() const { return error_ == nullptr ? "unknown error" : error_->message; }
  /// The camera did not answer: that is no refusal.
  bool noAnswer() const;

 private:
  GError* error_ = nullptr;
};

tl::unexpected<Error> failed(int exitCode, std::string what, std::string remedy = {});

std::string text(const char* string);  ///< null: empty
std::string number(double value);
std::string joined(const std::vector<std::string>& items);
/// Frees Aravis's arrays of borrowed strings.
std::vector<std::string> taken(const char** names, guint count);

/// Returns early when asked to stop.
void pauseUntil(std::int64_t until_ns, const std::stop_token& stop);

// ---- aravis_network.cpp: answers

/// Keeps answers that are not the camera's from its control channel, and has it given back by a process that aborts.
/// Aravis hides the socket, which is told by being new: to be made before the camera is opened, by the only thread that
/// opens sockets. What is read while it is opened, its description, is not guarded.
class ControlGuard {
 public:
  ControlGuard();
  ControlGuard(const ControlGuard&) = delete;
  ControlGuard& operator=(const ControlGuard&) = delete;
  ~ControlGuard();
  tl::expected<void, Error> guard(ArvGvDevice* device);
  /// The device will be closed: a process that ends by a signal no longer says so to the camera.
  void disarm();
  /// Datagrams that the kernel kept from it; as long as the device is open.
  std::uint64_t refused() const;

 private:
  std::vector<std::uint64_t> before_;  ///< inodes of the sockets that there were
  int descriptor_ = -1;
};

// ---- aravis_find.cpp

/// EX_UNAVAILABLE: it is not there, or does not answer. EX_TEMPFAIL: another client holds it, and did not leave within
/// 8 s, longer than a camera keeps to a client that died (3 s by default). EX_NOPERM: its USB device may not be opened.
/// \param guard made before; guards a GigE Vision camera from here on
tl::expected<Ref<ArvCamera>, Error> connectCamera(const CameraOptions& options, const Opening& opening,
                                                  ControlGuard& guard);

/// Reads the names of an open camera. `id` is "vendor-model-serial"; `address` is the IPv4 address of a GigE Vision
/// camera; `protocol` is "GigEVision", "USB3Vision" or "Fake"; `physicalId` stays empty. A name that cannot be read
/// stays empty, without an error.
CameraName nameOf(ArvCamera* camera);

// ---- aravis_feature.cpp

/// Writes one feature, waits for a command to be done; the line for the list of settings. EX_CONFIG names what would be
/// allowed, EX_UNAVAILABLE: the camera does not answer.
tl::expected<std::string, Error> writeFeature(ArvDevice* device, const Feature& feature);
/// What writing it again would bring back; none: a command, or it cannot be read or written now.
std::optional<Feature> standingAt(ArvDevice* device, const char* name);
bool hasFeature(ArvDevice* device, const char* name);
/// The first of these that the camera has; empty: none.
std::string firstFeature(ArvDevice* device, std::initializer_list<const char*> names);
/// The text of an element within a node of the camera's description; empty: there is none.
std::string elementText(ArvGcNode* node, const char* element);
/// Empty: it has no such feature, or it cannot be read now.
std::string readFeature(ArvDevice* device, const std::string& name);
/// The answer to a question of people's. \param configured what the configuration sets
tl::expected<CameraReport, std::string> serveFeatures(ArvCamera* camera, const CameraStep& step,
                                                      const std::vector<Feature>& configured,
                                                      std::vector<std::pair<std::string, std::string>>& first);

/// A quantity that cameras spell in several ways, in one unit: ExposureTime, ExposureTimeAbs in us; Gain, GainRaw.
struct Quantity {
  std::string feature;   ///< the first of its names that the camera has; empty: none
  double perUnit = 1.0;  ///< the camera's number for one of ours
};
Quantity exposureOf(ArvDevice* device);
Quantity gainOf(ArvDevice* device);
std::optional<double> readQuantity(ArvDevice* device, const Quantity& quantity);

// ---- aravis_settings.cpp

/// Makes every setting in order; adds what the camera made of them to the info. \param before what the session before
/// this one found the camera at: kept where the configuration leaves it open. \param undo written in reverse, it brings
/// back what the camera stood at before, but for what commands have done
tl::expected<void, Error> applySettings(ArvCamera* camera, const CameraOptions& options, const Standing* before,
                                        CameraInfo& info, std::vector<Feature>& undo);

/// A format as the camera spells it, with its code where that cannot be read.
std::string formatInWords(const std::string& name, std::int64_t code);
/// What the camera offers now, in words; and those of them that can be read, the best first.
std::vector<std::string> offeredFormats(ArvCamera* camera);
std::vector<const PixelFormatTraits*> readableFormats(ArvCamera* camera);
/// The best: as few bytes as colours need, then as few bits.
void bestFirst(std::vector<const PixelFormatTraits*>& formats);

// ---- aravis_read.cpp

/// The picture as it will be sent; enters it, rate and exposure in the info. EX_CONFIG: a format that cannot be read.
tl::expected<void, Error> readPicture(ArvCamera* camera, CameraInfo& info);

/// Reads packet counters, which are added to those of `before`, PTP and temperature; registers that the camera does not
/// have stay empty. Of a camera that is gone each register takes seconds: reads no further one once it is known to be
/// lost.
CameraLink readLink(ArvCamera* camera, ArvStream* stream, const ControlGuard& guard, const CameraLink& before,
                    const std::function<bool()>& isLost);

// ---- aravis_clock.cpp

/// Asks a camera what its clock shows, eight times a second, on a thread of its own, "camera-clock": a camera that
/// hangs keeps Aravis waiting for seconds, and whoever asks it.
class AskedClock {
 public:
  /// None: the camera's description knows of no latch for its clock, or the camera refuses. Takes three answers. The
  /// device outlives this.
  static std::unique_ptr<AskedClock> open(ArvDevice* device);

  /// The newest answers; false: there are none since. For one thread, waits for nobody.
  bool take(ClockFit& fit) { return fit_.take(fit); }

 private:
  AskedClock() = default;
  void run(const std::stop_token& stop, ClockAsker asker);

  Mailbox<ClockFit> fit_;
  std::jthread thread_;  ///< the last member: it ends first
};

// ---- camera_list.cpp

/// Vendor and model by the camera's description.
std::pair<std::string, std::string> makeOf(ArvDevice* device);
/// Empty: nothing is known against it.
std::string byteOrderNote(ArvDevice* device);

// ---- aravis_network.cpp

/// To be tried in turn, from the largest that the interface carries to the safest.
tl::expected<std::vector<int>, Error> packetSizes(ArvCamera* camera, const CameraOptions& options);

/// Returns what the kernel granted.
int setReceiveBuffer(ArvStream* stream, int size_bytes);

/// From here on the kernel lets through to the stream what its camera can have sent, and nothing that came before is
/// left. To be called before the stream has buffers: until then Aravis throws away every packet.
tl::expected<void, Error> guardStream(ArvStream* stream, const StreamShape& shape);
/// Packets that the kernel kept from the stream: not the camera's, or there was no room for them.
std::uint64_t packetsRefused(ArvStream* stream);

/// Received by the kernel, and not yet by Aravis.
std::uint32_t bytesWaiting(ArvStream* stream);
/// As far as the camera says.
StreamShape streamShape(ArvCamera* camera, int packetSize_bytes, std::size_t payload_bytes);

bool packetSocketAllowed();

/// Empty if the kernel gives USB devices that much.
std::string usbMemoryWarning(std::size_t needed_bytes);

}  // namespace tractiond::capture
