"""The Python examples that need no camera."""

import csv
import io
import os
import pathlib
import subprocess
import sys
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[3]
EXAMPLES = SOURCE / "client" / "examples" / "python"
sys.path[:0] = [str(SOURCE / "client" / "python"), str(EXAMPLES)]
import hold_force  # noqa: E402
import seed  # noqa: E402
import traction  # noqa: E402
from publisher import Publisher  # noqa: E402
from traction.decode import decode  # noqa: E402
from traction.v1 import messages  # noqa: E402

NOW_NS = 10**12


def run(name, *words):
    environment = {**os.environ, "PYTHONPATH": str(SOURCE / "client" / "python")}
    # What libraries that are older than Python import is not the example's: as by default, deprecations in it alone count.
    warnings = ["error", "ignore::DeprecationWarning", "error::DeprecationWarning:__main__"]
    return subprocess.Popen([sys.executable, *(word for one in warnings for word in ("-W", one)), EXAMPLES / name, *words], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, env=environment)


class Examples(unittest.TestCase):
    def setUp(self):
        publisher = Publisher()
        self.addCleanup(publisher.close)
        self.stream = publisher.endpoint(publisher.stream)

    def test_log_csv(self):
        child = run("log_csv.py", "", self.stream, "20")
        out, err = child.communicate(timeout=120)
        self.assertEqual((child.returncode, err), (0, ""))
        lines = list(csv.DictReader(io.StringIO(out)))
        self.assertEqual(len(lines), 20)
        told = {(line["x_N"], line["y_N"], line["z_N"], line["valid"]) for line in lines}
        self.assertEqual(told, {("1.5", "-2.5", "3.5", "1")})
        numbers = [int(line["sequence"]) for line in lines]
        self.assertEqual(numbers, [*range(numbers[0], numbers[0] + 20)])


class Hold(unittest.TestCase):
    """The dead man's rule of hold_force.py."""

    def setUp(self):
        self.hold = hold_force.Hold(2.0)

    def field(self, number, age_s=0.01, flags=0, valid=True, boot=b"b" * 16, zero=b"z" * 16, force=1.0):
        message = messages.Field(valid=valid)
        header = message.header
        header.frame_number, header.flags, header.boot, header.zero = number, flags, boot, zero
        header.received_ns = NOW_NS - int(1e9 * age_s)
        message.resultant_N.z = force
        return decode("field", message.SerializeToString())

    def doubt(self, *words, **what):
        return self.hold.doubt(self.field(*words, **what), NOW_NS)

    def test_moves_on_fresh_sound_fields_alone(self):
        draw = seed.chance(self.id())
        number = draw.randrange(1, 10**6)
        for _ in range(20):
            number += draw.randint(1, hold_force.MOST_FRAMES)
            self.assertEqual(self.doubt(number, flags=traction.Flag.ZERO_UNVERIFIED | traction.Flag.GEL_UNVERIFIED), "")
        self.assertRegex(self.doubt(number + hold_force.MOST_FRAMES + 1), "^lost: 4 frames")

    def test_stops_on_anything_else(self):
        self.assertRegex(self.hold.doubt(None, NOW_NS), "^stale: no field for 50 ms")
        self.assertEqual(self.doubt(1), "")
        self.assertRegex(self.doubt(2, age_s=0.06), "^stale: the newest field is 60 ms old")
        self.assertRegex(self.doubt(3, valid=False), "^flagged: not valid")
        for flag in traction.Flag:
            if flag not in traction.Flag.ZERO_UNVERIFIED | traction.Flag.GEL_UNVERIFIED:
                self.assertRegex(self.doubt(4, flags=flag | traction.Flag.ZERO_UNVERIFIED), f"^flagged: {flag.name}")
        self.assertRegex(self.doubt(5, flags=1 << 20), "^flagged")  # of a later daemon
        self.assertRegex(self.doubt(6, boot=b"c" * 16), "^lost: another")
        self.assertRegex(self.doubt(7, boot=b"c" * 16, zero=b"y" * 16), "^lost: another")

    def test_pushes_when_the_force_is_too_small_and_never_faster_than_it_may(self):
        for force in (-1e9, -5, 1.9, 2.0, 2.1, 5, 1e9):
            speed = self.hold.speed_m_per_s(self.field(1, force=force))
            self.assertLessEqual(abs(speed), hold_force.FASTEST_M_PER_S)
            self.assertEqual((speed > 0, speed < 0), (force < 2, force > 2))
