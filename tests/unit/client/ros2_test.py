"""What is published in ROS 2: its bytes by hand and by readers that are not ours, frames and signs."""

import json
import os
import pathlib
import struct
import subprocess
import tempfile
import unittest

import numpy as np
import seed
import suite
from ros2_sensor import Sensor, converted

import ros2_bridge
import traction
from traction import ros2
from traction.decode import decode
from traction.v1 import messages

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
READER = pathlib.Path(os.environ.get("TRACTION_MCAP", BUILD / "tests/system/mcap"))
BAD = traction.Flag.FEW_MARKERS | traction.Flag.GEL_MISMATCH


class Cdr:
    """Reads bytes one after another, as the standard has it (OMG CDR, PLAIN_CDR little-endian)."""

    def __init__(self, data):
        assert data[:4] == b"\0\1\0\0", data[:4]
        self.data, self.at = data[4:], 0

    def number(self, code):
        size = struct.calcsize(code)
        self.at = (self.at + size - 1) // size * size + size
        return struct.unpack_from("<" + code, self.data, self.at - size)[0]

    def numbers(self, codes):
        return [self.number(code) for code in codes]

    def raw(self):
        size = self.number("I")
        self.at += size
        return self.data[self.at - size:self.at]

    def text(self):
        text = self.raw()
        assert text[-1:] == b"\0"
        return text[:-1].decode()

    def header(self):
        """Returns stamp [ns] and frame."""
        seconds, nanoseconds = self.numbers("iI")
        return 10**9 * seconds + nanoseconds, self.text()

    def diagnostics(self):
        """Returns level, message and values of the only status."""
        _, frame = self.header()
        count, level = self.numbers("IB")
        name, message, hardware = self.text(), self.text(), self.text()
        assert (frame, count, name, hardware) == ("", 1, "gel_1: forces", "gel-1")
        values = {self.text(): self.text() for _ in range(self.number("I"))}
        return level, message, values


def cloud_of(data):
    """Returns (rows, columns), x y z fx fy fz dx dy dz of each point, and is_dense."""
    cdr = Cdr(data)
    cdr.header()
    shape = tuple(cdr.numbers("II"))
    fields = [(cdr.text(), *cdr.numbers("IBI")) for _ in range(cdr.number("I"))]
    assert fields == [(name, 4 * i, 7, 1) for i, name in enumerate("x y z fx fy fz dx dy dz".split())], fields
    assert cdr.numbers("?II") == [False, 36, 36 * shape[1]]
    points = np.frombuffer(cdr.raw(), "<f4").reshape(-1, 9)
    is_dense = cdr.number("?")
    assert cdr.at == len(cdr.data)
    return shape, points, is_dense


def rotation(vector):
    """Returns exp([vector]x), by its power series."""
    x, y, z = vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    result, power = np.eye(3), np.eye(3)
    for i in range(1, 40):
        power = power @ cross / i
        result = result + power
    return result


def turned(quaternion, point):
    """Returns the point, turned by a quaternion x, y, z, w."""
    axis, w = np.array(quaternion[:3]), quaternion[3]
    return point + 2 * np.cross(axis, np.cross(axis, point) + w * point)


