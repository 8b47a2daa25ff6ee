// The file has a header, arrays and a checksum of all bytes before it, in the byte order of the machine.
#include "daemon/track/rest_pose_file.h"

#include "base/files.h"
#include "base/hash.h"
#include "base/whole_file.h"
#include "daemon/track/rest_pose.h"
#include "sensor/measured_with.h"

#include <algorithm>
#include <cstring>

namespace tractiond::track {

namespace {

constexpr std::array<char, 8> kMagic = {'t', 'r', 'a', 'c', 'r', 'e', 's', 't'};
constexpr std::uint32_t kVersion = 4;
constexpr std::uint32_t kWithoutOddity = 3;  ///< the version without the oddity of each marker
constexpr std::size_t kLongestName = 4096;

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint32_t markers = 0;
  Id owner{};
  Id id{};
  std::int64_t taken_ns = 0;
  float noise = 0.0F, shotNoise = 0.0F, light = 0.0F;
  std::array<float, 2> crossTalk{};
  std::uint32_t requested = 0;
  std::uint32_t camera = 0;  ///< length of its name, behind the arrays [bytes]
  std::uint32_t asker = 0;   ///< length of the requester's name, behind that [bytes]
};
static_assert(sizeof(Header) == 88);  // no padding

template <typename T>
void append(std::vector<char>& bytes, const T* data, std::size_t count) {
  const auto* first = reinterpret_cast<const char*>(data);
  bytes.insert(bytes.end(), first, first + count * sizeof(T));
}

std::size_t bodySize(std::size_t markers, bool oddity) {
  return markers * ((oddity ? 4 : 3) * sizeof(float) + 1);
}

/// Returns the kind of a format; formats of one kind have the same levels at the same places.
int kindOf(PixelFormat format) {
  const PixelFormatTraits& traits = traitsOf(format);
  const int depth = 4 * (traits.bits - 8);
  if (traits.isBayer()) return depth + 1;
  if (traits.colours == PixelColours::kMono) return depth + 2;
  return depth + (traits.colours >= PixelColours::kYuyv ? 3 : 0);
}

/// \param next the bytes behind the header
RestPose poseOf(const Header& header, const char* next) {
  RestPose pose;
  pose.position_px.resize(2 * header.markers);
  pose.amplitude.resize(header.markers);
  pose.present.resize(header.markers);
  if (header.version == kVersion) pose.oddity.resize(header.markers);
  const auto read = [&next](auto& values) {
    std::memcpy(values.data(), next, values.size() * sizeof values[0]);
    next += values.size() * sizeof values[0];
  };
  read(pose.position_px);
  read(pose.amplitude);
  read(pose.present);
  if (!pose.oddity.empty()) read(pose.oddity);
  pose.noise = header.noise;
  pose.shotNoise = header.shotNoise;
  pose.light = header.light;
  pose.crossTalk = header.crossTalk;
  pose.taken_ns = header.taken_ns;
  pose.requested = header.requested != 0;
  pose.requestedBy.assign(next + header.camera, header.asker);
  pose.id = header.id;
  return pose;
}

}  // namespace

std::filesystem::path restPosePath(const std::filesystem::path& stateDirectory) {
  return stateDirectory / "rest.pose";
}

std::filesystem::path earlierPosePath(const std::filesystem::path& stateDirectory) {
  return stateDirectory / "earlier.pose";
}

Id restPoseOwner(const sensor::Sensor& sensor, PixelFormat format) {
  Hasher hasher;
  hasher.value(static_cast<std::uint64_t>(sensor.layers.size()));
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    hasher.value(layer.colour);
    hasher.value(layer.columns);
    hasher.value(layer.rows);
    hasher.value(layer.pitch);
    hasher.value(layer.depth);
    hasher.value(layer.diameter);
    hasher.value(layer.centre.x());
    hasher.value(layer.centre.y());
    if (layer.darker) hasher.value(layer.darker);
  }
  hasher.value(sensor.camera.width);
  hasher.value(sensor.camera.height);
  hasher.value(kindOf(format));
  return hasher.digest();
}

