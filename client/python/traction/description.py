"""What the other messages mean: the sensor, its geometry, and what the numbers rest on. Frames as in messages.py."""

import enum
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .messages import Header
from .shapes import Id, Mask, Numbers, Vector2, Vector3, Vectors2, Vectors3


class Colour(enum.Enum):
    """Of the light in which markers stand out; GREY: in all."""

    UNKNOWN = 0
    BLUE = 1
    RED = 2
    GREEN = 3
    GREY = 4


@dataclass(slots=True, eq=False)
class Gel:
    """A linear elastic block, bonded at z = size_m[2], its sides and its touched surface free."""

    youngs_modulus_Pa: float
    poisson_ratio: float
    size_m: Vector3  # width, height, thickness; centred on the origin in x and y


@dataclass(slots=True, eq=False)
class Grid:
    """Index of a node or marker: row * columns + column, column along +x, row along +y (up in the picture)."""

    columns: int
    rows: int
    pitch_m: float  # from one to the next
    centre_m: Vector2  # of the grid, gel frame

    def on_grid(self, values: NDArray[Any]) -> NDArray[Any]:
        """One a node -> (rows, columns, ...), without a copy: forces of 24 x 24 nodes are (24, 24, 3)."""
        return values.reshape(self.rows, self.columns, *values.shape[1:])

    def positions_m(self) -> NDArray[np.float64]:
        """(rows, columns, 2): x, y."""
        x = self.centre_m[0] + self.pitch_m * (np.arange(self.columns) - (self.columns - 1) / 2)
        y = self.centre_m[1] + self.pitch_m * (np.arange(self.rows) - (self.rows - 1) / 2)
        return np.stack(np.meshgrid(x, y), axis=-1)


@dataclass(slots=True, eq=False)
class MarkerLayer(Grid):
    """Round markers in the plane z = depth_m."""

    colour: Colour
    depth_m: float
    diameter_m: float  # of a marker
    darker: bool  # than what surrounds the markers, in their light


@dataclass(slots=True, eq=False)
class RefractingSurface:
    """A plane of constant z between two transparent materials, or the half of an ellipsoid that is towards lower z."""

    centre_m: Vector3  # gel frame; of a plane only z counts
    radii_m: Vector3  # semi-axes along x, y, z; 0: a plane
    index: float  # refractive index of the material towards the camera


@dataclass(slots=True, eq=False)
class Camera:
    """What took the picture, and how a gel point gets onto it."""

    vendor: str  # as the camera says; empty: not seen yet
    model: str
    serial: str
    pixel_format: str  # GenICam's name: "RGB8"
    width_px: int
    height_px: int
    focal_px: float  # along u; along v: aspect * focal_px
    principal_px: Vector2  # where the optical axis meets the picture, (u, v)
    k1: float  # radial distortion r_d = r (1 + k1 r^2 + k2 r^4), r normalised by the focal length
    k2: float
    position_m: Vector3  # of the projection centre, gel frame
    rotation_rad: Vector3  # rotation vector from the nominal pose (straight along -z), camera frame
    gel_index: float  # refractive index of the gel; 1: not taken into account
    window_index: float
    window_thickness_m: float
    aspect: float  # focal length along v over that along u
    surfaces: tuple[RefractingSurface, ...]  # from the gel to the camera; empty: a flat window
    fisheye: bool  # r_d = theta (1 + k1 theta^2 + ... + k4 theta^8), theta: angle from the axis [rad]
    k3: float  # of a fisheye alone
    k4: float


@dataclass(slots=True, eq=False)
class Solver:
    """How forces are computed from displacements."""

    mechanics: str  # "block", "half-space" or "influence file"
    # Of earlier daemons, which solved by a contact step; now "", 0 and False.
    regularisation: str  # name of the rule
    strength: float  # of the largest singular value of the influence matrix; for Method.WHOLE_FACE
    contact_aware: bool
    noise_px: float  # of a marker's centre, that the solver assumes
    force_scale_N: float  # of earlier daemons: the least force of a node that they took as usual; now 0
    detection_limit_tangential_N: float  # force on one node that is found in half of the frames, along the surface
    detection_limit_normal_N: float  # and into it


@dataclass(slots=True, eq=False)
class Calibration:
    """What the forces rest on."""

    id: Id
    time_ns: int  # CLOCK_REALTIME when it was made


@dataclass(slots=True, eq=False)
class Zero:
    """What the displacements are counted from. Markers in the order of Markers."""

    id: Id
    time_ns: int  # CLOCK_REALTIME of its last frame
    requested: bool  # a person asked for it; else it was taken at the first start
    rest_position_px: Vectors2  # (markers, 2) float32: u, v in the picture
    marker_present: Mask  # (markers,): seen in the rest frames
    requested_by: str  # who asked, for people


@dataclass(slots=True, eq=False)
class Body:
    """A body of any shape with its own Green's functions. `layers` and `nodes` of the description then say who is whose
    neighbour, and their pitches, centres and depths are means. Gel frame."""

    node_positions_m: Vectors3  # (nodes, 3) float32
    node_normals: Vectors3  # of length 1, into the body
    node_areas_m2: Numbers  # (nodes,) float32
    marker_positions_m: Vectors3  # (markers, 3) float32, at rest


@dataclass(slots=True, eq=False)
class Description:
    """Sent to each new subscriber at once, and on a change."""

    header: Header
    software_version: str  # of the daemon
    host: bytes  # 16 bytes: the boot id of its host's kernel
    topics: tuple[str, ...]
    gel: Gel
    layers: tuple[MarkerLayer, ...]
    nodes: Grid  # of the forces, on the touched surface z = 0
    camera: Camera
    solver: Solver
    calibration: Calibration
    zero: Zero | None  # none: no rest pose yet
    body: Body | None  # none: the gel is a block, its touched surface flat

    @property
    def has_gel(self) -> bool:
        """The daemon has a gel file. Without one it measures nothing and publishes no field: gel, layers, nodes, solver and
        the camera's geometry are empty or 0."""
        return bool(self.layers)

    @property
    def same_host(self) -> bool:
        """The daemon's CLOCK_MONOTONIC is this process's."""
        try:
            own = Path("/proc/sys/kernel/random/boot_id").read_text().strip().replace("-", "")
        except OSError:
            return False
        return self.host.hex() == own != ""
