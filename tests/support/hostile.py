"""Recordings that make their reader hold much: small files, as anybody may send."""

import ctypes
import ctypes.util
import struct

from traction.v1 import messages

MAGIC = b"\x89MCAP0\r\n"
BOOT = bytes(range(16))


def text(value):
    return struct.pack("<I", len(value)) + value


def record(operation, content):
    return struct.pack("<BQ", operation, len(content)) + content


def schema(number, name=b"traction.v1.Field", data=b""):
    return record(3, struct.pack("<H", number) + text(name) + text(b"protobuf") + text(data))


def channel(number, topic, metadata=b"", of=1):
    return record(4, struct.pack("<HH", number, of) + text(topic) + text(b"protobuf") + text(metadata))


def message_record(number, at, payload):
    time_ns = 10**18 + at * 16_666_667
    return record(5, struct.pack("<HIQQ", number, at, time_ns, time_ns) + payload)


def packed(records):
    """A chunk, compressed as far as that goes."""
    library = ctypes.CDLL(ctypes.util.find_library("zstd"))
    library.ZSTD_compressBound.restype = library.ZSTD_compress.restype = ctypes.c_size_t
    out = ctypes.create_string_buffer(library.ZSTD_compressBound(ctypes.c_size_t(len(records))))
    size = library.ZSTD_compress(out, ctypes.c_size_t(len(out)), records, ctypes.c_size_t(len(records)), 1)
    return record(6, struct.pack("<QQQI", 0, 2**63, len(records), 0) + text(b"zstd") + struct.pack("<Q", size) + out.raw[:size])


def payload(kind, sensor, **values):
    made = getattr(messages, kind)(**values)
    made.header.sensor, made.header.boot, made.header.sequence = sensor, BOOT, 1
    return made.SerializeToString()


def field(at, sensor="gel"):
    return payload("Field", sensor, timestamp=1.0 + at, valid=True)


def many_surfaces():
    """A description that takes a drawer hours: each of its million nodes is seen through 200,000 surfaces."""
    surface = {"centre_m": {"z": 0.05}, "index": 1.4}
    return payload("Description", "gel", nodes={"columns": 1000, "rows": 1000, "pitch_m": 1e-4}, gel={"size_m": {"z": 0.02}},
                   camera={"width_px": 640, "height_px": 480, "focal_px": 960, "aspect": 1, "position_m": {"z": 0.2}, "gel_index": 1.4,
                           "surfaces": [surface] * 200_000})


def recordings():
    """Yields name and content of each."""
    def whole(*parts):
        return MAGIC + record(1, text(b"") + text(b"")) + b"".join(parts) + record(15, bytes(4)) + record(2, bytes(20)) + MAGIC

    base = schema(1) + channel(1, b"traction/v1/gel/field/")
    some = b"".join(message_record(1, at, field(at)) for at in range(20))
    yield "many bombs", whole(base, some, *(packed(record(200, bytes(60 << 20))) for _ in range(6)))
    yield "schemas of 60 MiB", whole(base, some, *(packed(schema(2 + n, data=bytes(60 << 20))) for n in range(12)))
    yield "16,000 topics of 40 kB", whole(base, some, *(packed(b"".join(
        channel(2 + 1300 * n + k, b"traction/v1/%d/field/" % (1300 * n + k), bytes(44 << 10)) for k in range(1300))) for n in range(12)))
    yield "messages of 60 MiB", whole(base, some, *(packed(message_record(1, n, field(n) + b"\xfa\x3f\x80\x80\x80\x1c" + bytes(56 << 20))) for n in range(6)))
    yield "100,000 sensors", whole(base, *(packed(b"".join(
        message_record(1, n, payload("Field", f"{n}-{k}" + 250 * "x", timestamp=1.0)) for k in range(10_000))) for n in range(10)))
    keys = b"".join(text(b"%x" % n) + text(b"") for n in range(1_100_000))
    yield "1,100,000 keys of a channel", whole(base, some, *(packed(channel(2 + n, b"traction/v1/%d/field/" % n, keys)) for n in range(4)))
    late = record(5, struct.pack("<HIQQ", 1, 0, 2**64 - 1, 2**64 - 1))
    yield "times of 2^64 - 1", whole(base, packed(late * 1_500_000))
    description = channel(3, b"traction/v1/gel/description/")
    body = messages.Description(body={"node_positions_m": [1e-3] * 1_500_000}).SerializeToString()
    yield "descriptions of 6 MB", whole(base, description, some, *(packed(b"".join(channel(10 + n, b"traction/v1/%d/description/" % n) + message_record(
        10 + n, n, payload("Description", str(n)) + body) for n in (m,))) for m in range(20)))
    surfaces = many_surfaces()
    yield "200,000 surfaces", whole(base, description, packed(message_record(3, 0, surfaces)), some)
