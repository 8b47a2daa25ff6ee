// Tells what is true: JSON lines to a file and to a ZeroMQ topic.
//
// Keys of a record: camera_frame_id, device_ns, monotonic_ns (CLOCK_MONOTONIC of this host), scenario_s; force_N and
// moment_Nm about the origin, of all contacts on the gel, gel frame; contacts: shape, position_m, radius_m, force_N,
// torque_Nm (about z); missing: indices of markers that are not drawn; displacement_px: (u, v) of every marker, if
// asked for; image: number of the given picture, in place of all that is known of a scenario.
#pragma once

#include "twin/film.h"

#include <cstdio>
#include <memory>

namespace twin {

struct TruthOptions {
  std::filesystem::path file;  ///< empty: none
  std::string endpoint;        ///< of the PUB socket, which binds; topic "truth/"; empty: none
  bool markers = false;        ///< displacement_px
};

/// Thread-bound.
class TruthWriter {
 public:
  static tl::expected<std::unique_ptr<TruthWriter>, Failure> open(const TruthOptions& options);
  ~TruthWriter();

  void write(const Truth& truth, const Stamp& stamp);

 private:
  struct Socket;
  TruthWriter();

  bool markers_ = false;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::unique_ptr<Socket> socket_;
};

/// One record, one line without its end.
std::string toJson(const Truth& truth, const Stamp& stamp, bool withMarkers);

}  // namespace twin
