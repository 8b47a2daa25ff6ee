"""tractionctl echo: what it prints arrives, or is counted as lost, or ends it."""

import fcntl
import json
import os
import pathlib
import select
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import seed
import zmq
from ctl import PROGRAM, USAGE, OUTPUT, Case, ctl
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
        with zmq.Context() as context, context.socket(zmq.XPUB) as stream:
            port = stream.bind_to_random_port("tcp://127.0.0.1")
            description = messages.Description()
            description.header.sensor = "gel"
            description.header.boot = bytes(range(16))
            description.camera.width_px = 333
            child = subprocess.Popen([PROGRAM, "echo", "--connect", f"tcp://127.0.0.1:{port}"], stdout=subprocess.PIPE,
                                     stderr=subprocess.PIPE, text=True, start_new_session=True)
            self.addCleanup(self.end, child)
            self.assertTrue(stream.poll(1000 * HUNG_S), "nobody subscribes")
            stream.send_multipart([b"traction/v1/gel/description/", description.SerializeToString(), b"0.0"])
            self.assertEqual(child.stderr.readline(), "tractionctl: no gel: nothing is measured; set sensor.gel_file\n")
            child.send_signal(signal.SIGINT)
            out, _ = child.communicate(timeout=HUNG_S)
            self.assertEqual((child.returncode, out), (0, ""))  # the description itself was not asked for

    def test_disk_that_fills_up_ends_echo(self):
        with tempfile.TemporaryDirectory(prefix="traction-") as folder:
            script = 'mount -t tmpfs -o size=256k none . && cd "$PWD" && "$@" > file; code=$?; cat file; exit $code'
            child = subprocess.Popen(["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", script, "sh", PROGRAM,
                                      "echo", *self.publisher()], cwd=folder, stdout=subprocess.PIPE,
                                     stderr=subprocess.PIPE, text=True, start_new_session=True)
            self.addCleanup(self.end, child)
            out, err = child.communicate(timeout=HUNG_S)
        self.assertEqual(child.returncode, OUTPUT, err)
        lines = out.split("\n")[:-1]
        self.assertRegex(err, rf"\Atractionctl: .*No space left on device; {len(lines)} messages printed\n\Z")
        self.assertGreater(len(lines), 3)

    def test_closed_pipe_ends_echo_also_where_nothing_is_published(self):
        draw = seed.chance(self.id())
        with zmq.Context() as context, context.socket(zmq.XPUB) as silent:
            silent.bind("tcp://127.0.0.1:*")
            for endpoints in (self.publisher(), ["--connect", Publisher.endpoint(silent)]):
                with self.subTest(endpoints):
                    reader, writer = os.pipe()
                    child = self.start("echo", *endpoints, stdout=writer)
                    os.close(writer)
                    time.sleep(draw.uniform(0, 0.3))
                    os.close(reader)
                    self.ends(child, "(connected, but nothing of this topic comes .*\ntractionctl: )?"  # where it took 3 s to come here
                                     "standard output has no reader any more; [0-9]+ messages printed")

    def stalled(self, number):
        """Publishes past a reader that stalls: for the whole burst where `number` is 0, else at random. Returns the last number
        sent, the lines, what was said, and the exit code.
        """
        draw, stalls = seed.chance(self.id(), number), seed.chance(self.id(), number, "reader")  # one for each thread
        context = self.enterContext(zmq.Context())
        socket = self.enterContext(context.socket(zmq.XPUB))
        socket.linger, socket.sndhwm = 0, draw.choice([20, 200, 1000])
        field = messages.Field(force_N=[0.0] * (3 * 576), node_valid=bytes(576))
        field.header.boot = bytes(range(16))
        # Queues of 1000 messages on both sides and the buffers between them hold less than 8000.
        burst, sent = draw.randrange(2000, 8000) if number else 8000, 0
        socket.bind("tcp://127.0.0.1:*")
        child = self.start("echo", "--connect", Publisher.endpoint(socket), stdout=subprocess.PIPE)
        self.assertTrue(socket.poll(1000 * HUNG_S))
        lines, stop, came = [], threading.Event(), threading.Event()

        def read():
            if number == 0:
                stop.wait()
            for line in child.stdout:
                lines.append(json.loads(line)["sequence"])
                came.set()
                if not stop.is_set() and stalls.random() < 0.01:
                    time.sleep(stalls.choice([0.02, 0.1, 0.4]))

        reader = threading.Thread(target=read)
        reader.start()
        while sent < burst or lines[-1:] != [sent]:
            if sent >= burst:  # now the reader catches up
                stop.set()
                came.clear()
                if lines[-1:] != [sent] and came.wait(1) or lines[-1:] == [sent]:
                    continue
                self.assertIsNone(child.poll())
            sent += 1
            field.header.sequence = sent
            socket.send_multipart([b"traction/v1/gel/field/", field.SerializeToString(), b"0.0"])
        child.send_signal(signal.SIGINT)
        reader.join(HUNG_S)
        return sent, lines, child.stderr.read(), child.wait(HUNG_S)

    def test_what_a_stalling_reader_loses_is_counted(self):
        lost_at_all = 0
        for number in range(4):
            with self.subTest(number=number):
                sent, lines, err, code = self.stalled(number)
                lost = sent - len(lines)
                lost_at_all += lost
                self.assertEqual(code, 0)
                self.assertEqual(lines, sorted(set(lines)))
                if lost == 0:
                    self.assertEqual(err, "")
                    continue
                notes = err.splitlines()
                self.assertEqual(notes[-1], f"tractionctl: {len(lines)} messages printed, {lost} lost")
                for note in notes[:-1]:
                    self.assertRegex(note, r"\Atractionctl: \d+ messages lost before number \d+: ")
        self.assertGreater(lost_at_all, 0)

    def test_echo_that_is_stopped_while_its_reader_stalls_ends_and_says_what_was_not_printed(self):
        reader, writer = os.pipe()
        self.addCleanup(os.close, reader)
        self.addCleanup(os.close, writer)
        self.assertEqual(fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, 4096), 4096)  # a message is longer
        child = self.start("echo", *self.publisher(), stdout=writer)
        while select.select([], [writer], [], 0)[1]:
            self.assertIsNone(child.poll())
            time.sleep(0.001)
        child.send_signal(signal.SIGTERM)
        self.assertEqual(child.wait(HUNG_S), 0)
        self.assertNotIn(b"\n", os.read(reader, 65536))
        self.assertRegex(child.stderr.read(), r"\Atractionctl: 0 messages printed, [1-9]\d* that waited not printed\n\Z")

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
        context = self.enterContext(zmq.Context())

        def open_at(endpoint):
            socket = self.enterContext(context.socket(zmq.XPUB))
            socket.linger = 0
            socket.bind(endpoint)
            return socket

        endpoint = "ipc://" + str(pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")), "stream"))
        first = open_at(endpoint)
        child = self.start("echo", "--connect", endpoint, stdout=subprocess.PIPE)
        self.assertTrue(first.poll(1000 * HUNG_S))
        field = messages.Field(timestamp=1.0)
        field.header.sequence, field.header.boot = 1, bytes(range(16))
        parts = [b"traction/v1/gel/field/", field.SerializeToString(), b"0.0"]
        first.send_multipart(parts)
        child.stdout.readline()
        first.close()
        self.assertEqual(child.stderr.readline(), "tractionctl: tractiond is gone; waiting for it\n")
        second = open_at(endpoint)
        self.assertTrue(second.poll(1000 * HUNG_S))
        self.assertEqual(child.stderr.readline(), "tractionctl: tractiond is back\n")
        field.header.boot = bytes(range(1, 17))
        parts[1] = field.SerializeToString()
        second.send_multipart(parts)
        self.assertEqual(child.stderr.readline(), "tractionctl: tractiond was started anew\n")
        child.send_signal(signal.SIGINT)
        self.assertEqual(child.wait(HUNG_S), 0)


if __name__ == "__main__":
    unittest.main()
