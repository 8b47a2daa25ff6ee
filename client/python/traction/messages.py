"""Messages that tractiond, and traction-touch, publish of each frame. Names, units and frames are those of proto/traction/v1.

Gel frame: the origin lies on the touched surface at the centre of the marker field; x points to the right and y up in
the camera's picture, z into the gel, towards the camera. A force is the force of the object on the gel: pressing is
+z. Pixels: u to the right, v down. SI units. No number is ever NaN: a number that is not valid is 0 and has a flag that
says so.
"""

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .shapes import Id, Mask, Matrix3, Numbers, Pixels, Vector2, Vector3, Vectors2, Vectors3


class Flag(enum.IntFlag):
    """Reasons to be careful with a frame. Bits that only a later daemon knows are kept."""

    ZERO_UNVERIFIED = 1  # it is not confirmed, neither by an operator nor by an unloaded picture, that the zero is one
    FEW_MARKERS = 2  # too few markers are seen: the field is not valid
    DISCONTINUITY = 4  # the frame before this one has no field, or the clocks jumped
    REACQUIRING = 8  # all markers were identified again in this frame
    TORN = 16  # parts of the picture are of another moment, or displaced
    UNEXPLAINED = 32  # the picture shows displacements that no forces on the surface can make
    OUT_OF_RANGE = 64  # the forces are beyond the range for which the uncertainty is known
    GEL_MISMATCH = 128  # the rest picture contradicts the gel file: the field is not valid
    DOUBTED_ORIGIN = 256  # packets came twice: they may be another sender's
    NOT_SOLVED = 512  # no model of an earlier frame holds, and this one was not solved in time: the field is not valid
    RECOVERING = 1024  # the gel has yet to recover from earlier loads: a force as small as what is not known of that is not stated
    GEL_UNVERIFIED = 2048  # the gel has too few markers to verify its gel file: deviations are wider


class CaptureBound(enum.Enum):
    """Bounds of the time at which a frame was captured."""

    NONE = 0
    BOTH = 1  # within captured_error_ns of captured_ns, on both sides
    LATEST = 2  # not later than that; earlier by the shortest delay from camera to host, which is not known


class Method(enum.Enum):
    """Method that the forces of a field were computed with."""

    NONE = 0  # the field is not valid, or the daemon does not tell
    NO_CONTACT = 1  # nothing above the detection limit (Description.solver): all forces are 0
    CONTACT = 2  # something touches
    # Of earlier daemons alone, whose recordings have them.
    WHOLE_FACE = 3  # forces of all nodes, because the contact was large or did not explain the picture; no contacts are listed
    BLEND = 4  # weighted mean of CONTACT and WHOLE_FACE


class Solution(enum.Enum):
    """Whose model the forces of a field were found with."""

    NONE = 0  # the field is not valid, or the daemon does not tell
    FULL = 1  # the frame's own
    LINEAR = 2  # that of an earlier frame, Field.model_frame, which this one does not contradict


@dataclass(slots=True, eq=False)
class Header:
    """Begins every message. In a field or markers it describes their frame, in others the last frame."""

    sequence: int  # number in its topic since the start of the daemon, from 1; in a gap messages were lost
    sensor: str  # name from the daemon's configuration
    boot: Id  # identifies the start of the daemon, with which sequence and frame_number begin again
    calibration: Id  # identifies the numbers that forces are computed from; see Description.calibration
    zero: Id  # identifies the rest pose that displacements are measured from
    flags: Flag

    camera_frame_id: int  # camera's own number of the frame; 16 bit on GigE Vision 1.x
    frame_number: int  # increases with every frame; jumps where frames of the camera were lost
    device_time_ns: int  # the camera's own clock
    exposure_s: float  # sent with the frame, else the setting; 0: not known
    gain: float | None  # as sent with the frame, in the camera's own unit
    line_status: int | None  # as sent with the frame: levels of the camera's lines, line 0 lowest
    camera_temperature: float | None  # as the camera said last [degree C]
    received_real_ns: int  # CLOCK_REALTIME of the daemon's host when the frame came from the camera driver

    # CLOCK_MONOTONIC of the daemon's host.
    captured_ns: int  # time of the camera's stamp, mapped to this clock; 0: not known
    captured_error_ns: int  # half width of the interval that contains it
    captured_bound: CaptureBound  # which ends of the interval are known
    received_ns: int  # when the frame came from the camera driver
    tracked_ns: int  # when its markers were located
    solved_ns: int  # when its forces were computed
    sent_ns: int  # when this message was passed to ZeroMQ

    # CLOCK_MONOTONIC of this host when receive() took the message; 0 in replies of Control. If Description.same_host is
    # true, arrived_ns - received_ns is the latency.
    arrived_ns: int = 0


