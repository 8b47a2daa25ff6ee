#include "base/hash.h"
#include "daemon/track/rest_pose.h"
#include "daemon/track/rest_pose_file.h"
#include "tests/fuzz/target.h"

#include <filesystem>

namespace fuzz {
namespace {

using tractiond::PixelFormat;

sensor::Sensor smallSensor() {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) layer.columns = layer.rows = 4;
  return sensor;
}

const sensor::Sensor& theSensor() {
  static const sensor::Sensor sensor = smallSensor();
  return sensor;
}

}  // namespace

std::vector<std::string> seeds() {
  const auto markers = static_cast<std::size_t>(theSensor().markerCount());
  tractiond::RestPose pose;
  pose.position_px.assign(2 * markers, 100.0F);
  pose.amplitude.assign(markers, 50.0F);
  pose.present.assign(markers, 1);
  pose.noise = 1.0F;
  pose.requestedBy = "a test";
  pose.id = tractiond::track::idOf(pose);
  const auto path = std::filesystem::temp_directory_path() / ("zero-fuzz-" + std::to_string(getpid()));
  if (!tractiond::track::saveRestPose(path, pose, theSensor(), PixelFormat::kRgb8, "camera")) return {};
  std::string bytes = fileText(path);
  std::filesystem::remove(path);
  bytes.resize(bytes.size() - sizeof(tractiond::Hash128));
  return {bytes};
}

/// The bytes before the checksum, which is always right: else nothing behind it would ever be read.
bool feed(std::string_view bytes) {
  const tractiond::Hash128 checksum = tractiond::hash128(bytes.data(), bytes.size());
  const MemoryFile file(std::string(bytes).append(reinterpret_cast<const char*>(checksum.data()), checksum.size()));
  return tractiond::track::loadRestPose(file.path(), theSensor(), PixelFormat::kRgb8, "camera").has_value();
}

}  // namespace fuzz
