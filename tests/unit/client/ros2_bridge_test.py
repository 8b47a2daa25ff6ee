"""The bridge to ROS 2 with a file in the place of ROS: what is written, and what ends it."""

import contextlib
import io
import pathlib
import signal
import tempfile
import threading
import unittest
from unittest import mock

from ros2_sensor import Sensor  # first: it lets the client be imported

import seed
import zmq
from deadline import HUNG_S

import ros2_bridge
import traction
from traction import ros2


class Bridge(unittest.TestCase):
    def setUp(self):
        for each in (signal.SIGINT, signal.SIGTERM):
            self.addCleanup(signal.signal, each, signal.getsignal(each))
        self.context = zmq.Context()
        self.addCleanup(self.context.destroy, 0)
        self.publisher = self.context.socket(zmq.XPUB)
        self.publisher.rcvtimeo = int(1000 * HUNG_S)
        self.publisher.bind("tcp://127.0.0.1:*")
        self.stream = self.publisher.getsockopt_string(zmq.LAST_ENDPOINT)
        self.sensor = Sensor(seed.chance(self.id()))
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))

    def send(self, *sent, sensor="gel-1"):
        """Sends to the first subscriber, from a thread."""
        def run():
            self.publisher.recv()
            for kind, payload in sent:
                self.publisher.send_multipart([f"traction/v1/{sensor}/{kind}/".encode(), payload, b"0.0"])
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        self.addCleanup(thread.join)

    def test_another_sensor_ends_it_and_the_file_is_whole(self):
        other = Sensor(self.sensor.draw, "gel-2")
        self.send(self.sensor.field(), other.field())
        path = self.folder / "new.mcap"
        with self.assertRaisesRegex(traction.Error, "the sensor was 'gel-1' and is now 'gel-2'"):
            ros2_bridge.main(["--stream", self.stream, "--output", str(path), "--count", "2"])
        self.assertEqual((path.read_bytes()[:8], path.read_bytes()[-8:]), (b"\x89MCAP0\r\n",) * 2)

    def test_goes_on_after_a_message_that_is_none_and_ends_on_a_signal(self):
        self.send(("field", b"\xff"), self.sensor.field(), self.sensor.field())
        path, told, written = self.folder / "new.mcap", io.StringIO(), []

        class Output(ros2_bridge.File):
            def write(self, sample):
                super().write(sample)
                written.append(sample.topic)
                signal.raise_signal(signal.SIGTERM)

        with mock.patch.object(ros2_bridge, "File", Output), contextlib.redirect_stderr(told):
            ros2_bridge.main(["--stream", self.stream, "--output", str(path), "--count", "2"])
        self.assertEqual(written, [ros2.WRENCH, ros2.DIAGNOSTICS])  # of one field
        self.assertEqual(path.read_bytes()[-8:], b"\x89MCAP0\r\n")
        self.assertRegex(told.getvalue(), r"\Aros2_bridge: a message is left out: .*\n\Z")
