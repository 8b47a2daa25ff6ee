"""What arrives at a subscriber -> messages, with an account of what did not arrive. Knows no sockets."""

import enum
import math
import re
import time

from .decode import Message, decode
from .errors import BadEndpoint, Malformed, OtherVersion
from .messages import Contacts
from .paired_contacts import PairedContacts
from .sources import Sources, identity_of

_TOPICS = b"traction/"  # begins every topic, of whatever version
_TOPIC_ROOT = b"traction/v1/"
_TOPIC = re.compile(rb"traction/v1/[^/]*/(.*)/", re.DOTALL)
_OF_SENSOR = re.compile(rb"traction/v1/[A-Za-z0-9_-]{1,24}/")


class Mode(enum.Enum):
    STREAM = "stream"  # every message, in order
    LATEST = "latest"  # the newest field only: what was not read in time is replaced. For controllers


class Topics(enum.Flag):
    """Which messages; or-ed."""

    FIELD = 1
    MARKERS = 2
    DESCRIPTION = 4
    STATUS = 8
    ALL = 15  # but previews: the daemon makes them while somebody wants them; and contacts and grasps, of another program
    PREVIEW = 16
    # Each connects to the instance's traction-touch, too; without topics of tractiond: to nothing else.
    CONTACTS = 32
    GRASP = 64  # `instance` is the name of a hand
    OF_TOUCH = 96  # both of these


_WANTED = {one.name.lower().encode(): one for one in (Topics.FIELD, Topics.MARKERS, Topics.DESCRIPTION, Topics.STATUS,
                                                      Topics.PREVIEW, Topics.CONTACTS, Topics.GRASP) if one.name}
# Without a message of traction-touch its contacts end. It sends one for each field, and while there are contacts at least
# two a second.
_TOUCH_SILENCE_S = 1.0


def _printable(text: bytes) -> str:
    """From anywhere, for people: what a terminal would take as a command is left out."""
    return "".join(chr(byte) if 0x20 <= byte <= 0x7E else "?" for byte in text[:64])


class Intake:
    """One for each subscriber."""

    def __init__(self, endpoint: str, mode: Mode, topics: Topics) -> None:
        self._endpoint, self._mode, self._topics = endpoint, mode, topics
        self._seen: dict[bytes, tuple[bytes, int]] = {}  # topic -> last boot and sequence
        self._kinds: dict[bytes, str | None] = {}  # topic -> "field"; None: not wanted, or of a later daemon
        self._sensors: set[bytes] = set()  # whose previews were asked for
        self._boots: dict[str, bytes] = {}  # sensor -> its daemon's last start
        self._touches: dict[bytes, tuple[PairedContacts, float]] = {}  # topic -> contacts, time of its last message
        self.sources = Sources()
        self.lost = 0
        self.restarts = 0

    def take(self, parts: list[bytes]) -> Message | None:
        """None: nothing that was asked for. Raises Malformed, OtherVersion, BadEndpoint."""
        now = time.monotonic_ns()
        if self._mode is Mode.LATEST:
            if len(parts) != 1:
                raise Malformed(f"{self._endpoint} sends a field in several parts")
            topic, kind, payload = b"", "field", parts[0]
        else:
            topic = parts[0]
            found = self._kind(topic, len(parts))
            if found is None:
                return None
            if len(parts) < 2:
                raise Malformed(f"{self._endpoint} sends a topic without a message")
            kind, payload = found, parts[1]
        message = decode(kind, payload)
        header = message.header
        header.arrived_ns = now
        if not self.sources.take(*identity_of(message), now):
            return None
        if self._boots.setdefault(header.sensor, header.boot) != header.boot:
            self._boots[header.sensor] = header.boot
            self.restarts += 1
        if self._mode is Mode.STREAM:
            boot, sequence = self._seen.get(topic, (b"", 0))
            if boot == header.boot and sequence != 0 and header.sequence > sequence + 1:
                self.lost += header.sequence - sequence - 1
            self._seen[topic] = (header.boot, header.sequence)
        if isinstance(message, Contacts):
            contacts, _ = self._touches.get(topic, (PairedContacts(), 0.0))
            self._touches[topic] = contacts, time.monotonic()
            contacts.complete(message)
        return message

    def until_silence_s(self) -> float:
        """Time until contacts end, as traction-touch was not heard; inf: there are none."""
        heard = min((heard for contacts, heard in self._touches.values() if contacts.are_open), default=math.inf)
        return heard + _TOUCH_SILENCE_S - time.monotonic()

    def end_silent(self) -> Contacts | None:
        """Ends the contacts of a silent traction-touch. Only while nothing waits: a slow reader is not taken for a silence."""
        for contacts, heard in self._touches.values():
            if contacts.are_open and time.monotonic() - heard >= _TOUCH_SILENCE_S:
                return contacts.end_all(time.monotonic_ns())
        return None

    def wanted_too(self, parts: list[bytes]) -> bytes | None:
        """What to subscribe to, now that this is known: the daemon makes previews for subscribers that name them, and their
        topic has the name of the sensor in it."""
        if self._mode is Mode.LATEST or Topics.PREVIEW not in self._topics:
            return None
        match = _OF_SENSOR.match(parts[0])
        if match is None or match[0] in self._sensors:
            return None
        self._sensors.add(match[0])
        return match[0] + b"preview/"

    def _kind(self, topic: bytes, parts: int) -> str | None:
        if topic in self._kinds:
            return self._kinds[topic]
        if parts == 1 and not topic.startswith(_TOPICS):
            raise BadEndpoint(f"{self._endpoint} has no topics; is it the endpoint 'latest' instead of 'stream'?")
        if not topic.startswith(_TOPIC_ROOT):
            raise OtherVersion(f"{self._endpoint} publishes {_printable(topic)}, this library reads {_TOPIC_ROOT.decode()}")
        match = _TOPIC.fullmatch(topic)
        wanted = match is not None and match[1] in _WANTED and _WANTED[match[1]] in self._topics
        kind = match[1].decode() if match is not None and wanted else None
        self._kinds[topic] = kind
        return kind
