"""Protobuf's messages -> ours, by the annotations of messages.py and its like; names are the same on both sides."""

import dataclasses
import enum
import math
import types
import typing
from collections.abc import Callable
from functools import cache
from operator import attrgetter
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from .description import Body, Camera, Description, Gel, Grid, MarkerLayer, RefractingSurface, Zero
from .errors import Malformed
from .messages import (Contact, Contacts, Covariance, CriticalPoint, Field, Finger, Grasp, Interval, Markers, PictureMotion,
                       Preview, PreviewFormat, Slip, TrackedContact)
from .shapes import Axes, Bytes, OneByteEach, Packed, SixteenBytes
from .status import Histogram, Status
from .wire import parse

Message = Field | Markers | Description | Status | Preview | Contacts | Grasp

Convert = Callable[[Any], Any]

# Machines are steered by these: a number among them that is NaN or infinite is refused. A detection limit of the solver
# may be infinite.
_FINITE = (Field, Markers, Covariance, Contact, TrackedContact, Slip, Interval, CriticalPoint, Finger, Grasp, PictureMotion, Preview,
           Gel, Grid, MarkerLayer, Camera, RefractingSurface, Zero, Body)


def _require(condition: bool, what: str) -> None:
    if not condition:
        raise Malformed(what)


def _finite(number: float) -> float:
    if not math.isfinite(number):
        raise Malformed("a number is not finite")
    return number


def _all_finite(array: NDArray[Any]) -> NDArray[Any]:
    _require(0 not in np.isfinite(array).tobytes(), "a number is not finite")  # a third of what .all() takes
    return array


def _identity(id: bytes) -> bytes:
    _require(len(id) in (0, 16), "an id has not 16 bytes")
    return id


def _mask(mask: bytes) -> NDArray[np.bool_]:
    return np.frombuffer(mask, np.uint8).astype(bool)  # whatever a byte is, an element is true or false


def _bytes(content: bytes) -> NDArray[np.uint8]:
    return np.frombuffer(content, np.uint8)


def _packed(how: Packed, finite: bool) -> Convert:
    dtype, (first, *rest) = np.dtype(how.dtype), how.shape
    each = dtype.itemsize * math.prod(rest)  # bytes of what the first index counts
    none = np.zeros((max(first, 0), *rest), dtype)
    none.flags.writeable = False

    def convert(runs: Any) -> NDArray[Any]:
        content = runs[0] if len(runs) == 1 else b"".join(runs)
        if not content:
            return none
        count, surplus = divmod(len(content), each)
        _require(surplus == 0 and first in (-1, count), "an array is incomplete")
        array: NDArray[Any] = np.ndarray((count, *rest), dtype, content)
        return _all_finite(array) if finite else array

    return convert


def _axes(how: Axes, finite: bool) -> Convert:
    numbers = attrgetter(*how.names)
    if not finite:
        return lambda vector: np.array(numbers(vector))

    def convert(vector: Any) -> NDArray[Any]:
        few = numbers(vector)
        _require(all(map(math.isfinite, few)), "a number is not finite")
        return np.array(few)

    return convert


def _word(words: type[enum.Enum]) -> Convert:
    known = {word.value: word for word in words}
    none = known[0]  # also for one of a later daemon
    return lambda value: known.get(value, none)


def _each(convert: Convert) -> Convert:
    return lambda values: tuple([convert(value) for value in values])


def _converter(hint: Any, finite: bool) -> Convert | None:
    """None: as it is."""
    for how in getattr(hint, "__metadata__", ()):
        if isinstance(how, Packed):
            return _packed(how, finite)
        if isinstance(how, Axes):
            return _axes(how, finite)
        if isinstance(how, OneByteEach):
            return _mask
        if isinstance(how, Bytes):
            return _bytes
        if isinstance(how, SixteenBytes):
            return _identity
    if typing.get_origin(hint) is tuple:
        each = _converter(typing.get_args(hint)[0], finite)
        return tuple if each is None else _each(each)
    if dataclasses.is_dataclass(hint):
        return reader(cast(type, hint))
    if hint is float and finite:
        return _finite
    if isinstance(hint, type) and issubclass(hint, enum.Flag):
        return hint
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return _word(hint)
    return None


def _check_field(field: Field) -> Field:
    nodes = len(field.force_N)
    _require(len(field.node_valid) == nodes, "the field's mask has another size")
    _require(len(field.node_deviation_N) in (0, nodes), "the field's deviations have another size")
    return field


def _check_markers(markers: Markers) -> Markers:
    _require(len(markers.marker_valid) == len(markers.variance_px2) == len(markers.displacement_px),
             "the markers' arrays have different sizes")
    return markers


def _check_camera(camera: Camera) -> Camera:
    camera.aspect = camera.aspect or 1.0  # older daemons know square pixels alone
    return camera


def _check_zero(zero: Zero) -> Zero:
    _require(len(zero.marker_present) == len(zero.rest_position_px), "the rest pose's mask has another size")
    return zero


def _check_body(body: Body) -> Body:
    _require(len(body.node_normals) == len(body.node_areas_m2) == len(body.node_positions_m),
             "the body's nodes have other sizes")
    return body


def _check_histogram(all: Histogram) -> Histogram:
    _require(not all.count or len(all.count) == len(all.bound_s) + 1, "a histogram has no count for each bound")
    return all


def _check_preview(preview: Preview) -> Preview:
    _require(preview.format is not PreviewFormat.UNKNOWN, "the preview's format is unknown")
    shape = (preview.height, preview.width) + ((3,) if preview.format is PreviewFormat.RGB8 else ())
    _require(preview.pixels.size == math.prod(shape), "the preview has more or fewer pixels than its size says")
    preview.pixels = preview.pixels.reshape(shape)
    return preview


_CHECKS: dict[type, Convert] = {
    Field: _check_field, Markers: _check_markers, Camera: _check_camera, Zero: _check_zero, Body: _check_body,
    Histogram: _check_histogram, Preview: _check_preview}


@cache
def reader(kind: type) -> Convert:
    """What makes a `kind`, a dataclass, of a Protobuf message. A member with a default does not travel. Raises Malformed."""
    hints = typing.get_type_hints(kind, include_extras=True)
    names: dict[str, Any] = {"kind": kind, "check": _CHECKS.get(kind)}
    members = []
    for one in dataclasses.fields(kind):
        if one.default is not dataclasses.MISSING:
            continue
        name, hint = one.name, hints[one.name]
        is_optional = isinstance(hint, types.UnionType)  # X | None
        convert = _converter(typing.get_args(hint)[0] if is_optional else hint, kind in _FINITE)
        names["to_" + name] = convert
        value = f"m.{name}" if convert is None else f"to_{name}(m.{name})"
        members.append(f"{value} if m.HasField('{name}') else None" if is_optional else value)
    made = f"kind({', '.join(members)})"
    # Written out once, as dataclasses do it, instead of going through the members with each message.
    return cast(Convert, eval(f"lambda m: {made}" if names["check"] is None else f"lambda m: check({made})", names))


def decode(kind: str, payload: bytes) -> Message:
    """A message of a stream: "field", "markers", "description", "status", "preview", "contacts" or "grasp". Raises Malformed."""
    name, read = KINDS[kind]
    return cast(Message, read(parse(name, payload)))


KINDS = {one.__name__.lower(): (one.__name__, reader(one)) for one in typing.get_args(Message)}
