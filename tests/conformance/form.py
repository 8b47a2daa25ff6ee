"""The form in which readers tell what they have read: the JSON of `tractionctl echo`."""

import base64

import numpy as np

from contract import ENUMS, IDS, MASKS, MESSAGES, TOGETHER, Type, is_repeated, name_of

OPTIONAL = {("Description", "zero"), ("Description", "body"), ("Status", "rest_drift"), ("Status", "camera_link"),
            ("TrackedContact", "slip")}
FLAGS = {one.number: one.name.removeprefix("FLAG_").lower() for one in ENUMS["Flag"].value if one.number}


def word(enum, value):
    words = {one.number: one.name for one in enum.value}
    prefix = words[0].rsplit("_", 1)[0] + "_"
    return words.get(value, words[0]).removeprefix(prefix).lower()


def by(width, values):
    return [values[i:i + width] for i in range(0, len(values), width)] if width > 1 else list(values)


def plain(name, values):
    """Every member, set or not, as JSON has it."""
    if name in ("Vector2", "Vector3"):
        return [values.get(axis, 0.0) for axis in "xyz"[:int(name[-1])]]
    out = {}
    for field in MESSAGES[name].field:
        member, value = field.name, values.get(field.name)
        if member in MASKS:
            out[member] = [bool(byte) for byte in value or b""]
        elif is_repeated(field):
            if field.type == Type.TYPE_MESSAGE:
                out[member] = [plain(name_of(field), each) for each in value or []]
            else:
                out[member] = by(TOGETHER.get(name, {}).get(member, 1), value or ([0.0] * 9 if name == "Covariance" else []))
        elif field.type == Type.TYPE_MESSAGE:
            out[member] = None if value is None and (name, member) in OPTIONAL else plain(name_of(field), value or {})
        elif field.type == Type.TYPE_ENUM:
            out[member] = word(ENUMS[name_of(field)], value or 0)
        elif member == "pixels":
            out[member] = base64.b64encode(value or b"").decode()
        elif field.type == Type.TYPE_BYTES:
            out[member] = (value or b"").hex()
        elif value is None:
            out[member] = (None if field.proto3_optional else
                           "" if field.type == Type.TYPE_STRING else False if field.type == Type.TYPE_BOOL else 0)
        else:
            out[member] = value
    if name == "Header":
        out["flags"] = [word for bit, word in FLAGS.items() if out["flags"] & bit]
    if name == "Camera" and out["aspect"] == 0:  # of a daemon that knows square pixels alone
        out["aspect"] = 1.0
    return out


def echo(kind, message):
    """The members of a message as tractionctl names and nests them. `kind`: "field", or "zero" of Control's."""
    out = dict(message)
    if kind == "zero":
        zero = out.pop("zero")
        return {**{name: zero[name] for name in ("id", "time_ns", "requested", "requested_by")}, **out}
    for name in ("timestamp", "host"):
        out.pop(name, None)
    out = {"topic": kind, **out.pop("header"), **out}
    out.pop("arrived_ns", None)
    if kind == "field" and not out.pop("centre_of_pressure_valid"):
        out["centre_of_pressure_m"] = None
    if kind == "description":
        out["layers"] = [{**{name: value for name, value in layer.items() if name != "darker"},
                          "contrast": "darker" if layer["darker"] else "brighter"} for layer in out["layers"]]
        if not out["layers"]:
            out["gel"] = None  # no markers: the daemon runs without a gel
        out["calibration_time_ns"] = message["calibration"]["time_ns"]
        out["calibration"] = message["header"]["calibration"]
        out["zero"], out["rest_pose"] = message["header"]["zero"], message["zero"]
    return out


def difference(expected, told, where=""):
    """What first differs, or None. A float is compared as one."""
    if isinstance(expected, dict) and isinstance(told, dict):
        for name in sorted(expected.keys() | told.keys()):
            if name not in expected or name not in told:
                return f"{where}.{name} is only on one side"
            found = difference(expected[name], told[name], f"{where}.{name}")
            if found:
                return found
        return None
    if isinstance(expected, list) and isinstance(told, list):
        if len(expected) != len(told):
            return f"{where}: {len(told)} elements instead of {len(expected)}"
        return next(filter(None, (difference(a, b, f"{where}[{i}]") for i, (a, b) in enumerate(zip(expected, told)))), None)
    same = (np.float32(told) == expected if isinstance(expected, np.float32) and isinstance(told, (int, float))
            else expected == told and isinstance(expected, bool) == isinstance(told, bool))
    return None if same else f"{where}: {told!r} instead of {expected!r}"
