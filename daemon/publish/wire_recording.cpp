#include "daemon/publish/wire_recording.h"

#include "daemon/publish/wire_parts.h"
#include "recording/deltas.h"
#include "traction/v1/recording.pb.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace tractiond::publish {

namespace pb = traction::v1;

namespace {

constexpr std::uint32_t kVersion = 3;
constexpr int kLargestSide_px = 65'535;
constexpr std::size_t kLargestPicture = std::size_t{1} << 29;

tl::unexpected<Error> damaged(const std::string& what) {
  return tl::unexpected(Error{.exitCode = EX_DATAERR, .what = what});
}

void set(const Id& from, std::string& to) {
  to.assign(reinterpret_cast<const char*>(from.data()), from.size());
}

bool get(const std::string& from, Id& to) {
  if (from.size() != to.size()) return false;
  std::memcpy(to.data(), from.data(), to.size());
  return true;
}

void set(const RestPose& from, pb::Rest& to) {
  to.mutable_position_px()->Assign(from.position_px.begin(), from.position_px.end());
  to.mutable_amplitude()->Assign(from.amplitude.begin(), from.amplitude.end());
  to.mutable_present()->assign(from.present.begin(), from.present.end());
  to.mutable_oddity()->Assign(from.oddity.begin(), from.oddity.end());
  to.set_noise(from.noise);
  to.set_shot_noise(from.shotNoise);
  to.set_light(from.light);
  to.mutable_cross_talk()->Assign(from.crossTalk.begin(), from.crossTalk.end());
  to.set_time_ns(from.taken_ns);
  to.set_requested(from.requested);
  to.set_requested_by(from.requestedBy);
  set(from.id, *to.mutable_id());
}

/// False: its sizes do not fit each other.
bool get(const pb::Rest& from, RestPose& to) {
  const auto markers = static_cast<std::size_t>(from.amplitude_size());
  if (static_cast<std::size_t>(from.position_px_size()) != 2 * markers || from.present().size() != markers ||
      (from.oddity_size() != 0 && static_cast<std::size_t>(from.oddity_size()) != markers) ||
      static_cast<std::size_t>(from.cross_talk_size()) != to.crossTalk.size() || !get(from.id(), to.id)) {
    return false;
  }
  to.position_px.assign(from.position_px().begin(), from.position_px().end());
  to.amplitude.assign(from.amplitude().begin(), from.amplitude().end());
  to.present.assign(from.present().begin(), from.present().end());
  to.oddity.assign(from.oddity().begin(), from.oddity().end());
  to.noise = from.noise();
  to.shotNoise = from.shot_noise();
  to.light = from.light();
  std::ranges::copy(from.cross_talk(), to.crossTalk.begin());
  to.taken_ns = from.time_ns();
  to.requested = from.requested();
  to.requestedBy = from.requested_by();
  return true;
}

void set(const TrackerInputs& from, pb::Inputs& to) {
  to.set_zero_begun(from.zeroBegun);
  to.set_zero_ended(from.zeroEnded);
  to.set_zero_forgone(from.zeroForgone);
  if (from.adopted) set(from.zero, *to.mutable_put_back());
  if (!from.compared) return;
  set(from.comparedZero, *to.mutable_judged());
  to.set_fits(from.fits);
}

bool get(const pb::Inputs& from, TrackerInputs& to) {
  to.clear();
  to.zeroBegun = from.zero_begun();
  to.zeroEnded = from.zero_ended();
  to.zeroForgone = from.zero_forgone();
  to.adopted = from.has_put_back();
  to.compared = !from.judged().empty();
  to.fits = from.fits();
  return (!to.adopted || get(from.put_back(), to.zero)) && (!to.compared || get(from.judged(), to.comparedZero));
}

void get(const pb::Header& from, FrameInfo& to) {
  to = {};
  to.cameraFrameId = from.camera_frame_id();
  to.frameNumber = from.frame_number();
  to.exposure_s = from.exposure_s();
  to.extras.hasGain = from.has_gain();
  to.extras.gain = from.gain();
  to.extras.hasLines = from.has_line_status();
  to.extras.lines = from.line_status();
  to.extras.hasTemperature = from.has_camera_temperature();
  to.extras.temperature_C = from.camera_temperature();
  to.discontinuity = (from.flags() & kDiscontinuity) != 0;
  to.doubted = (from.flags() & kDoubtedOrigin) != 0;
  to.times.device_ns = from.device_time_ns();
  to.times.received_ns = from.received_ns();
  to.times.receivedReal_ns = from.received_real_ns();
  to.times.captured_ns = from.captured_ns();
  to.times.capturedError_ns = from.captured_error_ns();
  if (pb::CaptureBound_IsValid(from.captured_bound()))
    to.times.capturedBound = static_cast<CaptureBound>(from.captured_bound());
}

/// Bytes from a sample to the next of the same colour in its row; 1 where samples share bytes.
std::uint32_t deltaOf(const PixelFormatTraits& format) {
  if (format.packing != PixelPacking::kWhole) return 1;
  return static_cast<std::uint32_t>(format.bitsPerPixel / 8) * (format.isBayer() ? 2 : 1);
}

/// That a picture has at least; 0: no picture has these numbers.
std::size_t bytesOf(const PixelFormatTraits& format, int width, int height, std::uint32_t stride) {
  if (stride == 0) return format.stride(width) == 0 ? format.size(width, height) : 0;
  const std::size_t row = format.size(width, 1);
  return stride < row ? 0 : std::size_t{stride} * static_cast<std::size_t>(height - 1) + row;
}

}  // namespace

