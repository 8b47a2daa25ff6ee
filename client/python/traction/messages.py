"""What tractiond publishes of each frame. Names, units and frames are those of proto/traction/v1.

Gel frame: the origin lies on the touched surface at the centre of the marker field; x points to the right and y up in
the camera's picture, z into the gel, towards the camera. A force is the force of the object on the gel: pressing is
+z. Pixels: u to the right, v down. SI units. No number is ever NaN: what is not valid is marked so and is 0.
"""

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .shapes import Id, Mask, Matrix3, Numbers, Pixels, Vector2, Vector3, Vectors2, Vectors3


class Flag(enum.IntFlag):
    """Reasons to be careful; bits of a later daemon stay."""

    ZERO_UNVERIFIED = 1  # nobody has confirmed, and no unloaded picture has shown, that the zero is a zero
    FEW_MARKERS = 2  # too few markers are seen: the field is not valid
    DISCONTINUITY = 4  # frames were lost or the clocks jumped before this frame
    REACQUIRING = 8  # markers were labelled anew in this frame
    TORN = 16  # the picture does not hang together: rows of another moment, or moved aside
    UNEXPLAINED = 32  # the picture shows displacements that no forces on the surface can make
    OUT_OF_RANGE = 64  # the forces are beyond the range for which the uncertainty is known
    GEL_MISMATCH = 128  # the rest picture contradicts the gel file: the field is not valid
    DOUBTED_ORIGIN = 256  # packets came twice, early, or beside the camera's own: the picture may be somebody else's


class CaptureBound(enum.Enum):
    """What is known of when a frame was captured."""

    NONE = 0
    BOTH = 1  # within captured_error_ns of captured_ns, on both sides
    LATEST = 2  # not later than that; earlier by the shortest delay from camera to host, which nobody has measured


class Method(enum.Enum):
    """How the forces of a field were found."""

    NONE = 0  # not valid, or not told
    NO_CONTACT = 1  # nothing above the detection limit (Description.solver): all forces are 0
    CONTACT = 2  # for the nodes alone that carry something
    WHOLE_FACE = 3  # for all nodes, because the contact is large or does not explain the picture
    BLEND = 4  # a mean of the two, on the way from one to the other


@dataclass(slots=True, eq=False)
class Header:
    """Stands at the head of every message. Of a field or markers: their frame; of the others: the last frame."""

    sequence: int  # of this topic since the start of the daemon, from 1; a gap: lost on the way
    sensor: str  # name from the daemon's configuration
    boot: Id  # of this start of the daemon: sequence and frame_number start again with it
    calibration: Id  # of what the forces rest on; Description.calibration
    zero: Id  # of the rest pose that displacements are counted from
    flags: Flag

    camera_frame_id: int  # as the camera counts; 16 bit on GigE Vision 1.x
    frame_number: int  # counted up; jumps where frames of the camera were lost
    device_time_ns: int  # the camera's own clock
    exposure_s: float  # as sent with the frame, else as set; 0: the camera does not tell
    gain: float | None  # as sent with the frame, in the camera's own unit
    line_status: int | None  # as sent with the frame: levels of the camera's lines, line 0 lowest
    received_real_ns: int  # CLOCK_REALTIME of the daemon's host when the frame came from the camera driver

    # CLOCK_MONOTONIC of the daemon's host.
    captured_ns: int  # when the camera stamped it, by the running mapping of its clock; 0: not known
    captured_error_ns: int  # half width of that mapping
    captured_bound: CaptureBound  # which sides of it hold
    received_ns: int  # when the frame came from the camera driver
    tracked_ns: int  # when its markers were found
    solved_ns: int  # when its forces were known
    sent_ns: int  # when this message was handed to be sent

    # CLOCK_MONOTONIC of this host when receive() took the message; 0 in answers of Control. Less received_ns it is the
    # latency where Description.same_host holds.
    arrived_ns: int = 0


@dataclass(slots=True, eq=False)
class Covariance:
    """3 x 3: x, y, z by x, y, z."""

    noise: Matrix3  # what differs from frame to frame
    systematic: Matrix3  # what does not: the sensor's numbers, and what may lie beyond its nodes

    @property
    def whole(self) -> NDArray[np.float64]:
        """The sum of the two."""
        return self.noise + self.systematic

    @property
    def deviation(self) -> NDArray[np.float64]:
        """Standard deviation of each component; of a matrix that is its own transpose. (3,)"""
        deviation: NDArray[np.float64] = np.sqrt(self.whole.diagonal())
        return deviation


@dataclass(slots=True, eq=False)
class Contact:
    """Where something touches. Deviations are standard deviations, of the noise alone."""

    position_m: Vector2  # of its normal forces (of all its forces where it does not press), gel frame
    position_deviation_m: Vector2
    force_N: Vector3  # gel frame
    force_deviation_N: Vector3
    area_m2: float  # of an even pressure that would be as concentrated
    area_deviation_m2: float


@dataclass(slots=True, eq=False)
class PictureMotion:
    """Of the whole picture since the zero, by vibration or heat; scale and roll about the principal point."""

    shift_px: Vector2  # u, v
    scale: float  # relative
    roll_rad: float  # from u towards v


@dataclass(slots=True, eq=False)
class Field:
    """The forces of one frame. Nodes in the order of Description.nodes: 24 x 24 of the paper's gel."""

    header: Header
    valid: bool  # false: too few markers or a numeric failure; all below is 0
    force_N: Vectors3  # (nodes, 3) float32, gel frame; Description.nodes.on_grid() has it by rows and columns
    node_valid: Mask  # (nodes,); false: its force is 0
    resultant_N: Vector3  # (3,) float64: sum of the forces, gel frame
    moment_Nm: Vector3  # about the origin of the gel frame
    centre_of_pressure_m: Vector2  # of the normal forces, on the touched surface
    centre_of_pressure_valid: bool  # false: the normal force is too small for a centre
    residual_px: float  # what the forces leave unexplained, root mean square
    valid_markers: int  # that the forces were solved from
    resultant_covariance_N2: Covariance
    moment_covariance_N2m2: Covariance
    resultant_moment_covariance_N2m: Covariance  # row: component of the resultant
    node_deviation_N: Vectors3  # (nodes, 3) or (0, 3): standard deviation of each force, of the noise alone
    contacts: tuple[Contact, ...]  # strongest first; none where the method is WHOLE_FACE
    method: Method
    regularisation_px_per_N: float  # lambda of the penalty that was used
    picture_motion: PictureMotion


@dataclass(slots=True, eq=False)
class Markers:
    """Where the markers of one frame are, in the order of Description.layers, layer after layer."""

    header: Header
    displacement_px: Vectors2  # (markers, 2) float32: from the rest position in the picture, u, v
    variance_px2: Numbers  # (markers,) float32: of each of the two coordinates
    marker_valid: Mask  # (markers,); false: not seen, its numbers are 0
    valid_markers: int  # how many are valid


class PreviewFormat(enum.Enum):
    UNKNOWN = 0
    MONO8 = 1
    RGB8 = 2


@dataclass(slots=True, eq=False)
class Preview:
    """The newest picture of the camera, reduced, for eyes. Its pixel (u, v) lies in the camera's at
    `origin_px + scale * (u, v)`."""

    header: Header  # of the picture's frame; tracked_ns and solved_ns are 0
    width: int
    height: int
    format: PreviewFormat
    pixels: Pixels  # uint8, (height, width, 3) of RGB8, (height, width) of MONO8
    scale: float  # pixels of the camera to one of this picture, in each direction
    origin_px: Vector2
