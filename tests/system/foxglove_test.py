"""traction-view --foxglove: what Foxglove's own client receives, and what the server does with other clients."""

import json
import os
import pathlib
import re
import subprocess
import time

import numpy as np

import browser
import rig
from deadline import HUNG_S
from rig import PATIENCE
from websocket import BINARY, PONG, TEXT, RawWebSocket

CLIENT = pathlib.Path(os.environ.get("TRACTION_FOXGLOVE", rig.BUILD / "tests" / "system" / "foxglove"))
WINDOW = 512 * 1024  # foxglove_session.h
TOPICS = {f"traction/v1/default/{kind}/": f"traction.v1.{kind.capitalize()}"
          for kind in ("field", "markers", "description", "status", "preview", "contacts")} | {
              "foxglove/default/scene": "foxglove.SceneUpdate", "foxglove/default/grid": "foxglove.Grid",
              "foxglove/default/picture": "foxglove.RawImage", "foxglove/default/log": "foxglove.Log"}
FIELD_ID = 40  # of a subscription
FIELD, SCENE, GRID = "traction/v1/default/field/", "foxglove/default/scene", "foxglove/default/grid"


class Client:
    """client.js: Foxglove's own client."""

    def __init__(self, bench, port, *subprotocols):
        self.process = bench.start("node", CLIENT / "client.js", f"ws://localhost:{port}", *subprotocols, stdin=subprocess.PIPE)
        bench.callback(self.process.child.stdin.close)
        self.seen = 0

    def ask(self, **task):
        self.process.child.stdin.write(json.dumps(task).encode() + b"\n")
        self.process.child.stdin.flush()

    def next(self, event, match=lambda told: True):
        """The next event of this name for which `match` holds; skips others, but fails at an error that was not asked for."""
        deadline = time.monotonic() + HUNG_S * PATIENCE
        while True:
            while self.seen < len(self.process.lines):
                told = json.loads(self.process.lines[self.seen])
                self.process.lines[self.seen] = ""  # they are large
                self.seen += 1
                if told["event"] == "error" != event:
                    raise AssertionError(told)
                if told["event"] == event and match(told):
                    return told
            if time.monotonic() > deadline or not self.process.read(0.1):
                raise AssertionError(f"no {event}")

    def message(self, topic):
        return self.next("message", lambda told: told["topic"] == topic)

    def channels(self):
        """The first channels that are advertised, by topic."""
        told = self.next("advertise", lambda told: told["channels"])
        return {channel["topic"]: channel for channel in told["channels"]}


