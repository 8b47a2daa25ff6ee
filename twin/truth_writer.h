// Writes the true state of each frame as JSON lines to a file.
//
// Keys of a record: camera_frame_id, device_ns, monotonic_ns (CLOCK_MONOTONIC of this host), scenario_s; force_N and
// moment_Nm of all contacts on the gel, about the origin of the gel frame; contacts: shape, position_m, radius_m,
// force_N, torque_Nm (about z), of a body normal (and torque_Nm about it); missing: indices of markers that are not
// drawn; rise_K if not 0; finger and hand (the gripper and its object), and stick_ratio of a contact, of a
// scenario with a gripper; displacement_px: (u, v) of every marker, if requested. For a given picture only image, its
// number, follows scenario_s.
#pragma once

#include "twin/film.h"

#include <cstdio>
#include <memory>

namespace twin {

/// Writes records to a file. Thread-bound.
class TruthWriter {
 public:
  /// Creates or empties the file. Error: EX_CANTCREAT.
  /// \param file empty: none is written
  /// \param withMarkers true: includes displacement_px
  static tl::expected<TruthWriter, tractiond::Error> open(const std::filesystem::path& file, bool withMarkers);

  /// Writes one record, and flushes the file. A record that cannot be written is lost without an error.
  void write(const Truth& truth, const Stamp& stamp);

 private:
  TruthWriter() = default;

  bool withMarkers_ = false;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, &std::fclose};
};

/// Returns one record, without a line end.
/// \param withMarkers true: includes displacement_px
std::string toJson(const Truth& truth, const Stamp& stamp, bool withMarkers);

}  // namespace twin
