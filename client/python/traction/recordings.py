"""Reads recordings (MCAP) of tractionctl and tractiond. docs/recordings.md says what is in them."""

import re
import struct
import warnings
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from os.path import isfile
from typing import BinaryIO

from .decode import KINDS, Message, decode
from .errors import Malformed
from .sources import Sources
from .wire import parse

_MAGIC = b"\x89MCAP0\r\n"
_CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 4, 5, 6, 15
_LONGEST = 65 << 20  # bytes of a record, as in recording/reader.h
_RECOVER = "tractionctl recover makes a whole recording of what can be read"
_TOPIC = re.compile(rb"traction/v1/[^/]*/(.*)/")


@dataclass(frozen=True, eq=False)
class Recorded:
    """A message of a recording, with its times [ns since 1970]."""

    log_time_ns: int  # when the recorder received it
    publish_time_ns: int  # of what is about a frame: when that was captured
    message: Message


def recording(path: str | PathLike[str]) -> Iterator[Recorded]:
    """Yields the messages of a recording in the order in which they were received; those of other topics are left out. Raises
    OSError, and Malformed for what is no recording, or compressed (`mcap decompress` makes one that is not), and where it is cut
    off or damaged, after what stands before. Where two sources have one name, the second one's are left out, with a warning."""
    sources = Sources()
    try:
        for kind, log_ns, _, payload in _messages(path) if isfile(path) else ():  # a pipe is read once
            if kind != "preview":
                sources.take(*_identity(kind, payload), log_ns)
    except (Malformed, OSError):  # which is said below
        pass
    if sources.trouble:
        warnings.warn(f"{path}: {sources.trouble}", stacklevel=2)
    for kind, log_ns, publish_ns, payload in _messages(path):
        if not (sources.trouble and sources.is_second(*_identity(kind, payload))):
            yield Recorded(log_ns, publish_ns, decode(kind, payload))


def _identity(kind: str, payload: bytes) -> tuple[tuple[str, str], bytes]:
    """As identity_of(), without the work of decode()."""
    message = parse(KINDS[kind][0], payload)
    of = KINDS[kind][0] if kind in ("contacts", "grasp") else ""
    return (of, message.header.sensor), message.run if kind == "contacts" else message.header.boot


def _messages(path: str | PathLike[str]) -> Iterator[tuple[str, int, int, bytes]]:
    """Yields kind, log time, publish time and bytes of each."""
    with open(path, "rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise Malformed(f"{path} is no recording")
        topics: dict[int, bytes] = {}  # by channel
        try:
            for operation, content in _records(file, str(path)):
                if operation == _CHANNEL:
                    number, length = struct.unpack_from("<H2xI", content)
                    topic = content[8:8 + length]
                    if len(topic) < length or topics.setdefault(number, topic) != topic:
                        raise struct.error
                elif operation == _MESSAGE:
                    number, log_ns, publish_ns = struct.unpack_from("<H4xQQ", content)
                    match = _TOPIC.fullmatch(topics.get(number, b""))
                    if match and (kind := match[1].decode(errors="replace")) in KINDS:
                        yield kind, log_ns, publish_ns, content[22:]
        except struct.error:
            raise Malformed(f"{path} is damaged; {_RECOVER}") from None


def _records(file: BinaryIO, path: str) -> Iterator[tuple[int, bytes]]:
    """Yields the records up to the summary, those of chunks one by one. Raises struct.error for what contradicts itself."""
    while len(head := file.read(9)) == 9:
        operation, length = struct.unpack("<BQ", head)
        if operation == _DATA_END:
            return
        if length > _LONGEST:
            raise struct.error
        content = file.read(length)
        if len(content) < length:
            break
        if operation != _CHUNK:
            yield operation, content
            continue
        size, checksum, name = struct.unpack_from("<QII", content, 16)
        if name:
            raise Malformed(f"{path} is compressed; mcap decompress makes a recording that can be read")
        records = content[40:]
        if len(records) != size or (checksum and checksum != zlib.crc32(records)):
            raise struct.error
        at = 0
        while at < len(records):
            operation, length = struct.unpack_from("<BQ", records, at)
            if length > len(records) - at - 9:
                raise struct.error
            yield operation, records[at + 9:at + 9 + length]
            at += 9 + length
    raise Malformed(f"{path} was not closed; {_RECOVER}")
