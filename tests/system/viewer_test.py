"""traction-view: what it tells whom, and what it withstands."""

import contextlib
import json
import pathlib
import re
import socket
import struct
import subprocess
import time
import urllib.parse
import urllib.request

import hostile
import zmq
from browser import TestCase, start_view
from rig import BIN, PATIENCE, SOURCE
from websocket import RawWebSocket


class Viewer(TestCase):
    def exchange(self, view, request):
        with socket.create_connection(("127.0.0.1", view.port), timeout=20 * PATIENCE) as connection:
            answer = b""
            with contextlib.suppress(OSError):
                connection.sendall(request)
                connection.shutdown(socket.SHUT_WR)
                while chunk := connection.recv(65536):
                    answer += chunk
        return answer

    def upgrade(self, view, path="/stream/0?mode=stream&topics=field,status", host=None, origin=None):
        """A WebSocket, or the status of its refusal."""
        connection = RawWebSocket(self.rig, self.draw, view.port, path, host, origin)
        return connection if connection.status == 101 else connection.status

    @staticmethod
    def receive(connection):
        """The next message: (topic, bytes)."""
        return connection.receive()[1].split(b"\0", 1)

    def is_well(self, view):
        connection = self.upgrade(view, path="/stream/0?mode=stream&topics=field")
        self.receive(connection)
        connection.socket.close()

    def test_other_origins_and_names_are_refused(self):
        self.rig.twin("idle")
        view = self.view(self.rig.daemon())
        own = f"127.0.0.1:{view.port}"
        self.is_well(view)
        self.assertIsInstance(self.upgrade(view, origin=f"http://{own}"), RawWebSocket)
        self.assertIsInstance(self.upgrade(view, host=f"localhost:{view.port}", origin=f"http://localhost:{view.port}"), RawWebSocket)
        for origin in ("http://example.org", "https://example.org", f"http://localhost:{view.port}", "null", "file://", f"http://{own}.example.org"):
            self.assertEqual(self.upgrade(view, origin=origin), 403, origin)
        view.wait_for(f"refused a request of a page of 'null' to the host '{own}' .headers Origin and Host")
        for host in ("example.org", f"rebound.example.org:{view.port}", "localhost.example.org", "127.0.0.1.example.org", "[::1", "a" * 300):
            self.assertEqual(self.upgrade(view, host=host), 421, host)
            self.assertIn(b" 421 ", self.exchange(view, f"GET / HTTP/1.1\r\nHost: {host}\r\n\r\n".encode()).split(b"\r\n")[0])
        self.assertEqual(self.upgrade(view, path="/stream/1"), 404)

    def test_it_listens_beyond_this_machine_only_if_that_is_meant(self):
        for address in ("0.0.0.0:0", "[::]:0", "192.0.2.1"):
            process = self.rig.start(BIN / "traction-view", "--listen", address)
            self.assertEqual(process.join(), 64)
            self.assertIn("--insecure", process.output())
        view = self.view(None, "--listen", "0.0.0.0:0", "--insecure")
        self.assertEqual(self.upgrade(view, host=f"example.org:{view.port}"), 421)
        self.assertIsInstance(self.upgrade(self.view(None, "--listen", "localhost:0")), RawWebSocket)
        named = self.view(None, "--name", "box.example.org")
        self.assertIsInstance(self.upgrade(named, host="box.example.org"), RawWebSocket)

    def check_jpeg(self, pixel_format, components):
        self.rig.twin("idle", "--format", pixel_format)
        view = self.view(self.rig.daemon('[sensor]\ngel_file = "none"\n'))
        connection = self.upgrade(view, path="/stream/0?mode=stream&topics=picture,preview")
        got = {}
        while not got.keys() >= {b"picture", b"preview"}:
            topic, content = self.receive(connection)
            got[topic.rstrip(b"/").rsplit(b"/", 1)[-1]] = content
        place, jpeg = got[b"picture"].split(b"\0", 1)
        place = json.loads(place)
        self.assertEqual((place["width"], place["height"], place["scale"], place["origin_px"]), (320, 240, 2, [0.5, 0.5]))
        self.assertTrue(jpeg.startswith(b"\xff\xd8\xff") and jpeg.endswith(b"\xff\xd9"))
        begin = jpeg.index(b"\xff\xc0")  # baseline: length, bits of a sample, height, width, components
        self.assertEqual(struct.unpack(">BHHB", jpeg[begin + 4 : begin + 10]), (8, 240, 320, components))
        self.assertLess(len(jpeg), len(got[b"preview"]) / 4)

    def test_a_colour_picture_comes_as_jpeg(self):
        self.check_jpeg("RGB8", 3)

    def test_a_grey_picture_comes_as_jpeg(self):
        self.check_jpeg("Mono8", 1)

    def test_who_may_only_read_sets_no_zero(self):
        self.rig.twin("idle")
        daemon = self.rig.daemon()
        for options, wanted in (((), b"reply/1"), (("--read-only",), b"error/1")):
            connection = self.upgrade(self.view(daemon, *options), path="/stream/0?topics=")
            connection.send(b"ask 1 zero")
            topic, said = self.receive(connection)
            self.assertEqual(topic, wanted, said)
        self.assertTrue(said.startswith(b"not_allowed "), said)

    def test_a_browser_that_stops_reading_costs_little_and_is_closed(self):
        self.rig.twin("hold")
        view = self.view(self.rig.daemon())
        self.is_well(view)
        before = view.memory_MiB()
        deaf = [self.upgrade(view, path=f"/stream/0?mode={mode}&topics=field,markers,status") for mode in ("newest", "stream") for _ in range(10)]
        deadline = time.monotonic() + 120 * PATIENCE
        while self.connected(view) > 0 and time.monotonic() < deadline:
            time.sleep(0.5)
        grown = view.memory_MiB() - before
        print(f"\n  {len(deaf)} that do not read: {grown:.1f} MiB", end=" ")
        self.assertEqual(self.connected(view), 0)
        self.assertLess(grown, 64)
        self.is_well(view)

    def connected(self, view):
        """Connections that the bridge has."""
        text = subprocess.run(["ss", "-Htn", "state", "established", f"( sport = :{view.port} )"], capture_output=True, text=True,
                              check=True).stdout
        return len(text.splitlines())

    def test_a_slow_one_is_given_the_newest_and_no_more_than_two_at_a_time(self):
        self.rig.twin("hold")
        view = self.view(self.rig.daemon())
        slow = self.upgrade(view, path="/stream/0?mode=newest&topics=field")
        for _ in range(2):
            self.receive(slow)
        slow.socket.settimeout(1.0)
        with self.assertRaises(TimeoutError):
            self.receive(slow)
        slow.socket.settimeout(20 * PATIENCE)
        slow.send(b"next")
        self.receive(slow)

    def heard(self, connection, topic):
        """The next message of this topic."""
        while True:
            found, text = self.receive(connection)
            if found.decode().startswith(topic):
                return text

    def asked(self, connection, question):
        """(how, text) of the answer."""
        connection.send(b"ask 7 " + question)
        while True:
            topic, text = self.receive(connection)
            if topic in (b"done/7", b"error/7"):
                return topic[:-2].decode(), text.decode()

    def test_recordings_that_are_none(self):
        folder = self.rig.folder / "recordings"
        folder.mkdir()
        golden = (SOURCE / "tests/golden/twist.mcap").read_bytes()
        cut = self.draw.randrange(100, len(golden) - 100)
        files = {"text.mcap": (b"nothing of that kind\n" * 9, "is no recording"), "cut off.mcap": (golden[:cut], "not closed"),
                 "whole.mcap": (golden, "")}
        for name, (content, _) in files.items():
            (folder / name).write_bytes(content)
        (folder / "secret.txt").write_text("not for you")
        self.rig.twin("idle")
        view = self.view(self.rig.daemon(), "--recordings", folder)
        listed = json.load(urllib.request.urlopen(view.url + "recordings"))["recordings"]
        self.assertEqual({one["name"]: one["bytes"] for one in listed}, {name: len(content) for name, (content, _) in files.items()})
        for name, (_, words) in files.items():
            connection = self.upgrade(view, f"/recording/{urllib.parse.quote(name)}?mode=stream&topics=field,description")
            topic, text = self.receive(connection)
            while topic not in (b"error", b"view/time"):
                topic, text = self.receive(connection)
            self.assertIn(words, text.decode() if topic == b"error" else json.loads(text)["trouble"], name)
        for name in ("none.mcap", "secret.txt", "..%2Frecordings%2Fwhole.mcap", "../recordings/whole.mcap", "%00", "%", "%4", ""):
            self.assertEqual(self.upgrade(view, f"/recording/{name}"), 404, name)
        self.is_well(view)

    def test_what_others_made_takes_little_memory_and_ends_with_the_signal(self):
        folder = self.rig.folder / "recordings"
        folder.mkdir()
        bomb = hostile.packed(hostile.record(200, bytes(60 << 20)))
        for name, content in (*hostile.recordings(), ("3,000 bombs", hostile.MAGIC + bomb * 3000)):
            file = name.replace(" ", "-").replace(",", "") + ".mcap"
            (folder / file).write_bytes(content)
            view = start_view(self.rig, None, "--connect", f"ipc://{folder}/none", "--recordings", folder)
            self.assertIsInstance(self.upgrade(view, f"/recording/{file}?mode=stream"), RawWebSocket)
            self.expect_end(view, name)
        with zmq.Context() as context, context.socket(zmq.PUB) as publisher:
            publisher.linger = 0
            publisher.bind(f"ipc://{folder}/stream")
            view = start_view(self.rig, None, "--connect", f"ipc://{folder}/stream")
            connection = self.upgrade(view, "/stream/0?mode=stream")
            self.assertIsInstance(connection, RawWebSocket)
            for _ in range(100):
                publisher.send_multipart([b"traction/v1/gel/description/", hostile.many_surfaces(), b"0.0"])
            self.expect_end(view, "a publisher of 200,000 surfaces")

    def expect_end(self, view, name):
        time.sleep(1)  # whatever it does in that time
        memory_kb = int(re.search(r"VmHWM:\s+(\d+)", pathlib.Path(f"/proc/{view.child.pid}/status").read_text())[1])
        begin = time.monotonic()
        self.assertEqual(view.stop(), 0, name)
        print(f"\n  {name}, shown: {memory_kb >> 10} MiB, SIGTERM ends it after {time.monotonic() - begin:.2f} s; right: 512 MiB, 1 s", end=" ")
        self.assertLess(memory_kb, 512 << 10, name)

    def test_pages_hear_the_verdict_on_the_instrument(self):
        """While it measures by a zero that no operator has taken, and when the camera is lost. Flags have words."""
        twin = self.rig.twin("idle", truth=False)
        view = self.view(self.rig.daemon())
        flags = json.load(urllib.request.urlopen(view.url + "sensors"))["flags"]
        self.assertEqual(flags["torn"], "picture torn")
        connection = self.upgrade(view, "/stream/0?topics=health")
        for health, words in (("measuring", "zero not verified"), ("no_fields", "the camera is lost")):
            told = {"health": "", "problems": []}
            while told["health"] != health or not any(one.startswith(words) for one in told["problems"]):
                told = json.loads(self.heard(connection, "view/health"))
                connection.send(b"next")
            twin.kill()

    def test_who_may_record_and_how_it_ends(self):
        folder = self.rig.folder / "recordings"
        folder.mkdir()
        self.rig.twin("idle")
        daemon = self.rig.daemon()
        stream = "/stream/0?mode=stream&topics=status"
        self.assertEqual(self.asked(self.upgrade(self.view(daemon), stream), b"record")[0], "error")
        only = self.view(daemon, "--recordings", folder, "--read-only")
        self.assertIn("read-only", self.asked(self.upgrade(only, stream), b"record")[1])
        view = self.view(daemon, "--recordings", folder)
        first, second = self.upgrade(view, stream), self.upgrade(view, stream)
        self.assertIn("nothing is being recorded", self.asked(first, b"stop")[1])
        how, name = self.asked(first, b"record")
        self.assertEqual(how, "done")
        self.assertIn("being recorded", self.asked(second, b"record")[1])
        first.socket.close()  # it goes on all the same
        self.assertEqual(json.loads(self.heard(second, "view/recorder"))["file"], name)
        time.sleep(1)
        how, account = self.asked(second, b"stop")
        self.assertEqual(how, "done")
        self.assertRegex(account, rf"^{name}: \d+ messages of [1-9]")
        code, text = self.rig.ctl("info", folder / name)
        self.assertEqual(code, 0, text)
        # Where the disk is full.
        subprocess.run(["prlimit", f"--pid={view.child.pid}", "--fsize=2000000:2000000"], check=True)
        time.sleep(1)  # the file's name has the second
        self.assertEqual(self.asked(second, b"record")[0], "done")
        while not (told := json.loads(self.heard(second, "view/recorder")))["error"]:
            pass
        self.assertIn("the recording has stopped with", told["error"])
        self.is_well(view)
        # It is a whole one where the viewer ends.
        view = self.view(daemon, "--recordings", folder)
        time.sleep(1)
        _, name = self.asked(self.upgrade(view, stream), b"record")
        time.sleep(1)
        self.assertEqual(view.stop(), 0, view.output())
        code, text = self.rig.ctl("info", folder / name)
        self.assertEqual(code, 0, text)