class Foxglove(browser.TestCase):
    def serve(self, daemon, *options):
        view = self.view(daemon, "--foxglove", "0", *options)
        view.foxglove_port = int(re.search(r"ws://127\.0\.0\.1:(\d+)$", view.wait_for("ws://"))[1])
        return view

    def raw(self, view, subprotocol="foxglove.websocket.v1", **options):
        return RawWebSocket(self.rig, self.draw, view.foxglove_port, subprotocol=subprotocol, **options)

    def greeted(self, view, **options):
        """A raw client and the channels that it was told, topic -> id."""
        client = self.raw(view, **options)
        self.assertEqual(client.status, 101, client.head)
        channels = {}
        while not channels:
            told = self.text(client)
            if told["op"] == "advertise":
                channels = {channel["topic"]: channel["id"] for channel in told["channels"]}
        return client, channels

    @staticmethod
    def text(client):
        """The next text message."""
        while True:
            opcode, payload = client.receive()
            if opcode == TEXT:
                return json.loads(payload)

    def test_foxgloves_client_receives_the_fields_of_a_direct_subscriber_and_their_drawings(self):
        self.rig.twin("twist", truth=False)
        daemon = self.rig.daemon()
        direct = self.rig.subscribe(daemon)
        direct.collect(until=lambda field: field.resultant_N.z > 3)
        view = self.serve(daemon)
        client = Client(self.rig, view.foxglove_port)
        self.assertEqual(client.next("open")["subprotocol"], "foxglove.websocket.v1")
        info = client.next("serverInfo")["info"]
        self.assertEqual(info["capabilities"], [])
        self.assertTrue(info["sessionId"])
        channels = client.channels()
        self.assertEqual({topic: channel["schemaName"] for topic, channel in channels.items()}, TOPICS)
        for channel in channels.values():
            self.assertEqual((channel["encoding"], channel["schemaEncoding"]), ("protobuf", "protobuf"))

        # What a new subscriber of description, status and scene is sent at once, however long ago it was published.
        for topic in ("traction/v1/default/description/", "traction/v1/default/status/", "foxglove/default/log", SCENE, GRID, FIELD):
            client.ask(subscribe=topic)
        description = client.message("traction/v1/default/description/")["message"]
        gel = client.message(SCENE)["message"]["entities"]
        self.assertEqual([entity["id"] for entity in gel], ["gel"])
        size = gel[0]["cubes"][0]["size"]
        self.assertEqual([size[axis] for axis in "xyz"], [description["gel"]["size_m"][axis] for axis in "xyz"])

        told = {}  # (topic, log time) -> message: a field and its drawings have the same log time
        while len(told) < 300:
            message = client.next("message", lambda one: one["topic"] in (FIELD, SCENE, GRID))
            told[message["topic"], message["time_ns"]] = message["message"]
        fields = [message for (topic, _), message in told.items() if topic == FIELD]
        sequences = [int(field["header"]["sequence"]) for field in fields]
        self.assertEqual(sequences, sorted(set(sequences)))
        published = {}
        while max(published, default=0) < sequences[-1]:
            for field in direct.collect(1):
                published[field.header.sequence] = field
        compared = 0
        for (topic, time_ns), field in told.items():
            if topic != FIELD:
                continue
            of_direct = published[int(field["header"]["sequence"])]
            self.assertEqual(field["force_N"], list(of_direct.force_N))
            self.assertEqual([field["resultant_N"][axis] for axis in "xyz"], list(rig.vector(of_direct.resultant_N)))
            if (SCENE, time_ns) in told:  # recording_test compares the drawings themselves
                entities = {entity["id"]: entity for entity in told[SCENE, time_ns]["entities"]}
                force = np.reshape(of_direct.force_N, (-1, 3)).astype(float)
                self.assertEqual(len(entities["forces"]["arrows"]), np.count_nonzero(np.linalg.norm(force, axis=1) > 1e-9))
                compared += 1
        self.assertGreater(compared, 10)

        client.ask(unsubscribe=FIELD)
        client.ask(send='{"op": "none"}')  # its answer comes behind the last field
        client.next("status", lambda told: "unknown op 'none'" in told["status"]["message"])
        for _ in range(20):
            self.assertNotEqual(client.next("message")["topic"], FIELD)

    def two_readers(self, **options):
        """Two raw clients that subscribe to FIELD and SCENE, of a sensor that is pressed."""
        self.rig.twin("twist", truth=False)
        daemon = self.rig.daemon()
        self.rig.subscribe(daemon).collect(until=lambda field: field.resultant_N.z > 3)
        view = self.serve(daemon)
        slow, channels = self.greeted(view, **options)
        witness, _ = self.greeted(view)
        for client in (slow, witness):
            client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": FIELD_ID, "channelId": channels[FIELD]},
                                                                         {"id": FIELD_ID + 1, "channelId": channels[SCENE]}]}))
        return slow, witness

    @staticmethod
    def sequence_of(payload):
        """Of a field; None: it is another message."""
        if payload[:5] != b"\1" + FIELD_ID.to_bytes(4, "little"):
            return None
        return rig.messages.Field.FromString(payload[13:]).header.sequence

    def fields(self, client):
        """(sequence, bytes of all messages up to it) of each field, for ever."""
        received = 0
        while True:
            _, payload = client.receive()
            received += len(payload)
            if (sequence := self.sequence_of(payload)) is not None:
                yield sequence, received

    def test_a_client_that_confirms_nothing_is_sent_no_more_than_the_window(self):
        """Its kernel and its browser may hold megabytes: what it has read, it says by its answers to pings."""
        slow, witness = self.two_readers()
        opcode = newest = None
        while opcode != BINARY or slow.answered is None:
            opcode, _ = slow.receive()
        confirmed = int(slow.answered)  # a ping says how many bytes were sent before it

        def on_the_way():
            return int(slow.ping) + slow.since_ping - confirmed

        largest = 0
        while on_the_way() < WINDOW:
            largest = max(largest, len(slow.receive(answer_pings=False)[1]))
        of_witness = self.fields(witness)
        for _ in range(100):
            last, _ = next(of_witness)
        slow.send('{"op": "none"}')  # its answer does not wait for the window
        while opcode != TEXT:
            opcode, payload = slow.receive(answer_pings=False)
        self.assertIn("unknown op", json.loads(payload)["message"])
        print(f"\n  {on_the_way() / 1024:.0f} KiB were on the way", end=" ", flush=True)
        self.assertLess(on_the_way(), WINDOW + 2 * largest)
        slow.send(slow.ping, PONG)
        while newest is None or newest < last:
            newest = self.sequence_of(slow.receive()[1]) or newest
