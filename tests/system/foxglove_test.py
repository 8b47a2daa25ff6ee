"""traction-view --foxglove: what Foxglove's own client receives, and what the server does with other clients."""

import contextlib
import json
import os
import pathlib
import re
import socket
import subprocess
import time
import unittest

import numpy as np
import zmq

import browser
import rig
import seed
from deadline import HUNG_S
from rig import PATIENCE
from websocket import BINARY, PONG, TEXT, RawWebSocket

CLIENT = pathlib.Path(os.environ.get("TRACTION_FOXGLOVE", rig.BUILD / "tests" / "system" / "foxglove"))
WINDOW = 512 * 1024  # foxglove_session.h
SENDING = 2 * 128 * 1024 + 64 * 1024  # of the server's kernel, which doubles what it is asked for; and our receive buffer
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
    def setUp(self):
        super().setUp()
        self.draw = seed.chance(self.id())

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

    def is_well(self, view):
        client, channels = self.greeted(view)
        client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": channels[FIELD]}]}))
        while client.receive()[0] != BINARY:
            pass
        client.socket.close()

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

    def test_previews_and_their_pictures(self):
        self.rig.twin("idle", truth=False)
        view = self.serve(self.rig.daemon("[publish]\npreview_hz = 20\n"))
        client = Client(self.rig, view.foxglove_port, "foxglove.websocket.v1", "foxglove.sdk.v1")
        self.assertEqual(client.next("open")["subprotocol"], "foxglove.sdk.v1")
        client.channels()
        client.ask(subscribe="traction/v1/default/preview/")
        client.ask(subscribe="foxglove/default/picture")
        images = {}
        while True:
            told = client.next("message")
            images.setdefault(told["time_ns"], {})[told["topic"]] = told["message"]
            if len(images[told["time_ns"]]) == 2:
                break
        preview, picture = (images[told["time_ns"]][topic] for topic in ("traction/v1/default/preview/", "foxglove/default/picture"))
        self.assertEqual((picture["width"], picture["height"], picture["data"], picture["encoding"]),
                         (preview["width"], preview["height"], preview["pixels"], "rgb8"))

    def test_the_daemon_is_asked_for_previews_only_while_a_client_subscribes_to_them(self):
        topic = "traction/v1/default/preview/"
        publisher = zmq.Context.instance().socket(zmq.XPUB)
        self.rig.callback(publisher.close, 0)
        endpoint = f"ipc://{self.rig.folder / 'stream'}"
        publisher.setsockopt(zmq.XPUB_VERBOSER, 1)  # tells of subscriptions that others have, too
        publisher.bind(endpoint)
        view = self.view(None, "--connect", endpoint, "--foxglove", "0")
        view.foxglove_port = int(view.wait_for("ws://").rsplit(":", 1)[1])
        status = rig.messages.Status()
        status.header.sensor = "default"

        def until_asked(wanted):
            """All subscriptions that arrive up to `wanted`."""
            asked = []
            while wanted not in asked:
                self.assertTrue(publisher.poll(1000 * HUNG_S * PATIENCE), asked)
                asked.append(publisher.recv())
                publisher.send_multipart([b"traction/v1/default/status/", status.SerializeToString(), b"0"])
            return asked

        client = self.raw(view)
        until_asked(b"\1")  # its source's: to everything
        channels = {}
        while topic not in channels:
            told = self.text(client)
            channels = {channel["topic"]: channel["id"] for channel in told.get("channels", [])}
        self.assertFalse(publisher.poll(0))
        client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 3, "channelId": channels[topic]}]}))
        until_asked(b"\1" + topic.encode())
        for _ in range(100):  # again and again: the daemon is asked no more, so no thread is made for it
            client.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [3]}))
            client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 3, "channelId": channels[topic]}]}))
        client.send(json.dumps({"op": "none"}))  # its answer comes when these have been handled
        while "unknown op" not in self.text(client).get("message", ""):
            pass
        self.assertFalse(publisher.poll(1000))
        client.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [3]}))
        until_asked(b"\0" + topic.encode())

    def test_a_sensor_that_starts_later_is_advertised_when_it_publishes(self):
        later = self.rig.folder / "default" / "run" / "stream"
        view = self.view(None, "--connect", f"ipc://{later}", "--foxglove", "0")
        view.foxglove_port = int(view.wait_for("ws://").rsplit(":", 1)[1])
        client = Client(self.rig, view.foxglove_port)
        self.assertEqual(client.next("advertise")["channels"], [])
        self.rig.twin("idle", truth=False)
        self.rig.daemon()
        self.assertEqual(set(client.channels()), set(TOPICS))
        client.ask(subscribe=FIELD)
        client.message(FIELD)

    def test_malformed_messages_get_a_status_or_a_close_and_harm_no_other_client(self):
        self.rig.twin("idle", truth=False)
        view = self.serve(self.rig.daemon())
        witness, channels = self.greeted(view)
        witness.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 0, "channelId": channels[FIELD]}]}))
        client, _ = self.greeted(view)
        field = channels[FIELD]
        for message, words in (("{", "not JSON"), ("[]", "'op'"), ("{}", "'op'"), ('{"op":"dance"}', "unknown op"),
                               ('{"op":"advertise","channels":[]}', "does not offer"), ('{"op":"getParameters"}', "does not offer"),
                               ('{"op":"subscribe","subscriptions":[{"id":1,"channelId":4000}]}', "no such channel"),
                               ('{"op":"unsubscribe","subscriptionIds":[5]}', "no subscription 5"),
                               ('{"op":"subscribe","subscriptions":[{"id":1e3,"channelId":0}]}', "integers"),
                               (f'{{"op":"subscribe","subscriptions":[{{"id":1,"channelId":{field}}},{{"id":2,"channelId":{field}}}]}}', "already"),
                               (f'{{"op":"subscribe","subscriptions":[{{"id":1,"channelId":{field + 1}}}]}}', "already used")):
            client.send(message)
            told = self.text(client)
            self.assertEqual((told["op"], told["level"]), ("status", 2), message)
            self.assertIn(words, told["message"], message)
        client.send(b"\1\0\0\0\0abc", BINARY)
        self.assertIn("binary op 1", self.text(client)["message"])
        client.send(json.dumps({"op": "unsubscribe", "subscriptionIds": list(range(2, 3000))}))
        self.assertIn("no subscription 2", self.text(client)["message"])  # many errors: the first of them are told
        for hurt in (b"\xff" * 100, b"\x81\x05hello", bytes([0x83, 0x80, 0, 0, 0, 0]), bytes([0x82, 0xff]) + b"\x7f" + b"\xff" * 7 + bytes(4),
                     bytes([0x81, 0xff]) + (40000).to_bytes(8, "big") + bytes(4 + 40000), bytes([0x81, 0x82]) + bytes(4) + b"\xc3\x28"):
            broken, _ = self.greeted(view)
            with contextlib.suppress(ConnectionError):
                broken.socket.sendall(hurt)
            with self.assertRaises((EOFError, ConnectionError)):
                while True:
                    broken.receive()
        while witness.receive()[0] != BINARY:
            pass
        self.is_well(view)

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

    def test_clients_that_read_nothing_are_closed_and_cost_little_and_too_many_are_refused(self):
        self.rig.twin("idle", truth=False)
        view = self.serve(self.rig.daemon())
        self.is_well(view)
        before = view.memory_MiB()
        deaf = []
        for _ in range(16):
            client, channels = self.greeted(view)
            client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": id, "channelId": id} for id in channels.values()]}))
            deaf.append(client)
        self.assertEqual(self.raw(view).status, 503)
        deadline = time.monotonic() + HUNG_S * PATIENCE
        while self.connected(view) > 0 and time.monotonic() < deadline:
            time.sleep(0.5)
        grown = view.memory_MiB() - before
        print(f"\n  {len(deaf)} that do not read: {grown:.1f} MiB", end=" ", flush=True)
        self.assertEqual(self.connected(view), 0)
        self.assertLess(grown, 64)
        self.is_well(view)

    @staticmethod
    def connected(view):
        text = subprocess.run(["ss", "-Htn", "state", "established", f"( sport = :{view.foxglove_port} )"], capture_output=True, text=True,
                              check=True).stdout
        return len(text.splitlines())


if __name__ == "__main__":
    unittest.main()
