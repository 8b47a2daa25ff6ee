"""Writes recordings in the format MCAP, https://mcap.dev/spec: chunks without compression, an index, checksums."""

import struct
import zlib
from collections.abc import Mapping
from typing import BinaryIO

_MAGIC = b"\x89MCAP0\r\n"
_CHUNK_BYTES = 1 << 20  # after which a chunk is written
(_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX, _STATISTICS, _METADATA, _METADATA_INDEX,
 _SUMMARY_OFFSET, _DATA_END) = (1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 13, 14, 15)


def _text(text: str) -> bytes:
    encoded = text.encode()
    return struct.pack("<I", len(encoded)) + encoded


def _map(entries: bytes) -> bytes:
    return struct.pack("<I", len(entries)) + entries


def _texts(table: Mapping[str, str]) -> bytes:
    return _map(b"".join(_text(key) + _text(value) for key, value in table.items()))


def _record(kind: int, content: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(content)) + content


class McapWriter:
    """Belongs to one thread. The file has an index once close() has been called; a file that was cut off before is read from
    front to back. Raises OSError."""

    def __init__(self, file: BinaryIO, profile: str, library: str) -> None:
        """`file` is empty, and stays the caller's to close."""
        self._file = file
        self._at = 0
        self._chunk = bytearray()
        self._times: dict[int, list[tuple[int, int]]] = {}  # channel -> log time and offset of its messages in this chunk
        self._schemas: list[bytes] = []  # records, as they are repeated in the summary
        self._channels: list[bytes] = []
        self._chunk_indexes: list[bytes] = []
        self._metadata_indexes: list[bytes] = []
        self._counts: dict[int, int] = {}  # channel -> messages
        self._first_ns, self._last_ns = 2**64 - 1, 0
        self._put(_MAGIC + _record(_HEADER, _text(profile) + _text(library)))

    def add_metadata(self, name: str, table: Mapping[str, str]) -> None:
        """Before the first channel."""
        record = _record(_METADATA, _text(name) + _texts(table))
        self._metadata_indexes.append(_record(_METADATA_INDEX, struct.pack("<QQ", self._at, len(record)) + _text(name)))
        self._put(record)

    def add_channel(self, topic: str, kind: str, schema_encoding: str, schema: str, message_encoding: str,
                    metadata: Mapping[str, str]) -> int:
        """Returns the channel's number."""
        id = len(self._channels) + 1
        self._schemas.append(_record(_SCHEMA, struct.pack("<H", id) + _text(kind) + _text(schema_encoding) + _text(schema)))
        self._channels.append(_record(_CHANNEL, struct.pack("<HH", id, id) + _text(topic) + _text(message_encoding)
                                      + _texts(metadata)))
        self._chunk += self._schemas[-1] + self._channels[-1]
        self._counts[id] = 0
        return id

    def write(self, channel: int, log_ns: int, publish_ns: int, data: bytes) -> None:
        """Appends a message. `log_ns`: when it was received, `publish_ns`: when it was made [ns since the epoch]."""
        self._times.setdefault(channel, []).append((log_ns, len(self._chunk)))
        self._counts[channel] += 1
        head = struct.pack("<HIQQ", channel, self._counts[channel] & 0xFFFFFFFF, log_ns, publish_ns)
        self._chunk += _record(_MESSAGE, head + data)
        if len(self._chunk) >= _CHUNK_BYTES:
            self._end_chunk()

    def close(self) -> None:
        """Writes what is left, and the index."""
        self._end_chunk()
        self._put(_record(_DATA_END, struct.pack("<I", 0)))
        counts = b"".join(struct.pack("<HQ", *each) for each in self._counts.items())
        total = sum(self._counts.values())
        statistics = _record(_STATISTICS, struct.pack(
            "<QHIIIIQQ", total, len(self._schemas), len(self._channels), 0, len(self._metadata_indexes),
            len(self._chunk_indexes), self._first_ns if total else 0, self._last_ns) + _map(counts))
        begin, summary, offsets = self._at, b"", b""
        for kind, records in ((_SCHEMA, self._schemas), (_CHANNEL, self._channels), (_STATISTICS, [statistics]),
                              (_CHUNK_INDEX, self._chunk_indexes), (_METADATA_INDEX, self._metadata_indexes)):
            group = b"".join(records)
            if group:
                offsets += _record(_SUMMARY_OFFSET, struct.pack("<BQQ", kind, begin + len(summary), len(group)))
            summary += group
        head = struct.pack("<BQQQ", _FOOTER, 20, begin, begin + len(summary))
        self._put(summary + offsets + head + struct.pack("<I", zlib.crc32(summary + offsets + head)) + _MAGIC)

    def _put(self, content: bytes) -> None:
        self._file.write(content)
        self._at += len(content)

    def _end_chunk(self) -> None:
        if not self._chunk:
            return
        times = [time for messages in self._times.values() for time, _ in messages]
        first, last = min(times, default=0), max(times, default=0)
        if times:
            self._first_ns, self._last_ns = min(self._first_ns, first), max(self._last_ns, last)
        size = len(self._chunk)
        chunk = _record(_CHUNK, struct.pack("<QQQI", first, last, size, zlib.crc32(self._chunk)) + _text("")
                        + struct.pack("<Q", size) + self._chunk)
        at, offsets, indexes = self._at, b"", b""
        for channel, messages in self._times.items():
            offsets += struct.pack("<HQ", channel, at + len(chunk) + len(indexes))
            indexes += _record(_MESSAGE_INDEX, struct.pack("<H", channel)
                               + _map(b"".join(struct.pack("<QQ", *each) for each in messages)))
        self._put(chunk + indexes)
        self._chunk_indexes.append(_record(_CHUNK_INDEX, struct.pack("<QQQQ", first, last, at, len(chunk)) + _map(offsets)
                                           + struct.pack("<Q", len(indexes)) + _text("") + struct.pack("<QQ", size, size)))
        self._chunk.clear()
        self._times.clear()
