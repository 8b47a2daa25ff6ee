"""Tells apart the programs that publish under one name: as client/src/sources.h."""

from .decode import Message
from .messages import Contacts, Grasp

# Time without a message after which a source has lost its name: a daemon sends its status once a second.
_GONE_NS = 2_500_000_000

_Key = tuple[str, str]


def identity_of(message: Message) -> tuple[_Key, bytes]:
    """What publishes, and for which sensor or hand; and which of its starts that is."""
    header = message.header
    kind = type(message).__name__ if isinstance(message, (Contacts, Grasp)) else ""
    return (kind, header.sensor), message.run if isinstance(message, Contacts) else header.boot


class Sources:
    """A daemon that is started anew has another boot, and the one before does not come back. Where it does, two daemons have
    one sensor.name: it belongs to the one that was heard first. The same holds of the runs of traction-touch."""

    def __init__(self) -> None:
        self._names: dict[_Key, tuple[list[bytes], int]] = {}  # starts one after the other, time of the last message
        self._seconds: set[tuple[_Key, bytes]] = set()
        self.trouble = ""  # a sentence on the first two sources of one name
        self.returns = 0  # how often a source was heard again after another one of its name

    def take(self, key: _Key, id: bytes, now_ns: int) -> bool:
        """Tells whether a message is of the source that has the name. The first one of another source is taken for that of a
        restart: it becomes clear with the next one of the first source."""
        ids, heard_ns = self._names.get(key, ([], 0))
        if not ids or ids[-1] != id:
            if (key, id) in self._seconds and now_ns - heard_ns < _GONE_NS:
                return False
            if id in ids:
                after = ids.index(id) + 1
                self.returns += 1
                self.trouble = self.trouble or (
                    f"two sources are called '{key[1]}' at once (boot or run {id[:4].hex()}... and {ids[after][:4].hex()}...); "
                    "what the second one sends is left out: give each its sensor.name")
                self._seconds.update((key, each) for each in ids[after:])
                del ids[after:]
            else:
                ids.append(id)
        self._names[key] = ids, now_ns
        return True

    def is_second(self, key: _Key, id: bytes) -> bool:
        """Whether a source is second under its name, as far as take() has found out."""
        return (key, id) in self._seconds
