// What the other messages mean: the sensor, its geometry, and what the numbers rest on. Frames as in messages.h.
#pragma once

#include "traction/messages.h"

#include <optional>

namespace traction {

/// A linear elastic block, bonded at z = size_m[2], its sides and its touched surface free.
struct Gel {
  double youngsModulus_Pa = 0.0;
  double poissonRatio = 0.0;
  Vector3 size_m{};  ///< width, height, thickness [m]; centred on the origin in x and y
};

/// Of the light in which markers stand out; grey: in all.
enum class Colour { kUnknown, kBlue, kRed, kGreen, kGrey };

/// Index of a marker or node in its grid: row * columns + column, column along +x, row along +y (up in the picture).
struct Grid {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  double pitch_m = 0.0;  ///< from one to the next [m]
  Vector2 centre_m{};    ///< of the grid, gel frame [m]

  Vector2 position_m(std::uint32_t column, std::uint32_t row) const {
    return {centre_m[0] + pitch_m * (column - (columns - 1) / 2.0), centre_m[1] + pitch_m * (row - (rows - 1) / 2.0)};
  }
};

/// Round markers in the plane z = depth_m.
struct MarkerLayer {
  Colour colour = Colour::kUnknown;
  Grid grid;
  double depth_m = 0.0;
  double diameter_m = 0.0;  ///< of a marker
  bool darker = false;      ///< than what surrounds the markers, in their light
};

struct Camera {
  std::string vendor, model, serial;  ///< as the camera says; empty: not seen yet
  std::string pixelFormat;            ///< GenICam's name: "RGB8"
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  double focal_px = 0.0;   ///< along u; along v: aspect * focal_px
  double aspect = 1.0;     ///< focal length along v over that along u
  Vector2 principal_px{};  ///< where the optical axis meets the picture, (u, v)
  double k1 = 0.0;         ///< radial distortion r_d = r (1 + k1 r^2 + k2 r^4), r normalised by the focal length
  double k2 = 0.0;
  Vector3 position_m{};    ///< of the projection centre, gel frame
  Vector3 rotation_rad{};  ///< rotation vector from the nominal pose (straight along -z), camera frame
  double gelIndex = 1.0;   ///< refractive index of the gel; 1: not taken into account
  double windowIndex = 1.0;
  double windowThickness_m = 0.0;
};

struct Solver {
  std::string mechanics;       ///< "block", "half-space" or "influence file"
  std::string regularisation;  ///< name of the rule
  double strength = 0.0;       ///< of the largest singular value of the influence matrix; for Method::kWholeFace
  bool contactAware = false;
  double noise_px = 0.0;      ///< of a marker's centre, that the search for contacts reckons with
  double forceScale_N = 0.0;  ///< the least force of a node that the contact step takes as usual
  // Force on one node that is found in half of the frames: along the surface and into it [N].
  double detectionLimitTangential_N = 0.0;
  double detectionLimitNormal_N = 0.0;
};

/// What the forces rest on.
struct Calibration {
  Id id{};
  std::int64_t time_ns = 0;  ///< CLOCK_REALTIME when it was made
};

/// What the displacements are counted from. Markers in the order of Markers.
struct Zero {
  Id id{};
  std::int64_t time_ns = 0;                           ///< CLOCK_REALTIME of its last frame
  bool requested = false;                             ///< true: a person asked for it; false: taken at the first start
  std::vector<std::array<float, 2>> restPosition_px;  ///< (u, v) in the picture
  std::vector<std::uint8_t> markerPresent;            ///< 1: seen in the rest frames
  std::string requestedBy;                            ///< who asked, for people
};

/// A body of any shape with its own Green's functions. `layers` and `nodes` of the description then say who is whose
/// neighbour, and their pitches, centres and depths are means. Gel frame.
struct Body {
  std::vector<std::array<float, 3>> nodePositions_m;
  std::vector<std::array<float, 3>> nodeNormals;  ///< of length 1, into the body
  std::vector<float> nodeAreas_m2;
  std::vector<std::array<float, 3>> markerPositions_m;  ///< at rest
};

struct Description {
  Header header;
  std::string softwareVersion;  ///< of the daemon
  bool sameHost = false;        ///< the daemon's CLOCK_MONOTONIC is this process's
  std::vector<std::string> topics;
  /// Tells whether the daemon has a gel file. Without one it measures nothing and publishes no field: what follows is
  /// empty or 0, but for the camera's name, format and size.
  bool hasGel() const { return !layers.empty(); }
  Gel gel;
  std::vector<MarkerLayer> layers;
  Grid nodes;  ///< of the forces, on the touched surface z = 0
  Camera camera;
  Solver solver;
  Calibration calibration;
  std::optional<Zero> zero;  ///< empty: no rest pose yet
  std::optional<Body> body;  ///< empty: the gel is a block, its touched surface flat
};

}  // namespace traction
