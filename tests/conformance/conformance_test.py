"""Every client against the same cases: good messages of all kinds, drawn at random of the contract, and each way of
being damaged. TRACTION_SEED=N repeats a run; docs/clients.md says how another client is added."""

import json
import os
import pathlib
import select
import subprocess
import sys
import unittest

import zmq

import cases
import seed
import suite
from contract import FILES
from deadline import HUNG_S
from form import difference

HERE = pathlib.Path(__file__).resolve().parent
BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
READERS = {"cpp": [BUILD / "bin" / "conformance_reader"], "python": [sys.executable, HERE / "reader.py"],
           "javascript": ["node", HERE / "reader.mjs", BUILD]}


class Reader:
    """A client as a process, which tells a line of JSON for whatever it has read."""

    def __init__(self, test, client, mode, endpoint):
        environment = {**os.environ, "PYTHONPATH": str(HERE.parents[1] / "client" / "python")}
        self.child = subprocess.Popen([str(word) for word in (*READERS[client], mode, endpoint)], env=environment,
                                      stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        test.addCleanup(self.end)
        self.text = b""

    def line(self):
        while b"\n" not in self.text:
            if not select.select([self.child.stdout], [], [], HUNG_S)[0]:
                raise AssertionError("the reader says nothing")
            chunk = os.read(self.child.stdout.fileno(), 1 << 20)
            if not chunk:
                raise AssertionError(f"the reader has ended: {self.child.wait()}")
            self.text += chunk
        line, self.text = self.text.split(b"\n", 1)
        told = json.loads(line)
        for name in ("arrived_ns", "same_host"):  # of here and now
            told.get("message", {}).pop(name, None)
        return told

    def ask(self, what):
        self.child.stdin.write(what.encode() + b"\n")
        self.child.stdin.flush()

    def end(self):
        self.child.kill()
        self.child.communicate()


class Checks:
    def setUp(self):
        self.chance = seed.chance(self.id())
        context = zmq.Context()
        self.addCleanup(context.destroy, 0)
        self.context = context

    def bind(self, kind):
        socket = self.context.socket(kind)
        self.addCleanup(socket.close, 0)
        socket.linger, socket.sndhwm = 0, 0
        socket.bind("tcp://127.0.0.1:*")
        return socket, socket.getsockopt_string(zmq.LAST_ENDPOINT)

    def says(self, reader, expected, name):
        told = reader.line()
        wanted = {"message": expected} if isinstance(expected, dict) else {"error": expected}
        lost = told.pop("lost", 0)
        found = difference(wanted, told)
        self.assertIsNone(found, f"{name}: {found}")
        return lost

    def published(self, client, mode, shuffled):
        socket, endpoint = self.bind(zmq.XPUB)
        reader = Reader(self, client, mode, endpoint)
        self.assertTrue(socket.poll(1000 * HUNG_S))
        socket.recv()
        lost = 0
        for name, steps in shuffled:
            if mode == "stream":
                for parts, _, _ in steps:
                    socket.send_multipart(parts)
            for parts, expected, gap in steps:
                if mode == "latest":
                    socket.send_multipart(parts)
                lost += gap
                if expected is not None:
                    self.assertEqual(self.says(reader, expected, name), lost, name)

    def check_stream(self, client):
        drawn = [*cases.stream(self.chance).items()]
        self.chance.shuffle(drawn)
        end = cases.Sender(self.chance, "end")  # what was passed over must not be told later
        self.published(client, "stream", [*drawn, ("end", [(*end.good(), 0)])])
        print(f"{len(drawn)} cases", end=" ", flush=True)

    def check_silence(self, client):
        socket, endpoint = self.bind(zmq.XPUB)
        reader = Reader(self, client, "stream", endpoint)
        self.assertTrue(socket.poll(1000 * HUNG_S))
        socket.recv()
        parts, *said = cases.silent(cases.Sender(self.chance, "silent"))
        socket.send_multipart(parts)
        for each in said:
            self.says(reader, each, "silence")

    def check_latest(self, client):
        drawn = [*cases.latest(self.chance).items()]
        self.chance.shuffle(drawn)
        self.published(client, "latest", drawn)

    def check_control(self, client):
        requests = self.requests()
        socket, endpoint = self.bind(zmq.REP)
        reader = Reader(self, client, "control", endpoint)
        for name, (what, reply, expected) in cases.control(self.chance).items():
            reader.ask(what)
            for _ in range(2):
                self.assertTrue(socket.poll(1000 * HUNG_S), name)
                request = requests.FromString(socket.recv())
                self.assertEqual(request.version, 1, name)
                asked = request.WhichOneof("request")
                if what not in ("zero", "undo") or asked == "zero":
                    break
                self.assertEqual(asked, "status", name)  # how long the zero takes
                socket.send(cases.encode("Reply", {"version": 1, "status": {"zero_within_s": 1.0}}))
            socket.send(reply)
            self.assertEqual(asked, {"describe": "description", "undo": "zero"}.get(what, what), name)
            self.assertEqual(request.zero.undo, what == "undo", name)
            self.assertFalse(request.zero.anyway, name)
            self.says(reader, expected, name)

    @staticmethod
    def requests():
        """Requests are read by Protobuf's own, whoever wrote them."""
        from google.protobuf import descriptor_pool, message_factory
        pool = descriptor_pool.DescriptorPool()
        for file in FILES:
            pool.AddSerializedFile(file.SerializeToString())
        return message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName("traction.v1.Request"))


class Conformance(Checks, unittest.TestCase):
    pass


@suite.npm
class JavaScript(Checks, unittest.TestCase):
    """Reads through traction-view, which npm's packages are needed to build."""

    def setUp(self):
        self.assertTrue((BUILD / "bin" / "traction-view").exists(), "traction-view is not built: tools/dependencies viewer")
        super().setUp()


def add(case, client, part):
    def test(self):
        getattr(self, f"check_{part}")(client)
    setattr(case, f"test_{client}_{part}", test)


for _client in READERS:
    for _part in ("stream", "silence", "latest", "control"):
        add(JavaScript if _client == "javascript" else Conformance, _client, _part)
