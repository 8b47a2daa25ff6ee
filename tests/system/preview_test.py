"""Reduced pictures of a running daemon come to who wants them, and to nobody else."""

import base64
import json
import pathlib
import sys
import time
import unittest

import numpy as np
import zmq

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

    def test_through_a_gateway_it_comes_to_who_may_control(self):
        with rig.Rig() as bench:
            bench.twin("idle", truth=False)
            daemon = bench.daemon()
            reader, ada = zmq.curve_keypair(), zmq.curve_keypair()
            bench.allow("reader", reader[0].decode())
            server = bench.allow("ada", ada[0].decode(), "--control")
            keys = {name: (server, pair[0].decode(), pair[1].decode()) for name, pair in (("reader", reader), ("ada", ada))}
            gateway = bench.gateway(daemon, 'preview = ["tcp://127.0.0.1:*"]\n')
            everything = {name: bench.subscribe(gateway, "", keys[name]) for name in keys}
            named = {name: bench.subscribe(gateway, "traction/v1/default/preview/", keys[name]) for name in keys}
            for one in everything.values():
                one.collect(10)
            refused = rig.Subscriber(bench, gateway.endpoint["preview"], "", keys["reader"])
            gateway.wait_for('"reader" may only read')
            looker = rig.Subscriber(bench, gateway.endpoint["preview"], "", keys["ada"])
            seen = looker.collect(10, "preview", 30)
            self.assertEqual({one.width for one in seen}, {320})
            for name in keys:  # all that has come in the meantime, and more
                kinds = {everything[name].receive()[0] for _ in range(200)}
                self.assertNotIn("preview", kinds)
                self.assertIsNone(named[name].receive(0))
            self.assertIsNone(refused.receive(0))

            # When nobody looks any more, none are made.
            looker.socket.close(0)
            witness = bench.subscribe(daemon)
            deadline = time.monotonic() + 30 * rig.PATIENCE
            count = 0
            while count < 150:  # messages running
                self.assertLess(time.monotonic(), deadline)
                count = 0 if witness.receive()[0] == "preview" else count + 1
            again = rig.Subscriber(bench, gateway.endpoint["preview"], "traction/v1/", keys["ada"])
            again.collect(1, "preview", 30)


if __name__ == "__main__":
    unittest.main()
