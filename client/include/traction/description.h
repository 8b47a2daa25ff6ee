// Describes the sensor: its geometry, its calibration and the solver. Frames are those of messages.h.
#pragma once

#include "traction/messages.h"

#include <optional>

namespace traction {

/// A linear elastic block. It is bonded at z = size_m[2]; its sides and the touched surface are free.
struct Gel {
  double youngsModulus_Pa = 0.0;
  double poissonRatio = 0.0;  ///< below 0.5
  Vector3 size_m{};           ///< width, height, thickness [m]; the block is centred on the origin in x and y
};

/// Colour of the light in which markers stand out; kGrey: they stand out in all light.
enum class Colour { kUnknown, kBlue, kRed, kGreen, kGrey };

/// A rectangular grid of markers or nodes. Index: row * columns + column, with columns along +x and rows along +y (up
/// in the picture).
struct Grid {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  double pitch_m = 0.0;  ///< distance of neighbours, along x and y
  Vector2 centre_m{};    ///< centre of the grid, gel frame

  /// Returns the position of a grid point (x, y), gel frame [m]. The indices, from 0, are not checked.
  Vector2 position_m(std::uint32_t column, std::uint32_t row) const {
    return {centre_m[0] + pitch_m * (column - (columns - 1) / 2.0), centre_m[1] + pitch_m * (row - (rows - 1) / 2.0)};
  }
};

/// A grid of round markers in the plane z = depth_m.
struct MarkerLayer {
  Colour colour = Colour::kUnknown;
  Grid grid;
  double depth_m = 0.0;
  double diameter_m = 0.0;
  bool darker = false;  ///< true: markers are darker than their surroundings in the light of `colour`
};

/// A surface between two transparent materials: a plane of constant z, or the half of an ellipsoid that is towards
/// lower z.
struct RefractingSurface {
  Vector3 centre_m{};  ///< gel frame; of a plane only z counts
  Vector3 radii_m{};   ///< semi-axes along x, y, z; 0: a plane
  double index = 1.0;  ///< refractive index of the material towards the camera
};

/// The camera, its projection and the refraction between gel and camera.
struct Camera {
  std::string vendor, model, serial;  ///< as the camera reports them; empty: no camera opened yet
  std::string pixelFormat;            ///< GenICam name: "RGB8"
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  double focal_px = 0.0;   ///< focal length along u; along v it is aspect * focal_px
  double aspect = 1.0;     ///< focal length along v / focal length along u
  Vector2 principal_px{};  ///< principal point (u, v)
  double k1 = 0.0;         ///< radial distortion r_d = r (1 + k1 r^2 + k2 r^4), r in focal lengths
  double k2 = 0.0;
  Vector3 position_m{};    ///< projection centre, gel frame
  Vector3 rotation_rad{};  ///< rotation vector from the nominal pose (looking along -z), camera frame
  double gelIndex = 1.0;   ///< refractive index of the gel; 1: refraction is ignored
  double windowIndex = 1.0;
  double windowThickness_m = 0.0;
  std::vector<RefractingSurface> surfaces;  ///< from the gel to the camera; empty: a flat window
  /// A fisheye lens: r_d = theta (1 + k1 theta^2 + ... + k4 theta^8), theta being the angle from the axis [rad].
  bool fisheye = false;
  double k3 = 0.0;  ///< of a fisheye alone
  double k4 = 0.0;
};

/// How forces are computed from displacements.
struct Solver {
  std::string mechanics;  ///< "block", "half-space" or "influence file"
  // Of earlier daemons, which solved by a contact step: the rule "tikhonov", and its strength for Method::kWholeFace
  // relative to the largest singular value of the influence matrix. Now empty, 0 and false.
  std::string regularisation;
  double strength = 0.0;
  bool contactAware = false;
  double noise_px = 0.0;      ///< standard deviation of a marker's centre that the solver assumes
  double forceScale_N = 0.0;  ///< of earlier daemons: lower bound of the nodal force that they expected; now 0
  // Force on a single node that is detected in half of the frames: along the surface, and into it.
  double detectionLimitTangential_N = 0.0;
  double detectionLimitNormal_N = 0.0;
};

/// Identifies what the forces are computed from: gel, markers, nodes, camera geometry and solver.
struct Calibration {
  Id id{};
  std::int64_t time_ns = 0;  ///< CLOCK_REALTIME when it was made [ns since 1970]
};

/// The zero: the rest pose that displacements are measured from. Markers are in the order of Markers.
struct Zero {
  Id id{};
  std::int64_t time_ns = 0;  ///< CLOCK_REALTIME of its last frame [ns since 1970]
  bool requested = false;    ///< true: an operator asked for it; false: taken at the first start
  std::vector<std::array<float, 2>> restPosition_px;  ///< (u, v) of each marker
  std::vector<std::uint8_t> markerPresent;            ///< per marker; 1: seen in the rest frames
  std::string requestedBy;                            ///< operator that asked for it: an address or a local process
};

/// A body of any shape with its own Green's functions. Description::layers and nodes then give the neighbourhood of
/// markers and nodes only; their pitches, centres and depths are means. Gel frame.
struct Body {
  std::vector<std::array<float, 3>> nodePositions_m;
  std::vector<std::array<float, 3>> nodeNormals;  ///< unit vectors into the body
  std::vector<float> nodeAreas_m2;
  std::vector<std::array<float, 3>> markerPositions_m;  ///< rest positions, layer after layer
};

/// What a daemon publishes about itself at the start, after each change, and to each new subscriber. The library checks
/// its shapes, and that its numbers are finite, except those of the header and of the solver: a detection limit may be
/// infinite.
struct Description {
  Header header;
  std::string softwareVersion;  ///< version of the daemon
  bool sameHost = false;        ///< true: the daemon's CLOCK_MONOTONIC is also this process's
  std::vector<std::string> topics;
  /// Returns whether the daemon has a gel file. Without one it publishes no field, and everything below is empty or 0
  /// except the camera's name, pixel format and size.
  bool hasGel() const { return !layers.empty(); }
  Gel gel;
  std::vector<MarkerLayer> layers;
  Grid nodes;  ///< of the forces, on the touched surface z = 0
  Camera camera;
  Solver solver;
  Calibration calibration;
  std::optional<Zero> zero;  ///< empty: there is no zero yet
  std::optional<Body> body;  ///< empty: the gel is a block with a flat touched surface
};

}  // namespace traction
