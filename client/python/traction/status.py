"""The daemon's state, published once a second. Its classes are made from proto/traction/v1/status.proto.

Members have the names of the .proto file, where they are described. A member that may be absent is None then.
"""

import dataclasses
import enum
from types import GenericAlias
from typing import TYPE_CHECKING, Any

from .description import Colour
from .messages import Header
from .shapes import Doubles
from .wire import members


class CameraState(enum.Enum):
    UNKNOWN = 0  # not opened yet
    WAITING = 1  # not found yet; the daemon searches for it
    STREAMING = 2  # open and streaming
    LOST = 3  # was connected and is gone; the daemon searches for it
    CONNECTING = 4  # found; the daemon sets it up


_TYPES: dict[str, Any] = {"double": float, "uint64": int, "uint32": int, "bool": bool, "string": str,
                          "Header": Header, "Colour": Colour, "CameraState": CameraState}
_LOSSES = tuple(one.name for one in members("Ledger") if one.metric == "frames_lost_total")


def _losses(ledger: Any) -> int:
    """Returns the number of received frames that were neither published nor are in flight."""
    return sum(getattr(ledger, name) for name in _LOSSES)


def _made(name: str) -> Any:
    """Returns the class of a message. Adds it to _TYPES, after those of its members."""
    hints: list[tuple[str, Any]] = []
    for one in members(name):
        if one.name == "timestamp":  # the header's, for other programs
            continue
        hint = _TYPES[one.type] if one.type in _TYPES else _made(one.type)
        if one.is_array:
            hint = Doubles if hint is float else GenericAlias(tuple, (hint, ...))
        hints.append((one.name, hint | None if one.may_be_absent else hint))
    namespace = {"losses": property(_losses)} if name == "Ledger" else {}
    made = dataclasses.make_dataclass(name, hints, slots=True, eq=False, namespace=namespace)
    made.__module__ = __name__
    _TYPES[name] = made
    return made


if TYPE_CHECKING:
    class Status:
        header: Header

        def __getattr__(self, name: str) -> Any: ...

    class Ledger:
        losses: int

        def __getattr__(self, name: str) -> int: ...

    class Histogram:
        def __getattr__(self, name: str) -> Any: ...
else:
    _made("Status")
    globals().update({name: kind for name, kind in _TYPES.items() if dataclasses.is_dataclass(kind)})
