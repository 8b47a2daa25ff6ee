"""What tractionctl prints of one status in which every field is set: as JSON and as metrics.

The expected output is in tests/golden/status. Run with TRACTION_RECORD=1 to write it anew.
"""

import os
import pathlib
import re
import unittest

from ctl import Case, ctl
from traction.v1 import messages

GOLDEN = pathlib.Path(__file__).resolve().parents[2] / "golden" / "status"


def leaf(field, number):
    """Returns a value that no other field has."""
    if field.enum_type:
        values = field.enum_type.values
        return values[2 if field.name == "camera" else 1 + number % (len(values) - 1)].number
    return {field.TYPE_DOUBLE: number * 1.0078125e-3, field.TYPE_BOOL: True, field.TYPE_STRING: f"text {number}",
            field.TYPE_BYTES: bytes(range(number % 200, number % 200 + 16))}.get(field.type, number)


def fill(message, numbers):
    """Sets every field, in the order of the numbers; arrays get two elements, and a histogram one count more."""
    for field in sorted(message.DESCRIPTOR.fields, key=lambda one: one.number):
        is_repeated = field.label == field.LABEL_REPEATED
        if field.message_type:
            for _ in range(2 if is_repeated else 1):
                part = getattr(message, field.name)
                fill(part.add() if is_repeated else part, numbers)
        elif is_repeated:
            getattr(message, field.name).extend(leaf(field, next(numbers))
                                                for _ in range(3 if field.name == "count" else 2))
        else:
            setattr(message, field.name, leaf(field, next(numbers)))


def full_status():
    status = messages.Status()
    fill(status, iter(range(1001, 3000)))
    status.header.flags = 0x1FF
    status.header.sensor = "gel"
    status.scheduling.threads[1].priority = 0
    return status


class StatusAsPrinted(Case):
    def reply(self, request):
        reply = messages.Reply(version=1)
        if request.WhichOneof("request") == "status":
            reply.status.CopyFrom(self.status)
        return reply

    def agrees(self, name, *words):
        _, control = self.publisher(self.reply)[2:]
        code, out, err = ctl(*words, "--control", control)
        self.assertEqual((code, err), (0, ""))
        out = re.sub(r'"arrived_ns":\d+', '"arrived_ns":0', out)
        file = GOLDEN / name
        if os.environ.get("TRACTION_RECORD"):
            file.write_text(out)
        self.assertEqual(out, file.read_text())

    def test_every_field_is_printed_as_recorded(self):
        self.status = full_status()
        self.agrees("full.json", "status", "--json")
        self.agrees("full.prom", "metrics")

    def test_what_is_not_set_is_printed_as_recorded(self):
        self.status = messages.Status(camera=messages.CAMERA_STATE_STREAMING)
        self.status.header.sensor = "gel"
        self.agrees("empty.json", "status", "--json")
        self.agrees("empty.prom", "metrics")


if __name__ == "__main__":
    unittest.main()
