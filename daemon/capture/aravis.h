// Helpers shared by the files that use Aravis. Internal to this folder.
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

/// Deleter of a GObject.
struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using Ref = std::unique_ptr<T, Unref>;

/// Owns a GError. into() is passed as the last argument of Aravis's functions.
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
  /// Returns whether the camera did not answer, which is not a refusal.
  bool noAnswer() const;

 private:
  GError* error_ = nullptr;
};

tl::unexpected<Error> failed(int exitCode, std::string what, std::string remedy = {});

std::string text(const char* string);  ///< Returns an empty string for nullptr.
std::string number(double value);
std::string joined(const std::vector<std::string>& items);
/// Copies an array of strings that Aravis lent, and frees the array.
std::vector<std::string> taken(const char** names, guint count);

/// Sleeps until `until_ns`, or until a stop is requested.
void pauseUntil(std::int64_t until_ns, const std::stop_token& stop);

// ---- aravis_network.cpp: answers

/// Keeps answers of other senders from a camera's control channel, and lets a process that aborts release the camera.
/// Aravis hides the socket; it is recognised as the new one. Must therefore be created before the camera is opened, by
/// the only thread that opens sockets. The description, which is read while the camera is opened, is not guarded.
class ControlGuard {
 public:
  ControlGuard();
  ControlGuard(const ControlGuard&) = delete;
  ControlGuard& operator=(const ControlGuard&) = delete;
  ~ControlGuard();
  tl::expected<void, Error> guard(ArvGvDevice* device);
  /// Must be called before the device is closed: a process that ends by a signal then no longer releases the camera.
  void disarm();
  /// Returns the number of datagrams that the kernel has dropped. The device must be open.
  std::uint64_t refused() const;

 private:
  std::vector<std::uint64_t> before_;  ///< inodes of the sockets that were open before
  int descriptor_ = -1;
};

// ---- aravis_find.cpp

/// Opens a camera. Errors: EX_UNAVAILABLE if it is absent or does not answer; EX_TEMPFAIL if another client controls it
/// for longer than 8 s, which is more than the heartbeat timeout of a client that died (3 s by default); EX_NOPERM if
/// its USB device may not be opened. \param guard created before the call; guards a GigE Vision camera from here on
tl::expected<Ref<ArvCamera>, Error> connectCamera(const CameraOptions& options, const Opening& opening,
                                                  ControlGuard& guard);

/// Reads the names of an open camera. `id` is "vendor-model-serial"; `address` is the IPv4 address of a GigE Vision
/// camera; `protocol` is "GigEVision", "USB3Vision" or "Fake"; `physicalId` stays empty. A name that cannot be read
/// stays empty, without an error.
CameraName nameOf(ArvCamera* camera);

// ---- aravis_feature.cpp

/// Writes one feature; waits until a command is done. Returns a line for the list of settings. Errors: EX_CONFIG with
/// the values that are allowed; EX_UNAVAILABLE if the camera does not answer.
tl::expected<std::string, Error> writeFeature(ArvDevice* device, const Feature& feature);
/// Returns the value of a feature, for restoring it; none for a command, or if it cannot be read or written now.
std::optional<Feature> standingAt(ArvDevice* device, const char* name);
bool hasFeature(ArvDevice* device, const char* name);
/// Returns the first of these features that the camera has; empty: it has none.
std::string firstFeature(ArvDevice* device, std::initializer_list<const char*> names);
/// Returns the text of an element within a node of the camera's description; empty: there is none.
std::string elementText(ArvGcNode* node, const char* element);
/// Returns a feature's value; empty: there is no such feature, or it cannot be read now.
std::string readFeature(ArvDevice* device, const std::string& name);
/// Answers an operator's request. \param configured features that the configuration sets
/// \param first names and values of features before requests changed them
tl::expected<CameraReport, std::string> serveFeatures(ArvCamera* camera, const CameraStep& step,
                                                      const std::vector<Feature>& configured,
                                                      std::vector<std::pair<std::string, std::string>>& first);