std::string encode(const Beginning& beginning) {
  pb::Beginning message = beginning.message;
  message.set_version(kVersion);
  message.clear_rest();
  if (beginning.rest) set(*beginning.rest, *message.mutable_rest());
  return message.SerializeAsString();
}

tl::expected<Beginning, Error> decodeBeginning(std::string_view bytes) {
  Beginning beginning;
  const pb::Beginning& message = beginning.message;
  if (!beginning.message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return damaged("what it says of its sensor is damaged");
  if (message.version() > kVersion) {
    return tl::unexpected(Error{.exitCode = EX_PROTOCOL,
                                .what = "is of version " + std::to_string(message.version()) +
                                        ", and this program reads " + std::to_string(kVersion),
                                .remedy = "replay it with a newer tractiond"});
  }
  if (message.has_rest() && !get(message.rest(), beginning.rest.emplace()))
    return damaged("the zero that it begins with is damaged");
  if (message.calibration().size() != sizeof(Id)) return damaged("what it says of its sensor is damaged");
  return beginning;
}

PictureMessage::PictureMessage(const Identity& identity)
    : message_(std::make_unique<pb::Picture>()) {
  publish::encode(identity, *message_->mutable_header());
}

PictureMessage::~PictureMessage() = default;

const std::string& PictureMessage::encode(const TrackedFrame& from, bool packed) {
  const Frame& frame = from.frame;
  pb::Picture& message = *message_;
  Heading heading;
  heading.sequence = from.number;
  heading.frame = frame.info;
  heading.frame.times.tracked_ns = heading.frame.times.solved_ns = 0;
  heading.flags = (frame.info.discontinuity ? kDiscontinuity : 0U) | (frame.info.doubted ? kDoubtedOrigin : 0U);
  publish::encode(heading, *message.mutable_header());
  message.set_width(static_cast<std::uint32_t>(frame.width));
  message.set_height(static_cast<std::uint32_t>(frame.height));
  message.set_pixel_format(static_cast<std::uint32_t>(frame.format));
  message.set_stride_bytes(static_cast<std::uint32_t>(frame.stride));
  message.set_size_bytes(static_cast<std::uint32_t>(frame.size));
  const std::string_view pixels(reinterpret_cast<const char*>(frame.data), frame.size);
  const std::uint32_t delta = deltaOf(traitsOf(frame.format));
  if (packed && recording::packDeltas(pixels, delta, scratch_, *message.mutable_pixels())) {
    message.set_delta_bytes(delta);
  } else {
    message.mutable_pixels()->assign(pixels);
    message.clear_delta_bytes();
  }
  message.clear_places();
  if (from.places != Id{}) set(from.places, *message.mutable_places());
  message.clear_inputs();
  if (from.inputs.any()) set(from.inputs, *message.mutable_inputs());
  message.SerializeToString(&bytes_);
  return bytes_;
}

tl::expected<void, Error> decodePicture(std::string_view bytes, TrackedFrame& to) {
  pb::Picture message;
  if (bytes.size() > std::numeric_limits<int>::max() ||
      !message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return damaged("a picture is damaged");
  const PixelFormatTraits* const format = pixelFormatByCode(message.pixel_format());
  if (format == nullptr) return damaged("a picture has a pixel format that is not known here");
  const auto isSide = [](std::uint32_t side) { return side >= 1 && side <= kLargestSide_px; };
  if (!isSide(message.width()) || !isSide(message.height()) || message.size_bytes() > kLargestPicture ||
      message.stride_bytes() > kLargestPicture)
    return damaged("a picture is damaged: no picture is of that size");
  Frame& frame = to.frame;
  frame = {};
  frame.width = static_cast<int>(message.width());
  frame.height = static_cast<int>(message.height());
  frame.stride = static_cast<int>(message.stride_bytes());
  frame.size = message.size_bytes();
  frame.format = format->format;
  const std::size_t least = bytesOf(*format, frame.width, frame.height, message.stride_bytes());
  if (least == 0 || frame.size < least) return damaged("a picture is damaged: it has fewer bytes than pixels");
  to.bytes.resize(frame.size);
  const bool filled = message.delta_bytes() == 0
                          ? message.pixels().size() == frame.size
                          : recording::unpackDeltas(message.pixels(), message.delta_bytes(), to.bytes);
  if (!filled) return damaged("a picture is damaged: its pixels are not all there");
  if (message.delta_bytes() == 0) std::memcpy(to.bytes.data(), message.pixels().data(), frame.size);
  frame.data = to.bytes.data();
  get(message.header(), frame.info);
  to.number = message.header().sequence();
  to.fits = true;
  to.places = {};
  if (!get(message.inputs(), to.inputs) || (!message.places().empty() && !get(message.places(), to.places)))
    return damaged("what a picture says of a zero is damaged");
  return {};
}

}  // namespace tractiond::publish
