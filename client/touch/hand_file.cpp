#include "client/touch/hand_file.h"

#include "base/service/config_table.h"
#include "base/toml_table.h"
#include "proto/traction/v1/endpoints.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace traction::contacts {
namespace {

using tractiond::FileError;
using tractiond::TomlTable;

constexpr tractiond::Range kPlace{-10'000.0, 10'000.0, 1000.0};  // [mm]
constexpr tractiond::Range kAngle{-360.0, 360.0, 180.0 / std::numbers::pi};
/// A unit quaternion's components have this many digits at least.
constexpr double kLengthTolerance = 1e-3;

void readName(TomlTable& table, const char* key, std::string& name) {
  table.read(key, name);
  if (!isValidName(name)) table.fail(key, "must be a name: 1 to 24 of A-Z, a-z, 0-9, _ and -");
}

Eigen::Matrix3d readRotation(TomlTable& table) {
  if (table.has("rpy_deg") == table.has("rotation_xyzw")) {
    table.fail("rpy_deg", "or rotation_xyzw must be there, and not both: the rotation of the gel in the hand");
  }
  if (table.has("rpy_deg")) {
    std::array<double, 3> angles{};
    table.read("rpy_deg", angles, kAngle);
    const auto [roll, pitch, yaw] = angles;
    using Axis = Eigen::Vector3d;
    return (Eigen::AngleAxisd(yaw, Axis::UnitZ()) * Eigen::AngleAxisd(pitch, Axis::UnitY()) *
            Eigen::AngleAxisd(roll, Axis::UnitX()))
        .toRotationMatrix();
  }
  std::array<double, 4> xyzw = {0.0, 0.0, 0.0, 1.0};
  table.read("rotation_xyzw", xyzw, {-1.0 - kLengthTolerance, 1.0 + kLengthTolerance, 1.0});
  const Eigen::Quaterniond quaternion(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  if (!(std::abs(quaternion.norm() - 1.0) <= kLengthTolerance)) {
    table.fail("rotation_xyzw", "has the length " + std::to_string(quaternion.norm()) + ", and must have 1");
  }
  return quaternion.normalized().toRotationMatrix();
}

HandFile::Finger readFinger(TomlTable& table) {
  HandFile::Finger finger;
  readName(table, "instance", finger.instance);
  finger.link = finger.instance;
  table.read("link", finger.link);
  if (finger.link.empty()) table.fail("link", "must not be empty");
  std::array<double, 3> place{};
  table.read("position_mm", place, kPlace);
  if (!table.has("position_mm"))
    table.fail("position_mm", "is missing: where the origin of the gel frame is in the hand");
  finger.pose.position_m = Eigen::Vector3d(place.data());
  finger.pose.rotation = readRotation(table);
  return finger;
}

tl::expected<HandFile, tractiond::Error> read(tl::expected<TomlTable, FileError> file) {
  if (!file) return tl::unexpected(tractiond::asError(file.error()));
  HandFile hand;
  readName(*file, "name", hand.name);
  std::vector<TomlTable> tables = file->tables("finger");
  if (tables.empty() || tables.size() > kMostFingers) {
    file->fail("finger", "must be 1 to " + std::to_string(kMostFingers) + " tables [[finger]]");
  }
  for (TomlTable& table : tables) {
    HandFile::Finger finger = readFinger(table);
    const auto fail = [&](const char* key, const std::string& value, const char* what) {
      table.fail(key, "= \"" + value + "\" is that of another finger, too: " + what);
    };
    for (const HandFile::Finger& other : hand.fingers) {
      if (other.instance == finger.instance) fail("instance", finger.instance, "each has a sensor of its own");
      if (other.link == finger.link) fail("link", finger.link, "each has a link of its own");
    }
    hand.fingers.push_back(std::move(finger));
  }
  if (const auto sound = file->finish(); !sound) return tl::unexpected(tractiond::asError(sound.error()));
  return hand;
}

}  // namespace

tl::expected<HandFile, tractiond::Error> parseHand(std::string_view text, const std::string& name) {
  return read(TomlTable::parse(text, name));
}

tl::expected<HandFile, tractiond::Error> loadHand(const std::string& path) {
  return read(TomlTable::load(path));
}

}  // namespace traction::contacts