@dataclass(slots=True, eq=False)
class Covariance:
    """3 x 3: x, y, z by x, y, z."""

    noise: Matrix3  # changes from frame to frame
    systematic: Matrix3  # does not: errors of the sensor's numbers, and forces that may act beyond its nodes

    @property
    def whole(self) -> NDArray[np.float64]:
        """Sum of noise and systematic."""
        return self.noise + self.systematic

    @property
    def deviation(self) -> NDArray[np.float64]:
        """Standard deviations of the three components. Only for a covariance of a vector with itself. (3,)"""
        deviation: NDArray[np.float64] = np.sqrt(self.whole.diagonal())
        return deviation


@dataclass(slots=True, eq=False)
class Contact:
    """A contact. Deviations are standard deviations, of the noise alone."""

    position_m: Vector2  # centre of its normal forces (of all its forces if it does not press), gel frame
    position_deviation_m: Vector2
    force_N: Vector3  # gel frame
    force_deviation_N: Vector3
    area_m2: float  # area on which an even pressure would be as concentrated
    area_deviation_m2: float
    # All 0 if the daemon does not tell.
    moment_Nm: Vector3  # of its forces about its point, (position_m, position_z_m), gel frame
    position_z_m: float  # z of that centre: where the surface is curved; of a block 0
    force_covariance_N2: Covariance
    moment_covariance_N2m2: Covariance  # of the moment about that point
    force_moment_covariance_N2m: Covariance  # row: component of the force
    half_axes_m: Vector2  # of the ellipse of an even pressure with this area and the moments of the forces; larger first
    half_axes_deviation_m: Vector2
    orientation_rad: float  # of the larger one, from x towards y, in [-pi/2, pi/2)
    orientation_deviation_rad: float  # at most pi / sqrt(12), where any orientation is possible
    shear_spread_ratio: float  # of a round contact: mean squared distance of shear over that of pressure
    shear_spread_ratio_deviation: float  # 0: not known
    hertz_radius_m: float  # of Hertz's pressure, of a contact that is described as one round patch [m]; 0: it is not
    hertz_radius_deviation_m: float  # [m]


@dataclass(slots=True, eq=False)
class PictureMotion:
    """Motion of the whole picture since the zero, by vibration or heat. Scale and roll are about the principal point."""

    shift_px: Vector2  # u, v
    scale: float  # relative
    roll_rad: float  # from u towards v


