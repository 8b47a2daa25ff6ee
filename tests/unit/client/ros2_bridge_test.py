"""The bridge to ROS 2: topics, service and file, and what ends it."""

import contextlib
import io
import pathlib
import signal
import tempfile
import threading
import unittest
from unittest import mock

from ros2_sensor import Sensor, converted  # first: it lets the client be imported

import ros2_stand_in
import seed
import zmq
from deadline import HUNG_S
from publisher import Publisher

import ros2_bridge
import traction
from traction import ros2
from traction.v1 import messages


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

    def test_publishes_serialised_messages_with_the_qos_of_the_page(self):
        sent = [self.sensor.description(), self.sensor.contacts(1), *(self.sensor.field() for _ in range(10))]
        self.send(*sent)
        ros = ros2_stand_in.Ros()
        with ros.installed():
            ros2_bridge.main(["--stream", self.stream, "--count", "10", "--ros-args", "-r", "__ns:=/arm"])
        (node,) = ros.nodes
        self.assertEqual((node.name, ros.arguments), ("gel_1", ["--ros-args", "-r", "__ns:=/arm"]))
        self.assertEqual(node.services, {})  # the instance of this machine may be another sensor
        self.assertEqual(ros.signals, ros2_stand_in.SignalHandlerOptions.NO)
        self.assertEqual((ros.spun, node.is_destroyed, ros.is_running), ([node], True, False))
        self.assertEqual({topic: (one.kind.__name__, one.qos.history.name, one.qos.depth, one.qos.reliability.name,
                                  one.qos.durability.name) for topic, one in node.publishers.items()}, {
            "~/wrench": ("WrenchStamped", "KEEP_LAST", 5, "BEST_EFFORT", "VOLATILE"),
            "~/forces": ("PointCloud2", "KEEP_LAST", 5, "BEST_EFFORT", "VOLATILE"),
            "~/contacts": ("PointCloud2", "KEEP_LAST", 5, "BEST_EFFORT", "VOLATILE"),
            "~/contact_markers": ("MarkerArray", "KEEP_LAST", 10, "RELIABLE", "VOLATILE"),
            "/tf_static": ("TFMessage", "KEEP_LAST", 1, "RELIABLE", "TRANSIENT_LOCAL"),
            "/diagnostics": ("DiagnosticArray", "KEEP_LAST", 10, "RELIABLE", "VOLATILE")})
        expected = converted(ros2.Converter("gel-1"), *sent)
        self.assertEqual(len(expected[ros2.FORCES]), 10)
        self.assertEqual({topic: one.published for topic, one in node.publishers.items()},
                         {topic.name: data for topic, data in expected.items()})

    def test_zero_is_a_service(self):
        def reply(request):
            answer = messages.Reply(version=1)
            if not request.HasField("zero"):
                answer.error = "of this nothing is known here"
            elif refusal:
                answer.error = refusal
            else:
                answer.zero.markers_present, answer.zero.markers_expected, answer.zero.remark = 1151, 1152, remark
            return answer
        ros = ros2_stand_in.Ros()
        publisher = Publisher(reply)
        self.addCleanup(publisher.close)
        with ros.installed():
            node = ros2_bridge.Node("gel", traction.Control(endpoint=publisher.endpoint(publisher.control)), [])
            self.addCleanup(node.close)
            kind, callback = ros.nodes[0].services["~/zero"]
            self.assertEqual(kind.__name__, "Trigger")
            for refusal, remark, expected in (("", "", (True, "zero taken of 1151 of 1152 markers")),
                                              ("", "the light changed", (True, "the light changed")),
                                              ("something touches", "", (False, "something touches"))):
                response = callback(None, mock.Mock())
                self.assertEqual((response.success, response.message), expected)

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


if __name__ == "__main__":
    unittest.main()
