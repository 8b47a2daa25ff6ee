"""tools/compare: sums of random stretches against those made here, from files and from pipes."""

import json
import os
import re
import threading
import unittest

import seed
from stubs import TOOLS, Stubs


def recording(draw, stretches):
    """Truth and measured lines of stretches of constant load; the frame ids run over 65535."""
    frame = 65400
    truth, measured, expected = [], [], []
    for _ in range(stretches):
        force = [draw.uniform(-3, 3) for _ in range(3)]
        count = draw.choice([draw.randrange(1, 15), draw.randrange(40, 300)])
        good = []
        for _ in range(count):
            frame = frame % 65535 + 1
            truth.append({"camera_frame_id": frame, "force_N": force})
            if draw.random() < 0.02:
                continue  # a frame that was lost
            valid = draw.random() > 0.1
            result = [value + draw.gauss(0, 0.05) for value in force]
            measured.append({"camera_frame_id": frame, "valid": valid, "resultant_N": result})
            if valid:
                good.append(result)
        if len(good) >= 20:
            expected.append((len(good), force, [sum(column) / len(good) for column in zip(*good)]))
    return truth, measured, expected


def text(records):
    return "".join(json.dumps(record) + "\n" for record in records)


def rows(output):
    """Frames, true and measured force of each line of the table."""
    found = []
    for line in output.splitlines():
        if re.match(r"\s+\d+\s", line):
            words = line.split()
            found.append((int(words[0]), [float(word) for word in words[1:4]], [float(word) for word in words[4:7]]))
    return found


class Compare(unittest.TestCase):
    def setUp(self):
        self.draw = seed.chance(self.id())
        self.stubs = Stubs(self)
        self.truth, self.measured = (self.stubs.scratch / name for name in ("truth", "measured"))

    def check(self, output, expected):
        found = rows(output)
        self.assertEqual([row[0] for row in found], [row[0] for row in expected])
        for row, wanted in zip(found, expected):
            for numbers, true in zip(row[1:], wanted[1:]):
                for number, value in zip(numbers, true):
                    self.assertAlmostEqual(number, value, delta=0.00051)

    def test_files(self):
        truth, measured, expected = recording(self.draw, 12)
        self.truth.write_text(text(truth))
        self.measured.write_text(text(measured) + '{"camera_frame')  # cut off by the end of its program
        code, output = self.stubs.run(TOOLS / "compare", self.truth, self.measured)
        self.assertEqual(code, 0, output)
        self.check(output, expected)

    def test_pipes_with_the_truth_behind(self):
        truth, measured, expected = recording(self.draw, 60)
        lag = self.draw.randrange(200)
        for pipe in (self.truth, self.measured):
            os.mkfifo(pipe)

        def write():
            with open(self.truth, "w") as true, open(self.measured, "w") as seen:
                given = 0
                for record in measured:
                    seen.write(text([record]))
                    seen.flush()
                    while given < len(truth) and truth[max(0, given - lag)]["camera_frame_id"] != record["camera_frame_id"]:
                        given += 1
                        if given > lag:
                            true.write(text([truth[given - lag - 1]]))
                true.write(text(truth[max(0, given - lag):]))

        writer = threading.Thread(target=write)
        writer.start()
        code, output = self.stubs.run(TOOLS / "compare", self.truth, self.measured)
        writer.join()
        self.assertEqual(code, 0, output)
        self.check(output, expected[-len(rows(output)):])
        self.assertGreater(len(rows(output)), 4)

    def test_nothing_measured_is_a_failure(self):
        self.truth.write_text(text(recording(self.draw, 2)[0]))
        self.measured.write_text("")
        self.assertEqual(self.stubs.run(TOOLS / "compare", self.truth, self.measured)[0], 1)


if __name__ == "__main__":
    unittest.main()
