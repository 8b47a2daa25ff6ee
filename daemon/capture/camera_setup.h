// From the options to a camera that is ready to stream. Internal to this folder.
#pragma once

#include "daemon/base/error.h"
#include "daemon/capture/camera_info.h"
#include "daemon/capture/camera_options.h"
#include "daemon/capture/frame_gate.h"

#include <tl/expected.hpp>

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

// NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp): the C libraries' own names
struct _ArvCamera;
struct _ArvStream;
struct _GError;
// NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)

namespace tractiond::capture {

/// Of a GObject.
struct Unref {
  void operator()(void* object) const;
};
template <class T>
using Ref = std::unique_ptr<T, Unref>;

tl::unexpected<Error> failed(int exitCode, std::string what, std::string remedy = {});
/// Takes the reason, which may be null.
tl::unexpected<Error> failed(int exitCode, std::string what, _GError* reason);

using Say = std::function<void(const std::string& line)>;

/// EX_UNAVAILABLE: it is not there, or does not answer. EX_TEMPFAIL: another client holds it, and did not leave within
/// 8 s, longer than a camera keeps to a client that died (3 s by default).
tl::expected<Ref<_ArvCamera>, Error> connectCamera(const CameraOptions& options, const std::stop_token& stop,
                                                   const Say& say);

/// Names what Aravis has opened.
CameraName nameOf(_ArvCamera* camera);

/// Makes every setting in order; adds what the camera made of them to the info. EX_CONFIG names the one it refuses.
tl::expected<void, Error> applySettings(_ArvCamera* camera, const CameraOptions& options, CameraInfo& info);

/// The picture as it will be sent; enters it, rate and exposure in the info. EX_CONFIG: a format that cannot be read.
tl::expected<PictureShape, Error> readPicture(_ArvCamera* camera, CameraInfo& info);

/// To be tried in turn, from the largest that the interface carries to the safest.
tl::expected<std::vector<int>, Error> packetSizes(_ArvCamera* camera, const CameraOptions& options);

/// Returns what the kernel granted.
int setReceiveBuffer(_ArvStream* stream, int size_bytes);

bool packetSocketAllowed();

/// Empty if the kernel gives USB devices that much.
std::string usbMemoryWarning(std::size_t needed_bytes);

/// Returns early when asked to stop.
void pauseUntil(std::int64_t until_ns, const std::stop_token& stop);

}  // namespace tractiond::capture