/// A quantity that cameras name in several ways, in one unit: ExposureTime, ExposureTimeAbs in us; Gain, GainRaw.
struct Quantity {
  std::string feature;   ///< name in this camera; empty: the camera lacks it
  double perUnit = 1.0;  ///< the camera's number per unit of ours
};
Quantity exposureOf(ArvDevice* device);
Quantity gainOf(ArvDevice* device);
std::optional<double> readQuantity(ArvDevice* device, const Quantity& quantity);

// ---- aravis_settings.cpp

/// Writes every setting in order, and adds the values that the camera accepted to the info. \param before values that
/// the session before found: kept where the configuration leaves them open. \param undo the earlier values; writing
/// them in reverse order restores the camera, except for the effects of commands
tl::expected<void, Error> applySettings(ArvCamera* camera, const CameraOptions& options, const Standing* before,
                                        CameraInfo& info, std::vector<Feature>& undo);

/// Returns the camera's name of a format, with its code if the format cannot be read.
std::string formatInWords(const std::string& name, std::int64_t code);
/// Return the formats that the camera offers now: all of them, in words; those that can be read, best first.
std::vector<std::string> offeredFormats(ArvCamera* camera);
std::vector<const PixelFormatTraits*> readableFormats(ArvCamera* camera);
/// Sorts formats by preference: those of few bytes that keep the colours first, then by their number of bits.
void bestFirst(std::vector<const PixelFormatTraits*>& formats);

// ---- aravis_read.cpp

/// Reads size and format of the pictures, frame rate and exposure into the info. Error: EX_CONFIG if the format cannot
/// be read.
tl::expected<void, Error> readPicture(ArvCamera* camera, CameraInfo& info);

/// Reads packet counters, which are added to those of `before`, PTP and temperature. Values that the camera lacks stay
/// empty. Each register of a camera that is gone takes seconds: reads no further one once isLost() returns true.
CameraLink readLink(ArvCamera* camera, ArvStream* stream, const ControlGuard& guard, const CameraLink& before,
                    const std::function<bool()>& isLost);

// ---- aravis_clock.cpp

/// Reads a camera's clock eight times a second, on the thread "camera-clock": a read of a camera that hangs blocks for
/// seconds.
class AskedClock {
 public:
  /// Starts to read the clock, which takes three answers. Returns nullptr if the camera's description has no latch for
  /// the clock, or the camera refuses. The device must outlive this.
  static std::unique_ptr<AskedClock> open(ArvDevice* device);

  /// Takes the newest answers. Returns false if there are none since the last call. For one thread; does not wait.
  bool take(ClockFit& fit) { return fit_.take(fit); }

 private:
  AskedClock() = default;
  void run(const std::stop_token& stop, ClockAsker asker);

  Mailbox<ClockFit> fit_;
  std::jthread thread_;  ///< the last member, as it uses the others
};

// ---- camera_list.cpp

/// Returns vendor and model by the camera's description.
std::pair<std::string, std::string> makeOf(ArvDevice* device);
/// Returns a warning about the byte order of the camera's registers; empty: there is no reason for one.
std::string byteOrderNote(ArvDevice* device);

// ---- aravis_network.cpp

/// Returns the packet sizes to try in turn, from the largest that the interface carries to the safest [bytes].
tl::expected<std::vector<int>, Error> packetSizes(ArvCamera* camera, const CameraOptions& options);

/// Sets the size of the socket's receive buffer. Returns the size that the kernel granted [bytes].
int setReceiveBuffer(ArvStream* stream, int size_bytes);

/// Lets the kernel drop each datagram that the stream's camera cannot have sent, and drops those that have arrived.
/// Must be called before the stream has buffers: until then Aravis discards every packet.
tl::expected<void, Error> guardStream(ArvStream* stream, const StreamShape& shape);
/// Returns the number of packets that the kernel dropped: from another sender, or without room in the buffer.
std::uint64_t packetsRefused(ArvStream* stream);

/// Returns the number of bytes that the kernel has received and Aravis has not read yet.
std::uint32_t bytesWaiting(ArvStream* stream);
/// Returns the shape of the stream, as far as the camera tells it.
StreamShape streamShape(ArvCamera* camera, int packetSize_bytes, std::size_t payload_bytes);

bool packetSocketAllowed();

/// Returns a warning if the kernel grants USB devices less memory than that; else empty.
std::string usbMemoryWarning(std::size_t needed_bytes);

}  // namespace tractiond::capture
