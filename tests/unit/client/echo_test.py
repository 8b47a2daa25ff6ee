"""tractionctl echo: what it prints arrives, or is counted as lost, or ends it."""

import json
import os
import pathlib
import signal
import subprocess
import tempfile
import threading
import time

import seed
import zmq
from ctl import USAGE, Case, ctl
from deadline import HUNG_S
from publisher import Publisher
from traction.v1 import messages


class Echo(Case):
    def test_echo_prints_json_lines(self):
        code, out, err = ctl("echo", "--count", "3", *self.publisher())
        self.assertEqual((code, err), (0, ""))
        fields = [json.loads(line) for line in out.splitlines()]
        self.assertEqual(len(fields), 3)
        first = fields[0]
        self.assertEqual(first["topic"], "field")
        self.assertEqual(first["resultant_N"], [1.5, -2.5, 3.5])
        self.assertEqual(first["boot"], bytes(range(16)).hex())
        self.assertEqual(len(first["force_N"]), 576)
        self.assertTrue(first["valid"])
        self.assertEqual([field["sequence"] - first["sequence"] for field in fields], [0, 1, 2])

    def test_where_there_is_no_gel_echo_says_why_no_field_comes(self):
        stream, endpoint = self.socket()
        description = messages.Description()
        description.header.sensor = "gel"
        description.header.boot = bytes(range(16))
        description.camera.width_px = 333
        child = self.start("echo", "--connect", endpoint, stdout=subprocess.PIPE)
        self.assertTrue(stream.poll(1000 * HUNG_S), "nobody subscribes")
        stream.send_multipart([b"traction/v1/gel/description/", description.SerializeToString(), b"0.0"])
        self.assertEqual(child.stderr.readline(), "tractionctl: no gel: nothing is measured; set sensor.gel_file\n")
        child.send_signal(signal.SIGINT)
        out, _ = child.communicate(timeout=HUNG_S)
        self.assertEqual((child.returncode, out), (0, ""))  # the description itself was not asked for

    def test_closed_pipe_ends_echo_also_where_nothing_is_published(self):
        draw = seed.chance(self.id())
        for endpoints in (self.publisher(), ["--connect", self.socket()[1]]):
            with self.subTest(endpoints):
                reader, writer = os.pipe()
                child = self.start("echo", *endpoints, stdout=writer)
                os.close(writer)
                time.sleep(draw.uniform(0, 0.3))
                os.close(reader)
                self.ends(child, "(connected, but nothing of this topic comes .*\ntractionctl: )?"  # where it took 3 s to come here
                                 "standard output has no reader any more; [0-9]+ messages printed")

    def test_what_is_lost_is_counted_where_it_is_missing(self):
        stream, endpoint = self.socket()
        child = self.start("echo", "--connect", endpoint, stdout=subprocess.PIPE)
        self.assertTrue(stream.poll(1000 * HUNG_S), "nobody subscribes")
        field = messages.Field(timestamp=1.0)
        field.header.boot = bytes(range(16))
        for number in (4, 5, 8, 20):
            field.header.sequence = number
            stream.send_multipart([b"traction/v1/gel/field/", field.SerializeToString(), b"0.0"])
        printed = [json.loads(child.stdout.readline())["sequence"] for _ in range(4)]
        child.send_signal(signal.SIGINT)
        _, err = child.communicate(timeout=HUNG_S)
        self.assertEqual((child.returncode, printed), (0, [4, 5, 8, 20]))
        *notes, account = err.splitlines()
        self.assertEqual(account, "tractionctl: 4 messages printed, 13 lost")
        for note in notes:
            self.assertRegex(note, r"\Atractionctl: \d+ messages lost before number \d+: ")

    def test_latest_is_told_from_the_stream(self):
        with zmq.Context() as context, context.socket(zmq.PUB) as latest:
            latest.conflate = 1
            latest.linger = 0
            latest.bind("tcp://127.0.0.1:*")
            stop = threading.Event()

            def publish():
                field = messages.Field(timestamp=1.0, valid=True)
                while not stop.wait(0.01):
                    field.header.sequence += 1
                    latest.send(field.SerializeToString())

            publishing = threading.Thread(target=publish)
            publishing.start()
            self.addCleanup(publishing.join)
            self.addCleanup(stop.set)
            endpoint = Publisher.endpoint(latest)
            for command in ("echo", "watch"):
                self.fails(USAGE, "has no topics; is it the endpoint 'latest' instead of 'stream'", command, "--connect",
                           endpoint)
            code, out, err = ctl("echo", "--latest", "--count", "3", "--connect", endpoint)
            self.assertEqual((code, err), (0, ""))
            self.assertEqual(len([json.loads(line) for line in out.splitlines()]), 3)
            stop.set()
            publishing.join()
        self.fails(USAGE, "--latest provides only fields", "echo", "--latest", "--topic", "status")

    def test_topic_on_which_nothing_comes_is_told(self):
        child = self.start("echo", "--topic", "markers", *self.publisher(), stdout=subprocess.PIPE)
        self.assertRegex(child.stderr.readline(), r"\Atractionctl: connected, but nothing of this topic comes from tcp:")
        child.send_signal(signal.SIGINT)
        self.assertEqual(child.wait(HUNG_S), 0)

    def test_daemon_that_goes_and_comes_back_is_told(self):
        endpoint = "ipc://" + str(pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")), "stream"))
        first, _ = self.socket(endpoint=endpoint)
        child = self.start("echo", "--connect", endpoint, stdout=subprocess.PIPE)
        self.assertTrue(first.poll(1000 * HUNG_S))
        field = messages.Field(timestamp=1.0)
        field.header.sequence, field.header.boot = 1, bytes(range(16))
        parts = [b"traction/v1/gel/field/", field.SerializeToString(), b"0.0"]
        first.send_multipart(parts)
        child.stdout.readline()
        first.close()
        self.assertEqual(child.stderr.readline(), "tractionctl: tractiond is gone; waiting for it\n")
        second, _ = self.socket(endpoint=endpoint)
        self.assertTrue(second.poll(1000 * HUNG_S))
        self.assertEqual(child.stderr.readline(), "tractionctl: tractiond is back\n")
        field.header.boot = bytes(range(1, 17))
        parts[1] = field.SerializeToString()
        second.send_multipart(parts)
        self.assertEqual(child.stderr.readline(), "tractionctl: tractiond was started anew\n")
        child.send_signal(signal.SIGINT)
        self.assertEqual(child.wait(HUNG_S), 0)
