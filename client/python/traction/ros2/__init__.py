"""Converts what tractiond publishes into messages of ROS 2, serialised as its middlewares send them. Needs nothing of ROS.

What holds which number, and why: docs/ros2.md. client/examples/python/ros2_bridge.py publishes or records the result.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..decode import Message
from ..description import Description
from ..messages import ContactPhase, Contacts, Field, Flag, Header, SlipState, TrackedContact
from .cdr import serialize

__all__ = ["CONTACTS", "CONTACT_MARKERS", "Converter", "DIAGNOSTICS", "FORCES", "Qos", "STATIC_TRANSFORMS", "Sample", "TOPICS",
           "Topic", "WRENCH", "is_usable", "node_name", "stamp_ns"]

_UNUSABLE = Flag.FEW_MARKERS | Flag.GEL_MISMATCH
_OK, _WARN, _ERROR = 0, 1, 2  # DiagnosticStatus.level
_FLOAT32 = 7  # PointField.datatype
_COLUMNS = ("x", "y", "z", "fx", "fy", "fz", "dx", "dy", "dz")
_POINT_BYTES = 4 * len(_COLUMNS)
_POINT_FIELDS = [{"name": name, "offset": 4 * i, "datatype": _FLOAT32, "count": 1} for i, name in enumerate(_COLUMNS)]
_DIAGNOSTICS_PERIOD_NS = 10**9
_UINT32 = 6  # PointField.datatype
_CONTACT_COLUMNS = ("id", "x", "y", "z", "fx", "fy", "fz", "mx", "my", "mz", "stick_ratio", "friction_low", "friction_high")
_CONTACT_FIELDS = [{"name": name, "offset": 4 * i, "datatype": _FLOAT32 if i else _UINT32, "count": 1}
                   for i, name in enumerate(_CONTACT_COLUMNS)]
_CONTACT_ROW = np.dtype([(name, "<f4" if i else "<u4") for i, name in enumerate(_CONTACT_COLUMNS)])
_SEEN = (ContactPhase.BEGIN, ContactPhase.MOVE)
# Of Marker.
_ARROW, _CYLINDER, _TEXT, _ADD, _DELETE = 0, 3, 9, 0, 2
_M_PER_N = 0.01  # length of the arrow of a contact
_COLOURS = {SlipState.STICKING: (0.3, 0.75, 0.45), SlipState.INCIPIENT: (0.95, 0.75, 0.1), SlipState.SLIPPING: (0.9, 0.2, 0.15)}
_GREY = (0.6, 0.6, 0.6)


@dataclass(frozen=True)
class Qos:
    """Quality of service of a publisher; history is keep last."""

    is_reliable: bool  # else best effort
    is_transient_local: bool  # else volatile
    depth: int


@dataclass(frozen=True)
class Topic:
    name: str  # "~/" stands for the node's name
    kind: str  # type of its messages
    qos: Qos


WRENCH = Topic("~/wrench", "geometry_msgs/msg/WrenchStamped", Qos(False, False, 5))
FORCES = Topic("~/forces", "sensor_msgs/msg/PointCloud2", Qos(False, False, 5))
STATIC_TRANSFORMS = Topic("/tf_static", "tf2_msgs/msg/TFMessage", Qos(True, True, 1))
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", Qos(True, False, 10))
CONTACTS = Topic("~/contacts", "sensor_msgs/msg/PointCloud2", Qos(False, False, 5))
CONTACT_MARKERS = Topic("~/contact_markers", "visualization_msgs/msg/MarkerArray", Qos(True, False, 10))
TOPICS = (WRENCH, FORCES, CONTACTS, CONTACT_MARKERS, STATIC_TRANSFORMS, DIAGNOSTICS)


@dataclass(frozen=True)
class Sample:
    """A message of ROS 2."""

    topic: Topic
    stamp_ns: int  # CLOCK_REALTIME of its picture
    data: bytes  # CDR, with its encapsulation header


def node_name(sensor: str) -> str:
    """Returns the name of a sensor's node, which also begins its frame ids. ROS allows letters, digits and `_`, and no digit
    at the beginning."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", sensor)
    return name if re.match(r"[A-Za-z_]", name) else f"sensor_{name}"


def stamp_ns(header: Header) -> int:
    """Returns when the picture was taken, CLOCK_REALTIME of the daemon's host [ns]."""
    if not header.captured_ns:
        return header.received_real_ns
    return header.received_real_ns - (header.received_ns - header.captured_ns)


def is_usable(field: Field) -> bool:
    """Tells whether a field has forces: the messages of ROS have no place for validity."""
    return field.valid and not field.header.flags & _UNUSABLE


