// Converts what tractiond publishes to messages that Foxglove and Lichtblick draw (proto/foxglove): forces, contacts
// and the gel in a scene, forces on a grid, previews as pictures, and warnings as a log.
#pragma once

#include "traction/subscriber.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace traction::client::foxglove {

/// Returns a serialised FileDescriptorSet with all schemas, which lives as long as the program.
std::string_view descriptors();

/// Kinds of drawings, combined by bitwise or.
enum Drawings : unsigned {
  kScene = 1,    ///< foxglove.SceneUpdate: forces and contacts; for a description, the gel; contacts of traction-touch
  kGrid = 2,     ///< foxglove.Grid
  kPicture = 4,  ///< foxglove.RawImage
  kLog = 8,      ///< foxglove.Log
  kAllDrawings = 15,
};

/// One drawing. `topic` and `schema` live as long as the program.
struct Drawn {
  std::string_view topic;   ///< last part of the topic: "scene", "grid", "picture", "log"
  std::string_view schema;  ///< "foxglove.SceneUpdate"
  std::string data;         ///< the message, serialized
};

/// Draws the messages of one sensor. Thread-bound.
class Drawing {
 public:
  /// Lengths of arrows per force [m/N].
  static constexpr double kNode_m_per_N = 0.02, kContact_m_per_N = 0.01;
  /// Arrows of nodes below this many standard deviations fade with the force.
  static constexpr double kSure = 2.0;

  /// \param sensor name of the sensor, and of the drawings' frame of reference, which is the gel frame
  explicit Drawing(std::string sensor)
      : sensor_(std::move(sensor)) {}

  /// Returns the drawings of a message; none if it has no drawing that is wanted. It must be called with every message
  /// of the sensor, even if `wanted` omits its drawings: forces are drawn with the last description, and not without
  /// one of the same number of nodes; the log has a line when a flag appears, fields become invalid or the camera's
  /// state changes, and begins with what is so when kLog is wanted after a call without it. A body (influence file) has
  /// neither grid nor gel.
  /// \param time_ns timestamp of the drawings [ns since 1970]
  /// \param wanted or-ed Drawings
  std::vector<Drawn> draw(const Message& message, std::uint64_t time_ns, unsigned wanted = kAllDrawings);

 private:
  void drawScene(const Description& description, std::uint64_t time_ns, std::vector<Drawn>& to) const;
  void drawScene(const Contacts& contacts, std::uint64_t time_ns, std::vector<Drawn>& to) const;
  void drawScene(const Field& field, const std::vector<Vector3>& places, std::uint64_t time_ns,
                 std::vector<Drawn>& to) const;
  void log(const Field& field, std::uint64_t time_ns, std::vector<Drawn>& to);
  void log(const Status& status, std::uint64_t time_ns, std::vector<Drawn>& to);

  std::string sensor_;
  std::optional<Description> description_;
  // Last state that the log reported.
  std::uint32_t flags_ = 0;
  bool valid_ = true;
  int camera_ = 0;  ///< v1::CameraState
};

}  // namespace traction::client::foxglove
