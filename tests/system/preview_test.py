"""Reduced pictures of a running daemon come to who wants them, and to nobody else."""

import base64
import json
import pathlib
import sys
import time
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "client" / "python"))
import rig  # noqa: E402
import traction  # noqa: E402


class Preview(unittest.TestCase):
    def test_it_comes_while_somebody_wants_it_and_fields_go_on(self):
        with rig.Rig() as bench:
            bench.twin("idle", truth=False)
            daemon = bench.daemon()
            everything = bench.subscribe(daemon)
            everything.collect(1)
            kinds = [everything.receive()[0] for _ in range(150)]
            self.assertNotIn("preview", kinds)

            stream = ["--connect", daemon.endpoint["stream"]]
            code, text = bench.ctl("echo", "--topic", "preview", "--count", "3", *stream)
            self.assertEqual(code, 0, text)
            for line in map(json.loads, text.splitlines()):
                self.assertEqual((line["width"], line["height"], line["format"], line["scale"]), (320, 240, "rgb8", 2))
                self.assertEqual(len(base64.b64decode(line["pixels"])), 320 * 240 * 3)
            with traction.Subscriber(endpoint=daemon.endpoint["stream"], timeout=30,
                                     topics=traction.Topics.PREVIEW | traction.Topics.FIELD) as both:
                wanted, fields = [], 0
                for message in both:
                    if isinstance(message, traction.Preview):
                        wanted.append(message)
                    else:
                        fields += 1
                    if len(wanted) == 10:
                        break
            self.assertEqual(wanted[0].pixels.shape, (240, 320, 3))
            self.assertEqual(len(wanted[0].header.zero), 16)
            self.assertGreater(fields, 10)
            intervals = np.diff([one.header.received_ns for one in wanted]) * 1e-9
            print(f"every {np.median(intervals):.3f} s", end=" ", flush=True)

            # When they are gone, it ends.
            deadline = time.monotonic() + 30 * rig.PATIENCE
            count = 0
            while count < 150:  # messages running
                self.assertLess(time.monotonic(), deadline)
                count = 0 if everything.receive()[0] == "preview" else count + 1
            self.assertEqual(daemon.stop(), 0, daemon.output())

if __name__ == "__main__":
    unittest.main()