@dataclass(slots=True, eq=False)
class Field:
    """Forces of one frame. The nodes are in the order of Description.nodes: 24 x 24 of the paper's gel."""

    header: Header
    valid: bool  # false: too few markers or a numeric failure; all numbers below are 0
    force_N: Vectors3  # (nodes, 3) float32, gel frame; Description.nodes.on_grid() arranges them by rows and columns
    node_valid: Mask  # (nodes,); false: its force is 0
    resultant_N: Vector3  # (3,) float64: sum of the forces, gel frame
    moment_Nm: Vector3  # about the origin of the gel frame
    centre_of_pressure_m: Vector2  # centre of the normal forces, on the touched surface
    centre_of_pressure_valid: bool  # false: the normal force is too small for a centre
    residual_px: float  # root mean square of the displacements that the forces do not explain
    valid_markers: int  # number of markers that the forces were computed from
    resultant_covariance_N2: Covariance
    moment_covariance_N2m2: Covariance
    resultant_moment_covariance_N2m: Covariance  # row: component of the resultant
    node_deviation_N: Vectors3  # (nodes, 3) or (0, 3): standard deviation of each force, of the noise alone
    contacts: tuple[Contact, ...]  # strongest first
    method: Method
    regularisation_px_per_N: float  # of earlier daemons: lambda of their regularisation; now 0
    picture_motion: PictureMotion
    solution: Solution
    model_frame: int  # of Solution.LINEAR: Header.frame_number of that frame; else 0

    def shear_ratio(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Shear over normal force of each node, and the standard deviation that noise alone causes; NaN where the normal force
        is below three deviations, or those are not stated. Where a ball slips it is the friction, where it sticks less. (nodes,)"""
        known = len(self.node_deviation_N) == len(self.force_N)
        force, deviation = self.force_N.astype(float), self.node_deviation_N.astype(float) if known else np.full(self.force_N.shape, np.inf)
        pressed = force[:, 2] > 3 * deviation[:, 2]
        normal, shear = np.where(pressed, force[:, 2], np.nan), np.hypot(force[:, 0], force[:, 1])
        across = np.linalg.norm(force[:, :2] * deviation[:, :2], axis=1) / np.maximum(shear, 1e-12)
        across = np.where(shear > 0, across, deviation[:, :2].max(axis=1))
        return shear / normal, np.hypot(across, shear / normal * deviation[:, 2]) / normal


@dataclass(slots=True, eq=False)
class Markers:
    """Markers of one frame, in the order of Description.layers, layer after layer."""

    header: Header
    displacement_px: Vectors2  # (markers, 2) float32: displacement from the rest position in the picture, u, v
    variance_px2: Numbers  # (markers,) float32: variance of each of the two coordinates
    marker_valid: Mask  # (markers,); false: not seen, its numbers are 0
    valid_markers: int  # number of valid markers


class ContactPhase(enum.Enum):
    """What became of a TrackedContact."""

    NONE = 0  # of a later version
    BEGIN = 1  # seen for the first time
    MOVE = 2  # seen again
    ABSENT = 3  # not in this field, and may come back: lifted, became one with another, or too faint
    UNKNOWN = 4  # this field is not valid
    END = 5  # the last time that this id is reported


class EndCause(enum.Enum):
    """How a TrackedContact ended. Only LIFTED says that nothing is there."""

    NONE = 0  # it has not ended; or of a later or an early version
    LIFTED = 1  # fields that are valid went without it: lifted, or too faint
    MERGED = 2  # as LIFTED, but when it went another contact gained its force: it is part of that
    NOT_SEEN = 3  # nothing is known of it: fields were not valid, or did not come, or messages were lost; it may last
    ZERO = 4  # another zero or gel file holds: what still touches has begun anew
    STOPPED = 5  # tractiond or traction-touch was stopped or started anew, or time went back; it may last


class SlipState(enum.Enum):
    UNKNOWN = 0  # says nothing about slip: little of the friction is known
    STICKING = 1  # none of the others
    INCIPIENT = 2  # the alarm: more than 0.8 of the load is reached at which it slips, probably
    SLIPPING = 3  # it moved along its load in the last 0.2 s, and may bear no more


class SlipModel(enum.Enum):
    """What the friction of a contact is known by."""

    NONE = 0  # of a later version, or of an early one, which had the ball alone
    BALL = 1  # how far its shear is spread, as under a ball
    BOUND = 2  # what it bears: the least friction that bears its shear and torque; the state is UNKNOWN
    SLIDING = 3  # what it bore while it slid or turned along its load


@dataclass(slots=True, eq=False)
class Interval:
    """Median and 95 % interval."""

    estimate: float
    low: float
    high: float


@dataclass(slots=True, eq=False)
class Slip:
    """What a contact shows of friction. Its load is shear and torque together, as in contacts.proto."""

    state: SlipState
    stick_ratio: Interval  # radius of what sticks over that of the contact, of a ball under this load
    friction: Interval  # coefficient of friction; a high end of 3: a lower bound only, and of BOUND the estimate is that
    margin_N: float  # further shear until it slips
    holding_force_N: float  # normal force that holds the load, by friction.low, with a quarter in reserve
    model: SlipModel


@dataclass(slots=True, eq=False)
class TrackedContact:
    """A contact that lasts. Position, radius, half axes and orientation are as last seen; force, moment, their covariances
    and velocities are 0, and say nothing, in the phases absent, unknown and end. Deviations are standard deviations, of
    the noise alone."""

    id: int  # from 1, increasing; not used again in a run
    phase: ContactPhase
    doubted: bool  # errors may exceed the deviations: a flag of the field in which it was last seen
    begun_ns: int  # capture time, else arrival, of the frames in which it was seen first and last
    seen_ns: int
    position_m: Vector2  # centre of its normal forces, gel frame
    position_deviation_m: Vector2
    radius_m: float  # of a disc with Contact.area_m2
    radius_deviation_m: float
    force_N: Vector3  # shear (x, y) and normal force (z), gel frame
    force_deviation_N: Vector3
    velocity_m_s: Vector2  # of its position
    velocity_deviation_m_s: Vector2
    slip: Slip | None  # none: not known, which does not mean that nothing slips
    # As of Contact.
    moment_Nm: Vector3  # about (position_m, position_z_m), gel frame; of a block, z is the torque about the normal
    position_z_m: float
    force_covariance_N2: Covariance
    moment_covariance_N2m2: Covariance
    force_moment_covariance_N2m: Covariance
    half_axes_m: Vector2
    half_axes_deviation_m: Vector2
    orientation_rad: float
    orientation_deviation_rad: float

    angular_velocity_rad_s: float  # of the larger half axis, from x towards y
    angular_velocity_deviation_rad_s: float  # 5 where it is not measured, as of a round contact

    end_cause: EndCause  # in the phase END, else NONE


class CriticalPointKind(enum.Enum):
    NONE = 0  # of a later version
    VORTEX = 1  # the shear turns about it more than it points away from it or towards it
    SOURCE = 2  # points away from it
    SINK = 3  # points towards it
    SADDLE = 4


@dataclass(slots=True, eq=False)
class CriticalPoint:
    """Where the shear on the gel vanishes, and around which it turns."""

    id: int  # from 1, increasing; not used again in a run; it lasts while no field is without it for 0.1 s or 3 intervals
    kind: CriticalPointKind
    index: int  # Poincare's: -1 of a saddle, 1 of the others
    begun_ns: int  # of the frame in which it was seen first, as TrackedContact.begun_ns
    position_m: Vector2  # gel frame
    # That noise of the nodes around causes if it is the same in all of them; places are off by a third more (rms).
    position_deviation_m: Vector2
    strength: float  # least change of the nodes' shear by which it vanishes, in their deviations
    angle_rad: float  # 0: source, +-pi/2: vortex (+: from x towards y), pi: sink; of a saddle 0


@dataclass(slots=True, eq=False)
class Contacts:
    """The contacts of one frame, by traction-touch. Each that begins ends once: see Subscriber."""

    header: Header  # of the field; but sequence counts these messages, and sent_ns is of this message
    run: Id  # new at each start of traction-touch, with which ids begin again
    valid: bool  # false: the field is not valid, or none came in time
    contacts: tuple[TrackedContact, ...]  # first those that end here
    critical_points: tuple[CriticalPoint, ...]  # that this field shows


class FingerState(enum.Enum):
    """Whether a finger's frame is in a Grasp."""

    NONE = 0  # of a later version
    MATCHED = 1  # its frame is one of those that were captured together
    NOT_VALID = 2  # so it is, but its field is not valid
    UNMATCHED = 3  # its frames come, but not at the time of the other fingers' frames
    UNDATED = 4  # its frames come without a bound of their time of capture
    MISSING = 5  # no frame of it came in 0.1 s, or in three intervals of the slowest finger
    AMBIGUOUS = 6  # frames of two daemons came for it in the last second, or another finger has the same sensor


@dataclass(slots=True, eq=False)
class Finger:
    """A finger of a Grasp, in whose frame and about whose origin its part of the wrench is."""

    instance: str  # of tractiond, from the hand file
    link: str  # name of its gel's frame in the robot's description (URDF), from the hand file
    state: FingerState
    # As in the header of its Field; of the last one where it is not matched.
    sensor: str
    frame_number: int
    captured_ns: int
    captured_error_ns: int
    captured_bound: CaptureBound
    # Its part of the grasp; 0 in every other state than MATCHED.
    force_N: Vector3
    moment_Nm: Vector3
    force_covariance_N2: Covariance
    moment_covariance_N2m2: Covariance
    force_moment_covariance_N2m: Covariance  # row: component of the force


@dataclass(slots=True, eq=False)
class Grasp:
    """What all fingers of a hand bear together, at one time, by traction-touch --hand. In the hand's frame, which is that of
    the poses in the hand file; forces are those of the object on the hand, moments about the origin."""

    header: Header  # sensor: name of the hand; boot: new at each start of traction-touch; flags: of all fingers together
    valid: bool  # false: a finger is not MATCHED; the wrench is 0
    force_N: Vector3  # sum over the fingers of the whole field's resultant
    moment_Nm: Vector3  # about the origin of the hand's frame
    force_covariance_N2: Covariance
    moment_covariance_N2m2: Covariance
    force_moment_covariance_N2m: Covariance  # row: component of the force
    fingers: tuple[Finger, ...]  # in the order of the hand file


class PreviewFormat(enum.Enum):
    UNKNOWN = 0
    MONO8 = 1
    RGB8 = 2


@dataclass(slots=True, eq=False)
class Preview:
    """The newest picture of the camera, reduced, to be looked at. Its pixel (u, v) lies at `origin_px + scale * (u, v)` of
    the camera's picture."""

    header: Header  # of the picture's frame; tracked_ns and solved_ns are 0
    width: int
    height: int
    format: PreviewFormat
    pixels: Pixels  # uint8, (height, width, 3) of RGB8, (height, width) of MONO8
    scale: float  # pixels of the camera's picture for one of this, in each direction
    origin_px: Vector2
