// Converts what tractiond publishes to messages that Foxglove and Lichtblick draw (proto/foxglove): forces, contacts
// and the gel in a scene, forces on a grid, previews as pictures, and warnings as a log.
#pragma once

#include "traction/subscriber.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace traction::cli::foxglove {

/// A FileDescriptorSet with all schemas.
std::string_view descriptors();

/// Kinds of drawings; or-ed.
enum Drawings : unsigned {
  kScene = 1,    ///< foxglove.SceneUpdate: forces, contacts; of a description the gel
  kGrid = 2,     ///< foxglove.Grid
  kPicture = 4,  ///< foxglove.RawImage
  kLog = 8,      ///< foxglove.Log
  kAllDrawings = 15,
};

struct Drawn {
  std::string_view topic;   ///< last part of the topic: "scene", "grid", "picture", "log"
  std::string_view schema;  ///< "foxglove.SceneUpdate"
  std::string data;         ///< the message, serialized
};

/// Draws the messages of one sensor. Thread-bound.
class Drawing {
 public:
  /// Lengths of arrows.
  static constexpr double kNode_m_per_N = 0.02, kContact_m_per_N = 0.01;
  /// Below this many standard deviations of a node's force its arrow grows fainter with the force.
  static constexpr double kSure = 2.0;

  /// The frame of reference has the sensor's name; it is the gel frame.
  explicit Drawing(std::string sensor)
      : sensor_(std::move(sensor)) {}

  /// Draws a message. Needs every message of the sensor, also where `wanted` leaves its drawings out: forces are drawn
  /// where the last description says, and the log tells changes since kLog was first wanted.
  /// \param time_ns since 1970, for the drawings' timestamps
  std::vector<Drawn> draw(const Message& message, std::uint64_t time_ns, unsigned wanted = kAllDrawings);

 private:
  void drawScene(const Description& description, std::uint64_t time_ns, std::vector<Drawn>& to) const;
  void drawScene(const Field& field, const std::vector<Vector3>& places, std::uint64_t time_ns,
                 std::vector<Drawn>& to) const;
  void log(const Field& field, std::uint64_t time_ns, std::vector<Drawn>& to);
  void log(const Status& status, std::uint64_t time_ns, std::vector<Drawn>& to);

  std::string sensor_;
  std::optional<Description> description_;
  // What the log has told last.
  std::uint32_t flags_ = 0;
  bool valid_ = true;
  CameraState camera_ = CameraState::kUnknown;
};

}  // namespace traction::cli::foxglove
