// Declares what the files that include Aravis share. Internal to this folder.
//
// Functions without a remark on errors do not fail: what cannot be read is left empty. Those that take a camera, device
// or stream borrow it, may ask the camera over the network, and block until it answers or Aravis gives up.
#pragma once

#include "base/aravis_versions.h"
#include "base/error.h"
#include "base/mailbox.h"
#include "daemon/capture/camera_info.h"
#include "daemon/capture/camera_options.h"
#include "daemon/capture/clock_asker.h"
#include "daemon/capture/driver.h"
#include "daemon/capture/packet_survey.h"
#include "daemon/capture/stream_filter.h"
#include "daemon/records/camera_features.h"

#include <arv.h>
#include <tl/expected.hpp>

#include <atomic>
#include <chrono>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace tractiond::capture {

/// Drops a reference to a GObject.
struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using Ref = std::unique_ptr<T, Unref>;

/// Owns a GError. into() is the last argument of Aravis's functions; it discards the error before. Converts to true if
/// there is an error; text() is its message, "unknown error" without one.
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
  std::string text() const;
  /// Returns whether the camera did not answer, as opposed to refusing. False without an error.
  bool noAnswer() const;
  /// Returns EX_UNAVAILABLE if the camera did not answer, else EX_CONFIG: it refuses.
  int exitCode() const;
  /// Returns whether the camera is there, but has no description that Aravis can read. False without an error.
  bool noDescription() const;

 private:
  GError* error_ = nullptr;
};

/// Makes an error without a place (Error::where).
/// \param exitCode of sysexits.h
/// \param remedy may be empty
tl::unexpected<Error> failed(int exitCode, std::string what, std::string remedy = {});

/// Copies a string that may come from a camera, with U+FFFD in place of what is not UTF-8; nullptr becomes an empty
/// one.
std::string text(const char* string);
/// Returns a number as text ("%.10g").
std::string number(double value);
std::string joined(const std::vector<std::string>& items);  ///< Joins texts with ", ".
/// Copies the `count` strings of an array that Aravis has returned, each as text() does, and frees the array, but not
/// the strings, which Aravis owns.
/// \param names nullptr: no strings
std::vector<std::string> taken(const char** names, guint count);

/// Waits until a time of CLOCK_MONOTONIC [ns]; not at all if that has passed. Returns early when a stop is requested.
void pauseUntil(std::int64_t until_ns, const std::stop_token& stop);

// ---- aravis_network.cpp: answers

/// Keeps answers of other hosts from the camera's control channel. Aravis hides the socket; the guard finds it as the
/// one opened since the guard was made. So it must be made before the camera is opened, on the only thread that opens
/// sockets. What is read while the camera is opened (its description) is not guarded. Thread-bound.
class ControlGuard {
 public:
  /// Notes which sockets this process has open.
  ControlGuard();
  /// Guards the socket of a device that was opened since: lets the kernel pass only datagrams that the camera
  /// sends (senderFilter()), and discards those that came before. Fails with EX_OSERR: the socket was not found, or
  /// takes no filter.
  tl::expected<void, Error> guard(ArvGvDevice* device);
  /// Returns the number of datagrams that the kernel rejected; 0 without a guarded device, which must be open.
  std::uint64_t refused() const;

 private:
  std::vector<std::uint64_t> before_;  ///< inodes of the sockets that were open before
  int descriptor_ = -1;
};

// ---- aravis_find.cpp

bool isAddress(const std::string& id);  ///< Returns whether a text is an IPv4 address.
/// Returns what Aravis opens a listed camera by: its address, as two cameras may have one id, or else its id.
std::string handleOf(const CameraName& camera);

/// Finds the camera that CameraOptions::id names and opens it, after CameraOptions::inspector, if there is one, has
/// evaluated its description (not with CameraOptions::fakeInterface). Another client may hold it. Blocks for seconds.
/// EX_UNAVAILABLE: the camera is absent, does not answer, may not be opened, has a faulty description, or a stop was
/// requested while that was evaluated.
tl::expected<Ref<ArvCamera>, Error> findCamera(const CameraOptions& options, const std::stop_token& stop);

/// Does as findCamera(). For a GigE Vision camera, then also guards its control channel, takes control, and stops an
/// acquisition that an earlier client left running. EX_TEMPFAIL: another client holds it and has not left within 8 s of
/// the call (a camera keeps to a dead client for 3 s by default), or a stop was requested meanwhile. EX_OSERR: the
/// guard failed.
/// \param opening `stop` ends both waits early, `say` is called with a sentence about another client
/// \param guard made before this call
tl::expected<Ref<ArvCamera>, Error> connectCamera(const CameraOptions& options, const Opening& opening,
                                                  ControlGuard& guard);

/// Reads the names of an open camera. `id` is "vendor-model-serial"; `address` is the IPv4 address of a GigE Vision
/// camera; `protocol` is "GigEVision", "USB3Vision" or "Fake"; `physicalId` stays empty. A name that cannot be read
/// stays empty, without an error.
CameraName nameOf(ArvCamera* camera);

