"""Serialises messages of ROS 2 as its middlewares do: CDR (XCDR1), little-endian, by the text of their definitions."""

import struct
from collections.abc import Mapping
from typing import Any

from .definitions import members

_LITTLE_ENDIAN = bytes([0, 1, 0, 0])  # encapsulation header; alignment counts from behind it
_BYTES = ("byte", "uint8")
_NUMBERS = {"bool": "?", "byte": "B", "uint8": "B", "int32": "i", "uint32": "I", "float32": "f", "float64": "d"}


def serialize(kind: str, values: Mapping[str, Any]) -> bytes:
    """Returns the bytes of a message of the type `kind`, "geometry_msgs/msg/WrenchStamped". `values` has all its members by
    their names: numbers, str, mappings, and lists; bytes for an array of uint8."""
    body = bytearray()
    _put(body, kind, values)
    return _LITTLE_ENDIAN + bytes(body)


def _put(body: bytearray, kind: str, value: Any) -> None:
    if kind.endswith("[]"):
        _put_number(body, "I", len(value))
        element = kind.removesuffix("[]")
        if element in _BYTES:
            body += value
        else:
            for one in value:
                _put(body, element, one)
    elif kind == "string":
        text = value.encode() + b"\0"
        _put_number(body, "I", len(text))
        body += text
    elif kind in _NUMBERS:
        _put_number(body, _NUMBERS[kind], value)
    else:
        for name, each in members(kind):
            _put(body, each, value[name])


def _put_number(body: bytearray, code: str, value: float) -> None:
    body += bytes(-len(body) % struct.calcsize(code))  # each is aligned to its own size
    body += struct.pack("<" + code, value)
