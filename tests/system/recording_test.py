"""Recordings of a running daemon, read by who knows nothing of it: MCAP's own reader, and the schemas in the file."""

import base64
import json
import os
import pathlib
import subprocess
import sys
import time

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "client/python"))
import rig  # noqa: E402
import steady  # noqa: E402
import traction  # noqa: E402

READER = pathlib.Path(os.environ.get("TRACTION_MCAP", rig.BUILD / "tests" / "system" / "mcap"))


def read(*words):
    """What the foreign reader tells, a dictionary for each file."""
    done = subprocess.run(["node", READER / "read.js", *words], capture_output=True, text=True, timeout=300)
    if done.returncode:
        raise AssertionError(done.stderr[-2000:])
    return [json.loads(line) for line in done.stdout.splitlines()]


def types_of(channel):
    """The message's class, of nothing but the recording's own schema."""
    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    descriptor = pool.FindMessageTypeByName(channel["type"])
    if hasattr(message_factory, "GetMessageClass"):
        return message_factory.GetMessageClass(descriptor)
    return message_factory.MessageFactory(pool).GetPrototype(descriptor)


class Recording(steady.TestCase):
    def test_a_foreign_reader_finds_what_was_published(self):
        self.bench.twin("press", truth=False)
        daemon = self.bench.daemon()
        path = self.bench.folder / "press.mcap"
        witness = self.bench.subscribe(daemon)
        witness.collect(1)
        recorder = self.bench.start(rig.BIN / "tractionctl", "record", path, "--connect", daemon.endpoint["stream"])
        published = {}
        until = time.monotonic() + 3
        while time.monotonic() < until:
            topic, data, *_ = witness.socket.recv_multipart()
            kind = topic.decode().split("/")[3]
            published[topic.decode(), rig.Subscriber.TYPES[kind].FromString(data).header.sequence] = data
        self.assertEqual(recorder.stop(), 0, recorder.output())
        print("\n  " + recorder.output(), end=" ", flush=True)
        self.assertRegex(recorder.output(), r" 0 lost$")

        (found,) = read(path)
        channels = {channel["topic"]: channel for channel in found["channels"]}
        self.assertEqual({name.split("/")[3] for name in channels}, {"field", "markers", "description", "status"})
        times = [int(one["log_time"]) for one in found["messages"]]
        self.assertEqual(times, sorted(times))
        compared = 0
        for one in found["messages"]:
            channel, data = channels[one["topic"]], base64.b64decode(one["data"])
            self.assertEqual((channel["encoding"], channel["schema_encoding"]), ("protobuf", "protobuf"))
            self.assertEqual(channel["metadata"], {"sensor": one["topic"].split("/")[2]})
            if (one["topic"], one["sequence"]) in published and "description" not in one["topic"]:
                self.assertEqual(data, published[one["topic"], one["sequence"]])
                compared += 1
            age = int(one["log_time"]) - int(one["publish_time"])
            self.assertGreaterEqual(age, 0)
        self.assertGreater(compared, 100)
        fields = [one for one in found["messages"] if "/field/" in one["topic"]]
        self.assertEqual([one["sequence"] for one in fields],
                         list(range(fields[0]["sequence"], fields[0]["sequence"] + len(fields))))

        parsers = {topic: types_of(channel) for topic, channel in channels.items()}
        last = parsers[fields[-1]["topic"]].FromString(base64.b64decode(fields[-1]["data"]))
        ours = rig.messages.Field.FromString(base64.b64decode(fields[-1]["data"]))
        self.assertEqual(list(last.force_N), list(ours.force_N))
        self.assertEqual(len(last.force_N), 3 * 576)

        code, out = self.bench.ctl("info", path, "--json")
        self.assertEqual(code, 0, out)
        for topic in json.loads(out)["topics"]:
            self.assertEqual((topic["messages"], topic["lost"]), (channels[topic["topic"]]["messages"], 0))

        recorded = [each for each in traction.recording(path) if isinstance(each.message, traction.Field)]
        self.assertEqual(len(recorded), len(fields))
        for each, one in zip(recorded, fields):
            field = rig.messages.Field.FromString(base64.b64decode(one["data"]))
            np.testing.assert_array_equal(each.message.force_N.ravel(), np.float32(field.force_N))
            np.testing.assert_array_equal(each.message.resultant_N, rig.vector(field.resultant_N))
            self.assertEqual(each.message.header.flags, field.header.flags)
            self.assertEqual((str(each.log_time_ns), str(each.publish_time_ns)), (one["log_time"], one["publish_time"]))

    def test_what_foxglove_draws(self):
        """By Foxglove's own definitions: arrows that turn x into the force, where the node is, as long as it is strong."""
        self.bench.twin("twist", truth=False)
        daemon = self.bench.daemon()
        self.bench.subscribe(daemon).collect(until=lambda field: field.resultant_N.z > 3)
        path, drawn = self.bench.folder / "twist.mcap", self.bench.folder / "drawn.mcap"
        code, out = self.bench.ctl("record", path, "--seconds", "2", "--pictures", "--connect", daemon.endpoint["stream"])
        self.assertEqual(code, 0, out)
        code, out = self.bench.ctl("export", path, drawn)
        self.assertEqual((code, out), (0, ""))
        code, out = self.bench.ctl("export", path, path)
        self.assertEqual(code, os.EX_USAGE, out)
        before, after = read(path, drawn)
        theirs = self.bench.folder / "theirs"
        subprocess.run(["protoc", "-I", READER / "node_modules/@foxglove/schemas/schemas/proto", "--include_imports",
                        f"--descriptor_set_out={theirs}", *(f"foxglove/{name}.proto" for name in ("SceneUpdate", "Grid", "RawImage", "Log"))],
                       check=True)
        definitions = {file.name: file for file in descriptor_pb2.FileDescriptorSet.FromString(theirs.read_bytes()).file}
        channels = {channel["topic"]: channel for channel in after["channels"]}
        for topic, channel in channels.items():
            if topic.startswith("foxglove/"):
                ours = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
                ours = {file.name: file for file in ours.file}
                for name, file in definitions.items():
                    self.assertEqual(ours[name], file)
        kept = [one for one in after["messages"] if not one["topic"].startswith("foxglove/")]
        self.assertEqual(kept, before["messages"])

        types = {topic: types_of(channel) for topic, channel in channels.items()}
        nodes, drawings, fields, pictures, compared = None, {}, 0, 0, 0
        for one in after["messages"]:
            message = types[one["topic"]].FromString(base64.b64decode(one["data"]))
            if "/description/" in one["topic"]:
                grid = message.nodes
                row, column = np.divmod(np.arange(grid.rows * grid.columns), grid.columns)
                nodes = np.stack([grid.centre_m.x + grid.pitch_m * (column - (grid.columns - 1) / 2),
                                  grid.centre_m.y + grid.pitch_m * (row - (grid.rows - 1) / 2), 0 * row], 1)
            elif one["topic"].startswith("foxglove/") and nodes is not None:
                drawings[one["topic"].split("/")[-1], one["publish_time"]] = message
        for one in after["messages"]:
            if "/preview/" in one["topic"]:
                preview = types[one["topic"]].FromString(base64.b64decode(one["data"]))
                image = drawings["picture", one["publish_time"]]
                self.assertEqual((image.width, image.height, image.encoding, image.data),
                                 (preview.width, preview.height, "rgb8", preview.pixels))
                pictures += 1
            if "/field/" not in one["topic"] or ("grid", one["publish_time"]) not in drawings:
                continue
            fields += 1
            field = rig.messages.Field.FromString(base64.b64decode(one["data"]))
            force = np.reshape(field.force_N, (-1, 3))
            deviation = np.linalg.norm(np.reshape(field.node_deviation_N, (-1, 3)), axis=1)
            grid = drawings["grid", one["publish_time"]]
            cells = np.frombuffer(grid.data, np.float32).reshape(-1, 3)
            np.testing.assert_array_equal(cells[:, 0], np.float32(force[:, 2]))
            np.testing.assert_allclose([grid.pose.position.x + grid.cell_size.x / 2, grid.pose.position.y + grid.cell_size.y / 2],
                                       nodes[0, :2], atol=1e-9)
            entities = {entity.id: entity for entity in drawings["scene", one["publish_time"]].entities}
            size = np.linalg.norm(force, axis=1)
            shown = np.flatnonzero(size > 1e-9)
            self.assertEqual(len(entities["forces"].arrows), len(shown))
            for node, arrow in zip(shown, entities["forces"].arrows):
                length = arrow.shaft_length + arrow.head_length
                at, turn = arrow.pose.position, arrow.pose.orientation
                axis, w = np.array([turn.x, turn.y, turn.z]), turn.w
                x = np.array([1.0, 0, 0])
                along = x + 2 * w * np.cross(axis, x) + 2 * np.cross(axis, np.cross(axis, x))
                np.testing.assert_allclose(along, force[node] / size[node], atol=1e-9)
                np.testing.assert_allclose([at.x, at.y, at.z] + length * along, nodes[node], atol=1e-9)
                self.assertAlmostEqual(length, 0.02 * size[node])
                self.assertAlmostEqual(arrow.color.a, np.clip(size[node] / (2 * deviation[node]), 0.2, 1), 6)
                compared += 1
            self.assertEqual(len(entities["contacts"].arrows), len(field.contacts))
        print(f"{compared} arrows of {fields} fields compared", end=" ", flush=True)
        self.assertGreater(compared, 4 * fields)
        self.assertGreater(pictures, 0)

    def test_replay_publishes_what_was_recorded(self):
        self.bench.twin("press")
        daemon = self.bench.daemon()
        self.bench.subscribe(daemon).collect(1)
        path = self.bench.folder / "press.mcap"
        code, out = self.bench.ctl("record", path, "--seconds", "2", "--connect", daemon.endpoint["stream"])
        self.assertEqual(code, 0, out)
        (found,) = read(path)
        endpoint = f"ipc://{self.bench.folder / 'again'}"
        replayer = self.bench.start(rig.BIN / "tractionctl", "replay", path, "--bind", endpoint, "--speed", "2")
        replayer.wait_for("waiting for a subscriber")
        reader = rig.Subscriber(self.bench, endpoint)
        kept = [base64.b64decode(one["data"]) for one in found["messages"] if "/field/" in one["topic"]]
        again = reader.collect(len(kept))
        self.assertEqual([one.SerializeToString(deterministic=True) for one in again],
                         [rig.messages.Field.FromString(one).SerializeToString(deterministic=True) for one in kept])
        self.assertEqual(replayer.join(), 0, replayer.output())