class Converter:
    """Converts the messages of one sensor. Keeps its last description, and what was last published as diagnostics."""

    def __init__(self, sensor: str) -> None:
        self.sensor = sensor
        self.node = node_name(sensor)
        self._description: Description | None = None
        self._rows = np.zeros((0, len(_COLUMNS)), np.float32)  # of the point cloud: one a node
        self._state: tuple[object, ...] = ()  # of the last diagnostics
        self._diagnosed_ns = 0  # their Header.received_ns

    def convert(self, message: Message) -> list[Sample]:
        """Returns what is to be published of a message, which may be nothing. The sensor must be this one."""
        if isinstance(message, Description):
            return self._describe(message)
        if isinstance(message, Contacts):
            return [self._contacts(message), self._contact_markers(message)]
        if not isinstance(message, Field):
            return []
        samples = []
        if is_usable(message):
            samples.append(self._wrench(message))
            if self._is_described(message):
                samples.append(self._forces(message))
        if self._diagnostics_are_due(message):
            samples.append(self._diagnostics(message))
        return samples

    def _sample(self, topic: Topic, of: Header, /, **values: Any) -> Sample:
        return Sample(topic, stamp_ns(of), serialize(topic.kind, values))

    def _header(self, header: Header, frame: str) -> dict[str, Any]:
        """Returns a std_msgs/Header."""
        seconds, nanoseconds = divmod(stamp_ns(header), 10**9)
        return {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": frame}

    @property
    def _gel_frame(self) -> str:
        return f"{self.node}_gel"

    def _wrench(self, field: Field) -> Sample:
        return self._sample(WRENCH, field.header, header=self._header(field.header, self._gel_frame),
                            wrench={"force": _xyz(field.resultant_N), "torque": _xyz(field.moment_Nm)})

    def _describe(self, description: Description) -> list[Sample]:
        """Takes over the nodes, and returns where the camera is. Nothing where the daemon has no gel file."""
        self._description = description if description.has_gel else None
        if self._description is None:
            return []
        nodes = description.nodes
        self._rows = np.zeros((nodes.rows * nodes.columns, len(_COLUMNS)), np.float32)
        if description.body is None:
            self._rows[:, :2] = nodes.positions_m().reshape(-1, 2)
        else:
            self._rows[:, :3] = description.body.node_positions_m
        camera = description.camera
        return [self._sample(STATIC_TRANSFORMS, description.header, transforms=[{
            "header": self._header(description.header, self._gel_frame),
            "child_frame_id": f"{self.node}_camera_optical",
            "transform": {"translation": _xyz(camera.position_m), "rotation": _camera_quaternion(camera.rotation_rad)},
        }])]

    def _is_described(self, field: Field) -> bool:
        """Tells whether the description says where this field's nodes are: after a restart an old one may still be here."""
        return (self._description is not None and self._description.calibration.id == field.header.calibration
                and len(self._rows) == len(field.force_N))

    def _forces(self, field: Field) -> Sample:
        assert self._description is not None
        nodes, rows = self._description.nodes, self._rows
        rows[:, 3:6] = np.where(field.node_valid[:, None], field.force_N, np.nan)
        rows[:, 6:] = field.node_deviation_N if len(field.node_deviation_N) else 0
        return self._sample(FORCES, field.header, header=self._header(field.header, self._gel_frame),
                            height=nodes.rows, width=nodes.columns, fields=_POINT_FIELDS, is_bigendian=False,
                            point_step=_POINT_BYTES, row_step=_POINT_BYTES * nodes.columns,
                            data=rows.astype("<f4", copy=False).tobytes(), is_dense=bool(field.node_valid.all()))

    def _contacts(self, contacts: Contacts) -> Sample:
        """Of those that are seen: one that is not has no force."""
        seen = [one for one in contacts.contacts if one.phase in _SEEN]
        rows = np.array([(one.id & 0xFFFFFFFF, *one.position_m, one.position_z_m, *one.force_N, *one.moment_Nm, *_slip(one))
                         for one in seen], _CONTACT_ROW)
        size = _CONTACT_ROW.itemsize
        return self._sample(CONTACTS, contacts.header, header=self._header(contacts.header, self._gel_frame), height=1,
                            width=len(seen), fields=_CONTACT_FIELDS, is_bigendian=False, point_step=size,
                            row_step=size * len(seen), data=rows.tobytes(),
                            is_dense=not any(np.isnan(rows[name]).any() for name in _CONTACT_COLUMNS[1:]))

    def _contact_markers(self, contacts: Contacts) -> Sample:
        """An outline, an arrow and a text for each that is seen; those that are not are deleted."""
        markers = []
        for one in contacts.contacts:
            state = one.slip.state if one.slip else SlipState.UNKNOWN
            x, y, z = map(float, (*one.position_m, one.position_z_m))
            across, along = (float(half) or one.radius_m for half in one.half_axes_m)
            tip, force = np.array([x, y, z]), one.force_N
            label = "slip unknown" if state is SlipState.UNKNOWN or not one.slip else f"stick ratio {one.slip.stick_ratio.estimate:.2f}"
            common = {"header": self._header(contacts.header, self._gel_frame), "id": one.id & 0x7FFFFFFF,
                      "action": _ADD if one.phase in _SEEN else _DELETE,
                      "color": dict(zip("rgba", (*_COLOURS.get(state, _GREY), 0.8)))}
            angle = one.orientation_rad / 2
            markers += [
                _marker(common, "contact", _CYLINDER, (x, y, z), (2 * across, 2 * along, 5e-4), (float(np.sin(angle)), float(np.cos(angle)))),
                _marker(common, "force", _ARROW, scale=(1.2e-3, 2.4e-3, 0.0), points=[_xyz(tip - _M_PER_N * force), _xyz(tip)]),
                _marker(common, "label", _TEXT, (x, y + across + 3e-3, z), (0.0, 0.0, 3e-3), text=f"{one.id}: {label}")]
        return self._sample(CONTACT_MARKERS, contacts.header, markers=markers)

    def _diagnostics_are_due(self, field: Field) -> bool:
        """Tells whether something has changed, or a second has passed."""
        header = field.header
        state = (field.valid, int(header.flags), header.boot, header.zero)
        if state == self._state and abs(header.received_ns - self._diagnosed_ns) < _DIAGNOSTICS_PERIOD_NS:
            return False
        self._state, self._diagnosed_ns = state, header.received_ns
        return True

    def _diagnostics(self, field: Field) -> Sample:
        header = field.header
        flags = _flags(header.flags)
        raised = ", ".join(name for name, is_raised in flags.items() if is_raised)
        if not is_usable(field):
            level, message = _ERROR, f"no forces: {raised or 'the field is not valid'}"
        else:
            level, message = (_WARN, raised) if raised else (_OK, "forces are published")
        values = {"valid": field.valid, **flags, "boot": header.boot.hex(), "zero": header.zero.hex()}
        return self._sample(DIAGNOSTICS, header, header=self._header(header, ""), status=[{
            "level": level, "name": f"{self.node}: forces", "message": message, "hardware_id": self.sensor,
            "values": [{"key": key, "value": str(value)} for key, value in values.items()]}])


def _flags(flags: Flag) -> dict[str, bool]:
    """Returns every flag by its name in the protocol, and those that are raised by a later daemon by their number."""
    known = {f"FLAG_{flag.name}": flag in flags for flag in Flag}
    others = int(flags) & ~sum(Flag)
    return known | {f"FLAG_{1 << bit}": True for bit in range(others.bit_length()) if others >> bit & 1}


def _slip(contact: TrackedContact) -> tuple[float, float, float]:
    """Returns stick ratio, low and high end of the friction; NaN where they are not known."""
    slip = contact.slip
    if slip is None or slip.state is SlipState.UNKNOWN:
        return (np.nan, np.nan, np.nan)
    return slip.stick_ratio.estimate, slip.friction.low, slip.friction.high


def _marker(common: dict[str, Any], namespace: str, kind: int, at: tuple[float, float, float] = (0.0, 0.0, 0.0),
            scale: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: tuple[float, float] = (0.0, 1.0), text: str = "",
            points: Sequence[dict[str, float]] = ()) -> dict[str, Any]:
    """Returns a Marker that vanishes a second after the last message. `turn` about z: z and w of the quaternion."""
    return {**common, "ns": namespace, "type": kind,
            "pose": {"position": dict(zip("xyz", at)), "orientation": {"x": 0.0, "y": 0.0, "z": turn[0], "w": turn[1]}},
            "scale": dict(zip("xyz", scale)), "lifetime": {"sec": 1, "nanosec": 0}, "frame_locked": False, "points": points,
            "colors": [], "texture_resource": "", "texture": {"header": common["header"], "format": "", "data": b""},
            "uv_coordinates": [], "text": text, "mesh_resource": "", "mesh_file": {"filename": "", "data": b""},
            "mesh_use_embedded_materials": False}


def _xyz(vector: NDArray[np.float64]) -> dict[str, float]:
    return dict(zip("xyz", map(float, vector)))


def _camera_quaternion(rotation_rad: NDArray[np.float64]) -> dict[str, float]:
    """Returns diag(1, -1, -1) exp([w]x)^T as a quaternion: half a turn about x after the rotation by -w."""
    angle = float(np.linalg.norm(rotation_rad))
    x, y, z = -np.sinc(angle / (2 * np.pi)) / 2 * rotation_rad  # sin(angle / 2) / angle, also at 0
    return {"x": float(np.cos(angle / 2)), "y": float(-z), "z": float(y), "w": float(-x)}