// ---- aravis_feature.cpp

/// Returns a feature's value as text: a number ("%.10g"), true or false, or the text itself.
std::string textOf(const Feature& feature);
/// Returns the entries of an enumeration that the camera offers now; empty if it has none.
std::vector<std::string> offeredEntries(ArvDevice* device, const char* name);
/// Writes one feature, also one whose value is given as text, and reads it back, or executes a command and waits up to
/// 10 s until it is done. Returns the line for CameraInfo::settings: "Name = value" as read back, with "(asked: value)"
/// if the camera has rounded a number, or "Name executed". EX_CONFIG: the camera lacks the feature or refuses, or a
/// text or switch reads back differently; the error states what is allowed. EX_UNAVAILABLE: no answer, or the command
/// is not done after 10 s.
tl::expected<std::string, Error> writeFeature(ArvDevice* device, const Feature& feature);
/// Returns a feature with its present value as text, which restores it when written. Returns nothing for a command, and
/// a feature that is absent, not available now, read-only, empty, or cannot be read. One that is locked now is
/// returned.
std::optional<Feature> standingAt(ArvDevice* device, const char* name);
/// Returns whether the camera has the feature and it is available now.
bool hasFeature(ArvDevice* device, const char* name);
/// Returns the first of these names that hasFeature(); empty if the camera has none.
std::string firstFeature(ArvDevice* device, std::initializer_list<const char*> names);
/// Returns the texts of the elements of these names directly in a node of the camera's description, without empty ones.
std::vector<std::string> elementTexts(ArvGcNode* node, std::initializer_list<const char*> names);
/// Returns the text of the first element of this name directly in a node of the camera's description; empty without
/// one.
std::string elementText(ArvGcNode* node, const char* element);
/// Returns a feature's value as text (of an enumeration the entry's name); empty if the camera has no such feature or
/// it cannot be read now.
std::string readFeature(ArvDevice* device, const std::string& name);
/// Carries out an operator's request to the camera, as its message states, and reports the features that it concerned,
/// as they are afterwards; for a command only a remark, for a trigger nothing. The error is a sentence: nothing
/// matches, the camera refuses or does not answer, or the name of a feature to write begins like one that changes the
/// picture's size, offset, format, binning or mirroring. "Feature[Choice]" sets the selector for as long as the request
/// lasts. Waits up to 10 s for a command, 5 s for the white balance.
/// \param configured what the configuration sets; is reported beside the values
/// \param first values before the first write of this session, by name; receives that of a feature written now
tl::expected<CameraReport, std::string> serveFeatures(ArvCamera* camera, const CameraStep& step,
                                                      const std::vector<Feature>& configured,
                                                      std::map<std::string, std::string>& first);

/// A quantity whose feature has several names and units among cameras. Its unit here: exposure in us, gain the
/// camera's.
struct Quantity {
  std::string feature;   ///< the first of its names that the camera has; empty: none
  double perUnit = 1.0;  ///< the camera's number for one unit: 1e-3 if it counts ms
};
/// Finds ExposureTime, ExposureTimeAbs or ExposureTimeRaw, and its unit by the description (else us).
Quantity exposureOf(ArvDevice* device);
Quantity gainOf(ArvDevice* device);  ///< Finds Gain, GainRaw or GainAbs.
/// Reads a quantity in its unit (exposure in us); returns nothing if the camera has none or it cannot be read.
std::optional<double> readQuantity(ArvDevice* device, const Quantity& quantity);

// ---- aravis_settings.cpp

/// Makes every setting in the order of CameraOptions, until one fails. If they name no pixel format and this program
/// cannot read the present one, sets the best that it can read (bestFirst()). Adds the values read back to
/// info.settings and deviations of more than 1 % to info.warnings; sets info.triggered if a trigger is on, also on
/// failure. EX_CONFIG: the camera refuses or lacks a setting; EX_UNAVAILABLE: it does not answer.
/// \param before rate, exposure and gain of the session before, restored where the configuration sets none; a camera
/// that refuses them is a warning; nullptr: no session before
/// \param undo features are added to it, also on failure; written in reverse order they restore the camera, except what
/// commands have done
tl::expected<void, Error> applySettings(ArvCamera* camera, const CameraOptions& options, const Standing* before,
                                        CameraInfo& info, std::vector<Feature>& undo);

/// Describes a pixel format: `name` if this program can read the format, else "NAME (0x0108000B)", or the code alone if
/// the name is empty.
/// \param name as the camera spells it
/// \param code of the PFNC
std::string formatInWords(const std::string& name, std::int64_t code);
/// Returns formatInWords() of each format that the camera offers now.
std::vector<std::string> offeredFormats(ArvCamera* camera);
/// Sorts formats: with colours before grey, then by few bits per sample, then by few bits per pixel.
void bestFirst(std::vector<const PixelFormatTraits*>& formats);

