#include "lens/rest_markers.h"

#include "daemon/track/nominal.h"
#include "daemon/track/tracker.h"

#include <algorithm>
#include <utility>

namespace lens {

namespace {

constexpr int kZeroFrames = 4;  // the same picture, this many times
constexpr int kPatience = 100;  // frames: the tracker pauses between searches of the whole picture

tl::unexpected<tractiond::Error> refuse(std::string what, std::string remedy) {
  return tl::unexpected(
      tractiond::Error{.exitCode = EX_DATAERR, .what = std::move(what), .where = "", .remedy = std::move(remedy)});
}

}  // namespace

int RestMarkers::count() const {
  return static_cast<int>(std::ranges::count(present, 1));
}

tl::expected<RestMarkers, tractiond::Error> findMarkers(const cv::Mat& picture, const sensor::Sensor& sensor) {
  using namespace tractiond;
  if (picture.cols != sensor.camera.width || picture.rows != sensor.camera.height) {
    return refuse("has " + std::to_string(picture.cols) + " x " + std::to_string(picture.rows) +
                      " px, the gel file's camera " + std::to_string(sensor.camera.width) + " x " +
                      std::to_string(sensor.camera.height),
                  "take the picture at that size, or write its size into the gel file");
  }
  const bool isGrey = picture.channels() == 1;
  const PixelFormat format = isGrey ? PixelFormat::kMono8 : PixelFormat::kBgr8;
  for (const auto& able : {track::trackable(sensor), track::trackable(sensor, format)}) {
    if (!able) return refuse("cannot be searched: " + able.error().what, able.error().remedy);
  }
  const cv::Mat whole = picture.isContinuous() ? picture : picture.clone();

  Frame frame;
  frame.data = whole.data;
  frame.width = whole.cols;
  frame.height = whole.rows;
  frame.stride = (isGrey ? 1 : 3) * whole.cols;
  frame.size = static_cast<std::size_t>(frame.stride) * static_cast<std::size_t>(frame.height);
  frame.format = format;
  track::TrackOptions options;
  options.zeroFrames = kZeroFrames;
  options.minValidFraction = 0.3;
  track::Tracker tracker(sensor, options);
  MarkerField field;
  field.resize(sensor.markerCount());
  RestPose rest;
  for (int i = 0; i < kPatience; ++i) {
    frame.info.frameNumber = frame.info.cameraFrameId = static_cast<std::uint64_t>(i + 1);
    tracker.track(frame, field);
    if (tracker.takeRestPose(rest)) return RestMarkers{rest.position_px, rest.present};
  }
  return refuse("shows too few markers of this gel in their order",
                "is it this gel, sharp, untouched, lit in the markers' colours?");
}

}  // namespace lens