class Messages(unittest.TestCase):
    def setUp(self):
        self.sensor = Sensor(seed.chance(self.id()))
        self.converter = ros2.Converter(self.sensor.name)

    def test_wrench_is_resultant_and_moment_of_when_the_picture_was_taken(self):
        for captured in (True, False):
            sent = messages.Field.FromString(self.sensor.field(captured=captured)[1])
            header = sent.header
            ago_ns = header.received_ns - header.captured_ns if captured else 0
            (wrench,) = converted(self.converter, ("field", sent.SerializeToString()))[ros2.WRENCH]
            cdr = Cdr(wrench)
            self.assertEqual(cdr.header(), (header.received_real_ns - ago_ns, "gel_1_gel"))
            self.assertEqual(cdr.numbers("dddddd"), [getattr(vector, axis) for vector in (sent.resultant_N, sent.moment_Nm) for axis in "xyz"])
            self.assertEqual(cdr.at, len(cdr.data))

    def test_cloud_has_a_point_for_each_node_and_nan_where_it_is_not_valid(self):
        for body in (False, True):
            for deviations in (False, True):
                description, field = self.sensor.description(body), self.sensor.field(deviations=deviations)
                (data,) = converted(self.converter, description, field)[ros2.FORCES]
                shape, points, is_dense = cloud_of(data)
                self.assertEqual((shape, is_dense), ((5, 7), False))
                told, sent = (getattr(messages, name).FromString(payload) for name, payload in (
                    ("Description", description[1]), ("Field", field[1])))
                force = np.float32(sent.force_N).reshape(-1, 3)
                force[np.frombuffer(sent.node_valid, np.uint8) == 0] = np.nan
                self.assertTrue(np.isnan(force).any())
                np.testing.assert_array_equal(points[:, 3:6], force)
                deviation = np.float32(sent.node_deviation_N).reshape(-1, 3) if deviations else np.zeros((35, 3), np.float32)
                np.testing.assert_array_equal(points[:, 6:], deviation)
                if body:
                    np.testing.assert_array_equal(points[:, :3].ravel(), np.float32(told.body.node_positions_m))
                    continue
                grid = told.nodes
                row, column = np.divmod(np.arange(35), 7)
                np.testing.assert_allclose(points[:, 0], grid.centre_m.x + grid.pitch_m * (column - 3), atol=1e-9)
                np.testing.assert_allclose(points[:, 1], grid.centre_m.y + grid.pitch_m * (row - 2), atol=1e-9)
                self.assertFalse(points[:, 2].any())
        (data,) = converted(self.converter, self.sensor.field(bad_nodes=False))[ros2.FORCES]
        self.assertTrue(cloud_of(data)[2])

    def test_cloud_waits_for_the_description_of_its_nodes(self):
        other = Sensor(self.sensor.draw, calibration=b"o" * 16)
        smaller = Sensor(self.sensor.draw, rows=4)
        no_gel = messages.Description()
        self.sensor.head(no_gel)
        no_gel = ("description", no_gel.SerializeToString())
        for before, clouds in (((), 0), ((other.description(),), 0), ((smaller.description(),), 0),
                               ((self.sensor.description(),), 1), ((self.sensor.description(), no_gel), 0)):
            told = converted(ros2.Converter("gel-1"), *before, self.sensor.field())
            self.assertEqual((len(told[ros2.WRENCH]), len(told[ros2.FORCES])), (1, clouds))
        self.assertEqual(converted(self.converter, no_gel)[ros2.STATIC_TRANSFORMS], [])

    def test_no_force_is_published_of_what_is_not_valid(self):
        description = self.sensor.description()
        for flags, valid in ((0, False), (traction.Flag.FEW_MARKERS, True), (traction.Flag.GEL_MISMATCH, True), (BAD, False)):
            told = converted(ros2.Converter("gel-1"), description, self.sensor.field(flags | traction.Flag.TORN, valid))
            self.assertEqual((told[ros2.WRENCH], told[ros2.FORCES]), ([], []))
            ((level, message, values),) = (Cdr(data).diagnostics() for data in told[ros2.DIAGNOSTICS])
            self.assertEqual((level, values["valid"]), (2, str(valid)))
            self.assertRegex(message, "^no forces: ")

    def test_flags_are_told_as_a_warning_and_forces_are_published(self):
        description = self.sensor.description()
        known = {f"FLAG_{flag.name}" for flag in traction.Flag}
        for flag in (flag for flag in traction.Flag if flag not in BAD):
            told = converted(ros2.Converter("gel-1"), description, self.sensor.field(flag | 1 << 20))
            self.assertEqual((len(told[ros2.WRENCH]), len(told[ros2.FORCES])), (1, 1))
            level, message, values = Cdr(told[ros2.DIAGNOSTICS][0]).diagnostics()
            raised = {f"FLAG_{flag.name}", f"FLAG_{1 << 20}"}  # and one of a later daemon
            self.assertEqual((level, set(message.split(", "))), (1, raised))
            self.assertEqual(values, {name: str(name in raised) for name in known | raised} | {
                "valid": "True", "boot": "62" * 16, "zero": "7a" * 16})
        level, message, _ = Cdr(converted(self.converter, self.sensor.field())[ros2.DIAGNOSTICS][0]).diagnostics()
        self.assertEqual((level, message), (0, "forces are published"))

    def test_diagnostics_come_once_a_second_and_on_a_change(self):
        def due(*words, **what):
            return len(converted(self.converter, self.sensor.field(*words, **what))[ros2.DIAGNOSTICS])
        self.assertEqual([due(step_ns=300_000_000) for _ in range(9)], [1, 0, 0, 0, 1, 0, 0, 0, 1])
        self.assertEqual([due(traction.Flag.TORN), due(traction.Flag.TORN), due(), due()], [1, 0, 1, 0])
        self.assertEqual([due(valid=False), due(valid=False), due(), due()], [1, 0, 1, 0])
        self.sensor.received_ns = 1  # the host was started anew
        self.assertEqual([due(), due()], [1, 0])

    def test_camera_is_where_the_projection_has_it(self):
        """point_camera = exp(rotation) diag(1, -1, -1) (point - position): sensor/projection.h."""
        for number in range(20):
            kind, payload = self.sensor.description()
            sent = messages.Description.FromString(payload)
            if number == 0:
                sent.camera.rotation_rad.Clear()
            (data,) = converted(self.converter, (kind, sent.SerializeToString()))[ros2.STATIC_TRANSFORMS]
            cdr = Cdr(data)
            self.assertEqual(cdr.number("I"), 1)
            self.assertEqual((cdr.header()[1], cdr.text()), ("gel_1_gel", "gel_1_camera_optical"))
            position, quaternion = np.array(cdr.numbers("ddd")), cdr.numbers("dddd")
            self.assertEqual(cdr.at, len(cdr.data))
            vector = [getattr(sent.camera.rotation_rad, axis) for axis in "xyz"]
            np.testing.assert_array_equal(position, [getattr(sent.camera.position_m, axis) for axis in "xyz"])
            self.assertAlmostEqual(np.linalg.norm(quaternion), 1, 12)
            point = np.array(self.sensor.numbers(3, 0.1))
            of_camera = rotation(vector) @ np.diag([1, -1, -1]) @ (point - position)
            np.testing.assert_allclose(turned(quaternion, of_camera) + position, point, atol=1e-12)

    def test_names_are_such_as_ros_allows(self):
        for sensor, node in (("default", "default"), ("left-finger", "left_finger"), ("3rd", "sensor_3rd"), ("", "sensor_"),
                             ("a b/ü", "a_b__"), ("_x9", "_x9")):
            self.assertEqual(ros2.node_name(sensor), node)

    def test_contacts_have_numbers_while_they_are_seen_and_markers_until_they_end(self):
        for _ in range(10):
            kind, payload = self.sensor.contacts(4)
            sent = messages.Contacts.FromString(payload)
            told = converted(self.converter, (kind, payload))
            (data,), (markers,) = told[ros2.CONTACTS], told[ros2.CONTACT_MARKERS]
            self.assertEqual(Cdr(data).header()[1], "gel_1_gel")
            self.assertTrue(data.find(b"stick_ratio\0") > 0)
            seen = sent.contacts[0]
            row = np.frombuffer(data[-53:-1], "<f4")  # 13 numbers, and is_dense
            expected = np.float32([seen.position_m.x, seen.position_m.y, 0, *(
                getattr(vector, axis) for vector in (seen.force_N, seen.moment_Nm) for axis in "xyz"),
                *((seen.slip.stick_ratio.estimate, seen.slip.friction.low, 0) if seen.HasField("slip") else [np.nan] * 3)])
            self.assertEqual(int.from_bytes(data[-53:-49], "little"), 1)
            np.testing.assert_array_equal(row[1:], expected)
            cdr = Cdr(markers)
            self.assertEqual(cdr.number("I"), 12)
            self.assertEqual(cdr.header()[1], "gel_1_gel")
            self.assertEqual((cdr.text(), cdr.numbers("iii")), ("contact", [1, 3, 0]))

    @suite.npm
    def test_foreign_readers_take_the_file_and_write_the_same_bytes(self):
        """Of a recording: @mcap/core, @foxglove/rosmsg and @foxglove/rosmsg2-serialization."""
        draw, sent, samples = self.sensor.draw, [], {topic: [] for topic in ros2.TOPICS}
        for number in range(200):
            if number % 40 == 0:
                self.sensor.rows, self.sensor.columns = draw.randint(1, 24), draw.randint(1, 24)
                sent.append(self.sensor.description(body=draw.random() < 0.5))
            flags = 1 << draw.randrange(10) if draw.random() < 0.5 else 0
            sent.append(self.sensor.field(flags, draw.random() < 0.9, draw.random() < 0.8, draw.random() < 0.8,
                                          captured=draw.random() < 0.9))
            sent.append(self.sensor.contacts(draw.randrange(5)))
        with tempfile.TemporaryDirectory(prefix="traction-") as folder:
            path = pathlib.Path(folder) / "ros2.mcap"
            file = ros2_bridge.File(path, self.converter.node)
            for kind, payload in sent:
                for sample in self.converter.convert(decode(kind, payload)):
                    file.write(sample)
                    samples[sample.topic].append(sample)
            file.close()
            found = read_foreign(path)

        self.assertEqual((found["profile"], found["library"]), ("ros2", f"traction {traction.__version__}"))
        self.assertEqual(found["metadata"], [{"name": "rosbag2", "metadata": {"ROS_DISTRO": "unknown"}}])
        self.assertGreater(found["chunks"], 1)
        channels = {channel["topic"]: channel for channel in found["channels"]}
        qos = {"/gel_1/wrench": (5, 2, 2), "/gel_1/forces": (5, 2, 2), "/tf_static": (1, 1, 1), "/diagnostics": (10, 1, 2),
               "/gel_1/contacts": (5, 2, 2), "/gel_1/contact_markers": (10, 1, 2)}
        self.assertEqual(channels.keys(), qos.keys())
        for topic, channel in channels.items():
            (offered,) = json.loads(channel["metadata"]["offered_qos_profiles"])
            self.assertEqual((offered["depth"], offered["reliability"], offered["durability"]), qos[topic])
            self.assertEqual((channel["encoding"], channel["schema_encoding"]), ("cdr", "ros2msg"))
            self.assertTrue(channel["is_ros"], f"{channel['type']} is not as ROS 2 defines it")

        told = {topic: [one for one in found["messages"] if one["topic"] == topic] for topic in channels}
        for topic in ros2.TOPICS:
            stamps = [str(sample.stamp_ns) for sample in samples[topic]]
            self.assertEqual([one["publish_time"] for one in told[topic.name.replace("~", "/gel_1")]], stamps)
        self.assertEqual({(one["encapsulation"], one["is_same_bytes"]) for one in found["messages"]}, {("CDR_LE", True)})
        print(f"\n  {len(found['messages'])} messages are the same bytes", end=" ")


def read_foreign(path):
    done = subprocess.run(["node", READER / "read_ros2.js", path], capture_output=True, text=True, timeout=300)
    if done.returncode:
        raise AssertionError(done.stderr[-2000:])
    return json.loads(done.stdout)