// ---- aravis_read.cpp

/// Reads the format and size of the picture that the camera will send into info.format and info.shape; rate, exposure
/// and gain into info.standing (not those that the camera controls automatically), frameRate_Hz and exposure_s.
/// info.triggered must be set: the rate of a triggered camera is 0. What the camera does not tell of the latter is left
/// open without an error. EX_CONFIG: this program cannot read the format. EX_UNAVAILABLE: the camera does not tell
/// format or size, or claims a side that cannot be (not 1 to 65535 px).
tl::expected<void, Error> readPicture(ArvCamera* camera, CameraInfo& info);

/// Reads packet counters of a GigE Vision stream, which are added to those of `before`, PTP and temperature. Values
/// that the camera lacks stay empty. Each register of a camera that is gone takes seconds: reads no further one once
/// one of `lost` is set.
CameraLink readLink(ArvCamera* camera, ArvStream* stream, const ControlGuard& guard, const CameraLink& before,
                    std::initializer_list<const std::atomic<bool>*> lost);

// ---- aravis_clock.cpp

/// Reads a camera's clock on a thread of its own, "camera-clock", as a camera that hangs makes each reading wait for
/// seconds: up to 200 times a second at first, sixteen times from the fifth second on, once a second while there is no
/// answer.
class AskedClock {
 public:
  /// Reads the clock three times and starts the thread. Returns nullptr if the clock cannot be read: the camera is
  /// neither GigE nor USB3 Vision, its description has no latch, it states no usable frequency, refuses, or does not
  /// answer in time, or the clock stands still. Waits until the camera has answered. The device must outlive the
  /// result.
  static std::unique_ptr<AskedClock> open(ArvDevice* device);

  /// Copies the fit to all readings so far into `fit`. Returns false, and leaves `fit` as it is, if no reading was
  /// added since the last call. For one thread; does not wait. The destructor waits for a reading that has begun.
  bool take(ClockFit& fit) { return fit_.take(fit); }

 private:
  AskedClock() = default;
  void run(const std::stop_token& stop, ClockAsker asker);

  Mailbox<ClockFit> fit_;
  std::jthread thread_;  ///< the last member, as it uses the others
};

// ---- aravis_network.cpp

/// Returns the interfaces in whose networks an IPv4 address lies.
std::vector<std::string> interfacesTowards(const std::string& address);
/// Returns a sentence with the remedy if there are several of them; else an empty text.
std::string ambiguity(const std::string& address);

/// Returns the packet sizes to try in turn [bytes with headers]: the largest that interface and camera carry, at most
/// 9000, or 1500 if the interface's MTU is not known; then 1500 and 576, as far as they are smaller; each made even
/// (evenPacketSize()). Looks for it with test packets, if the camera sends them, and then leaves the camera with
/// another size: must be called without a stream, and a size be set afterwards. Only CameraOptions::packetSize_bytes if
/// that is set. EX_CONFIG if that exceeds the MTU, as far as known. For a GigE Vision camera.
tl::expected<std::vector<int>, Error> packetSizes(ArvCamera* camera, const CameraOptions& options);

/// Sets the size of a GigE Vision stream's receive buffer. Returns the size that the kernel granted [bytes]; 0: not
/// known.
int setReceiveBuffer(ArvStream* stream, int size_bytes);

/// Makes the kernel pass only packets to a GigE Vision stream that its camera can have sent (streamFilter()), and
/// discards those that came before. Must be called before the stream has buffers: until then Aravis discards every
/// packet. Fails with EX_OSERR.
tl::expected<void, Error> guardStream(ArvStream* stream, const StreamShape& shape);
/// Reads the stream's own packets, past the filter, until one frame has ended or `patience` is over: that frame is lost
/// to Aravis. Not for a stream that is lent. Attaches the filter for `shape` again. Fails as guardStream().
/// \param shape as of guardStream()
tl::expected<PacketSurvey, Error> surveyStream(ArvStream* stream, const StreamShape& shape,
                                               std::chrono::milliseconds patience);
/// Returns the number of packets that the kernel has dropped since a GigE Vision stream was opened: not the camera's,
/// or the receive buffer was full. 0 if it is not known.
std::uint64_t packetsRefused(ArvStream* stream);

/// Asks a GigE Vision camera for what its packets look like. A port that it does not report is 0.
/// \param packetSize_bytes with headers
/// \param payload_bytes of the largest frame, with chunk data
/// \param picture_bytes of it
StreamShape streamShape(ArvCamera* camera, int packetSize_bytes, std::size_t payload_bytes, std::size_t picture_bytes);

/// Returns a warning with its remedy if the kernel gives USB devices less memory than `needed_bytes`, that of all
/// buffers of the stream; else an empty text.
std::string usbMemoryWarning(std::size_t needed_bytes);

}  // namespace tractiond::capture
