// What tractiond publishes, as messages that Foxglove and Lichtblick draw (proto/foxglove): forces as arrows, the
// contacts and the gel in a scene, the forces on a grid, and what is to be heeded as a log.
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

struct Drawn {
  std::string_view topic;   ///< below the sensor's: "scene", "grid", "picture", "log"
  std::string_view schema;  ///< "foxglove.SceneUpdate"
  std::string data;         ///< the message, as Protobuf has it
};

/// Of one sensor. Thread-bound.
class Drawing {
 public:
  /// Lengths of arrows.
  static constexpr double kNode_m_per_N = 0.02, kContact_m_per_N = 0.01;
  /// A node's force of less than this many of its standard deviations is the fainter, the smaller it is.
  static constexpr double kSure = 2.0;

  /// The frame of reference is called as the sensor is; it is the gel frame.
  explicit Drawing(std::string sensor)
      : sensor_(std::move(sensor)) {}

  /// \param time_ns when what it tells was so, since 1970
  std::vector<Drawn> draw(const Message& message, std::uint64_t time_ns);

 private:
  void draw(const Description& description, std::uint64_t time_ns, std::vector<Drawn>& to);
  void draw(const Field& field, std::uint64_t time_ns, std::vector<Drawn>& to);
  void draw(const Status& status, std::uint64_t time_ns, std::vector<Drawn>& to);
  void draw(const Preview& preview, std::uint64_t time_ns, std::vector<Drawn>& to) const;

  std::string sensor_;
  std::optional<Description> description_;
  std::uint32_t flags_ = 0;
  bool valid_ = true;
  CameraState camera_ = CameraState::kUnknown;
};

}  // namespace traction::cli::foxglove