tl::expected<std::optional<RestPose>, Error> loadRestPose(const std::filesystem::path& path,
                                                          const sensor::Sensor& sensor, PixelFormat format,
                                                          const std::string& camera) {
  const auto refuse = [&path](int exitCode, const std::string& reason) {
    return tl::make_unexpected(
        Error{exitCode, "the rest pose " + reason, path.string(),
              "delete it; then, with the gel untouched, start and take a zero (tractionctl zero)"});
  };
  const auto bytes = readWholeFile(path);
  if (!bytes) {
    if (bytes.error() == std::errc::no_such_file_or_directory) return std::nullopt;
    return refuse(EX_NOINPUT, "cannot be read: " + bytes.error().message());
  }
  Header header;
  Hash128 checksum{};
  const std::size_t most = bytes->size() < sizeof header + sizeof checksum ? 0 : bytes->size() - sizeof checksum;
  if (most > 0) {
    std::memcpy(&header, bytes->data(), sizeof header);
    std::memcpy(checksum.data(), bytes->data() + most, sizeof checksum);
  }
  if (header.magic != kMagic || hash128(bytes->data(), most) != checksum) {
    return refuse(EX_DATAERR, "is damaged: its checksum does not fit");
  }
  if (header.version != kVersion && header.version != kWithoutOddity) {
    return refuse(EX_DATAERR, "has version " + std::to_string(header.version) + ", this program writes " +
                                  std::to_string(kVersion));
  }
  const std::size_t body = bodySize(header.markers, header.version == kVersion);
  if (header.owner != restPoseOwner(sensor, format) ||
      header.markers != static_cast<std::uint32_t>(sensor.markerCount())) {
    return refuse(EX_DATAERR, "belongs to other marker layers or another picture format");
  }
  if (bytes->size() != sizeof header + body + header.camera + header.asker + sizeof checksum)
    return refuse(EX_DATAERR, "is damaged: its length does not fit");
  const std::string owner(bytes->data() + sizeof header + body, header.camera);
  const auto with = sensor::MeasuredWith::parse(camera);
  if (owner.empty() || with.camera.empty() || !sensor::MeasuredWith::parse(owner).holdsFor(with)) {
    return tl::make_unexpected(
        Error{EX_DATAERR, "the rest pose was taken with camera " + owner + ", this is " + camera, path.string(),
              "use that camera (camera.id) with that picture (camera.features); or delete the file and, with the gel "
              "untouched, start and take a zero (tractionctl zero)"});
  }
  RestPose pose = poseOf(header, bytes->data() + sizeof header);
  if (!isSane(pose) || idOf(pose) != pose.id) return refuse(EX_DATAERR, "is damaged: its numbers make no sense");
  return pose;
}

tl::expected<void, Error> saveRestPose(const std::filesystem::path& path, const RestPose& pose,
                                       const sensor::Sensor& sensor, PixelFormat format, const std::string& camera) {
  Header header;
  header.camera = static_cast<std::uint32_t>(std::min(camera.size(), kLongestName));
  header.asker = static_cast<std::uint32_t>(std::min(pose.requestedBy.size(), kLongestName));
  header.markers = static_cast<std::uint32_t>(pose.amplitude.size());
  header.owner = restPoseOwner(sensor, format);
  header.id = pose.id;
  header.taken_ns = pose.taken_ns;
  header.noise = pose.noise;
  header.shotNoise = pose.shotNoise;
  header.light = pose.light;
  header.crossTalk = pose.crossTalk;
  header.requested = pose.requested ? 1 : 0;
  if (pose.oddity.empty()) header.version = kWithoutOddity;

  std::vector<char> bytes;
  append(bytes, &header, 1);
  append(bytes, pose.position_px.data(), pose.position_px.size());
  append(bytes, pose.amplitude.data(), pose.amplitude.size());
  append(bytes, pose.present.data(), pose.present.size());
  append(bytes, pose.oddity.data(), pose.oddity.size());
  append(bytes, camera.data(), header.camera);
  append(bytes, pose.requestedBy.data(), header.asker);
  const Hash128 checksum = hash128(bytes.data(), bytes.size());
  append(bytes, checksum.data(), checksum.size());

  std::error_code error;
  if (path.has_parent_path()) error = files::makeDirectories(path.parent_path());
  if (!error) error = replaceWholeFile(path, bytes);
  if (!error) return {};
  return tl::make_unexpected(Error{EX_CANTCREAT, "the rest pose cannot be written: " + error.message(), path.string(),
                                   "make room, or let the service's user write there"});
}

}  // namespace tractiond::track
