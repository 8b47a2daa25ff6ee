"""The committed contract: random messages of it, and their bytes. Has nothing of any client, and encodes by itself.

A message is a dict: names of proto/traction/v1 -> numbers, text, bytes, lists, dicts; what is not there is not set.
"""

import pathlib
import struct

import numpy as np
from google.protobuf import descriptor_pb2

DESCRIPTORS = pathlib.Path(__file__).resolve().parents[2] / "proto" / "traction" / "v1.descriptors"
FILES = descriptor_pb2.FileDescriptorSet.FromString(DESCRIPTORS.read_bytes()).file
MESSAGES = {message.name: message for file in FILES for message in file.message_type}
ENUMS = {enum.name: enum for file in FILES for enum in file.enum_type}
Type = descriptor_pb2.FieldDescriptorProto

# Members of a message whose lengths go together: so many to each of what they are about.
TOGETHER = {
    "Field": {"force_N": 3, "node_deviation_N": 3, "node_valid": 1},
    "Markers": {"displacement_px": 2, "variance_px2": 1, "marker_valid": 1},
    "Zero": {"rest_position_px": 2, "marker_present": 1},
    "Body": {"node_positions_m": 3, "node_normals": 3, "node_areas_m2": 1, "marker_positions_m": 3},
}
IDS = {"boot", "calibration", "zero", "id", "host", "run"}
MASKS = {"node_valid", "marker_valid", "marker_present"}
PACKED = {Type.TYPE_DOUBLE: "<d", Type.TYPE_FLOAT: "<f"}
LIMITS = {Type.TYPE_UINT32: (0, 2**32 - 1), Type.TYPE_UINT64: (0, 2**64 - 1), Type.TYPE_INT32: (-2**31, 2**31 - 1),
          Type.TYPE_INT64: (-2**63, 2**63 - 1)}


def name_of(field):
    """Of a message or enum."""
    return field.type_name.rsplit(".", 1)[1]


def is_repeated(field):
    return field.label == Type.LABEL_REPEATED


def varint(number):
    number &= 2**64 - 1
    out = bytearray()
    while number > 127:
        out.append(number & 127 | 128)
        number >>= 7
    out.append(number)
    return bytes(out)


def key(number, kind):
    return varint(number << 3 | kind)


def run(number, content):
    """Of known length."""
    return key(number, 2) + varint(len(content)) + content


def encode_one(field, value, chance):
    kind, number = field.type, field.number
    if kind == Type.TYPE_MESSAGE:
        return run(number, encode(name_of(field), value, chance))
    if kind in (Type.TYPE_STRING, Type.TYPE_BYTES):
        return run(number, value.encode() if isinstance(value, str) else value)
    if kind in PACKED:
        return key(number, 1 if kind == Type.TYPE_DOUBLE else 5) + struct.pack(PACKED[kind], value)
    return key(number, 0) + varint(int(value))


def encode_numbers(field, values, chance):
    """Packed, at times in two runs: both are the protocol's."""
    cut = chance.randrange(len(values) + 1) if chance and chance.random() < 0.2 else 0
    out = b""
    for part in (values[:cut], values[cut:]):
        if part:
            packed = (struct.pack(f"<{len(part)}{PACKED[field.type][1]}", *part) if field.type in PACKED
                      else b"".join(varint(one) for one in part))
            out += run(field.number, packed)
    return out


def strange(chance):
    """A member of a later version."""
    number = chance.randrange(1000, 2**29)
    return chance.choice([key(number, 0) + varint(chance.getrandbits(64)), key(number, 1) + bytes(8),
                          key(number, 5) + bytes(4), run(number, chance.randbytes(chance.randrange(20)))])


def encode(name, values, chance=None):
    """`chance`: members behind the first in any order, and some that nobody knows."""
    fields = {field.name: field for field in MESSAGES[name].field}
    parts = []
    for member, value in values.items():
        field = fields[member]
        if not is_repeated(field):
            parts.append(encode_one(field, value, chance))
        elif field.type in (Type.TYPE_MESSAGE, Type.TYPE_STRING, Type.TYPE_BYTES):
            parts.append(b"".join(encode_one(field, each, chance) for each in value))
        else:
            parts.append(encode_numbers(field, value, chance))
    if chance:
        rest = parts[1:] + [strange(chance) for _ in range(chance.choice([0, 0, 0, 1, 2]))]
        chance.shuffle(rest)
        parts[1:] = rest
    return b"".join(parts)


def number(chance, single):
    """Finite. A float is one of NumPy's, which tells that it has 24 bits."""
    drawn = chance.choice([0.0, 1.0, -1e-30, 1e30, chance.gauss(0, 1), chance.gauss(0, 1) * 10 ** chance.uniform(-12, 12)])
    return np.float32(drawn) if single else drawn


def text(chance):
    return "".join(chance.choice('aZ09_-/\\"\'\n\t\x7f\x01éß漢𝛑 ') for _ in range(chance.randrange(12)))


def draw_one(field, chance, count):
    kind = field.type
    if kind == Type.TYPE_MESSAGE:
        return draw(name_of(field), chance, count)
    if kind == Type.TYPE_STRING:
        return text(chance)
    if kind == Type.TYPE_BYTES:
        return chance.choice([b"", chance.randbytes(16), chance.randbytes(16)]) if field.name in IDS else chance.randbytes(5)
    if kind in PACKED:
        return number(chance, kind == Type.TYPE_FLOAT)
    if kind == Type.TYPE_BOOL:
        return chance.random() < 0.5
    if kind == Type.TYPE_ENUM:
        return chance.choice([one.number for one in ENUMS[name_of(field)].value] + [77])  # 77: of a later version
    low, high = LIMITS[kind]
    return chance.choice([low, high, 0, 1, chance.randint(low, high), chance.randint(0, 1000)])


def draw(name, chance, count=None):
    """A random message; `count`: nodes, markers. Members are set or, with a chance, not."""
    count = chance.randrange(40) if count is None else count
    together = TOGETHER.get(name, {})
    values = {}
    for field in MESSAGES[name].field:
        member = field.name
        if member not in together and chance.random() < 0.15:
            continue
        if member in MASKS:
            values[member] = bytes(chance.getrandbits(1) for _ in range(count))
        elif is_repeated(field):
            length = (together[member] * count if member in together
                      else 9 if name == "Covariance"
                      else len(values.get("bound_s", ())) + 1 if (name, member) == ("Histogram", "count")
                      else chance.randrange(4))
            values[member] = [draw_one(field, chance, None) for _ in range(length)]
        else:
            values[member] = draw_one(field, chance, count if member == "zero" else None)
    if name == "Preview":
        values.update(width=chance.randrange(12), height=chance.randrange(12), format=chance.choice([1, 2]))
        values["pixels"] = chance.randbytes(values["width"] * values["height"] * (3 if values["format"] == 2 else 1))
    if name == "Field" and chance.random() < 0.3:
        values["node_deviation_N"] = []
    return values
