"""Twin, daemon and subscribers as processes, for the system tests and the benchmarks.

Run inside a network namespace of its own (tests/system/CMakeLists.txt sees to it): the camera's port is fixed.
"""

import collections
import contextlib
import json
import os
import pathlib
import queue
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

import numpy as np
import seed
import zmq
from deadline import HUNG_S

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
BIN = BUILD / "bin"
SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(BUILD / "python"))

from traction.v1 import messages  # noqa: E402  (generated into the build folder)
from traction.v1.options_pb2 import metric  # noqa: E402
from traction.v1.status_pb2 import Ledger  # noqa: E402

LOSSES = tuple(field.name for field in Ledger.DESCRIPTOR.fields
               if field.GetOptions().Extensions[metric].name == "frames_lost_total")

GRAM_FORCE = 9.80665e-3  # [N]
# Sanitizers slow everything down; deadlines, never results, are stretched by this.
PATIENCE = float(os.environ.get("TRACTION_PATIENCE", "1"))


class Process:
    """A child whose lines can be waited for, and which never outlives the test."""

    def __init__(self, *command, env=None, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL):
        self.command = [str(word) for word in command]
        self.lines = []
        self.child = subprocess.Popen(
            self.command, stdout=subprocess.PIPE, stderr=stderr, stdin=stdin,
            env={**os.environ, **(env or {})}, start_new_session=True)
        os.set_blocking(self.child.stdout.fileno(), False)
        self._partial = b""

    def read(self, timeout=0.0):
        """Collects what was printed; False at the end of the output."""
        if not select.select([self.child.stdout], [], [], timeout)[0]:
            return True
        chunk = os.read(self.child.stdout.fileno(), 65536)
        *whole, self._partial = (self._partial + chunk).split(b"\n")
        self.lines += [line.decode(errors="replace") for line in whole]
        if not chunk and self._partial:
            self.lines.append(self._partial.decode(errors="replace"))
            self._partial = b""
        return bool(chunk)

    def forget(self):
        """What was printed up to now."""
        while select.select([self.child.stdout], [], [], 0)[0] and self.read():
            pass
        self.lines.clear()

    def wait_for(self, pattern, seconds=HUNG_S):
        """The first line, old or new, that matches; fails with the output otherwise."""
        deadline = time.monotonic() + seconds * PATIENCE
        seen = 0
        alive = True
        while True:
            for line in self.lines[seen:]:
                if re.search(pattern, line):
                    return line
            seen = len(self.lines)
            if not alive or time.monotonic() > deadline:
                raise AssertionError(f"{self.command[0]}: no line with {pattern!r}; it printed:\n" + self.output())
            alive = self.read(0.1)

    def output(self):
        return "\n".join(self.lines)

    def memory_MiB(self):
        """That is resident."""
        pages = pathlib.Path(f"/proc/{self.child.pid}/statm").read_text().split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE") / 2**20

    def listening(self):
        """The endpoints that a gateway says it has."""
        return [line.split("listening at ")[1] for line in self.lines if "listening at " in line]

    def stop(self, sig=signal.SIGTERM, seconds=HUNG_S):
        """Ends the child and returns its exit code."""
        if self.child.poll() is None:
            self.child.send_signal(sig)
        return self.join(seconds)

    def join(self, seconds=HUNG_S):
        deadline = time.monotonic() + seconds * PATIENCE
        while self.read(0.1) and time.monotonic() < deadline:
            pass
        try:
            return self.child.wait(max(0.1, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            os.killpg(self.child.pid, signal.SIGKILL)
            raise AssertionError(f"{self.command[0]} did not end; it printed:\n" + self.output())

    def kill(self):
        with contextlib.suppress(ProcessLookupError):  # what it has started may be there when it has gone
            os.killpg(self.child.pid, signal.SIGKILL)
        self.child.wait()
        self.child.stdout.close()


def weigh(process, nice):
    """Gives the session of a process a smaller share of the processor than others. Says so where the kernel counts no sessions
    (CONFIG_SCHED_AUTOGROUP); raises OSError where it refuses.
    """
    share = pathlib.Path(f"/proc/{process.child.pid}/autogroup")
    if not share.exists():
        print(f"\n  no autogroups in this kernel: {process.command[0]} has the same share as all ", end="", flush=True)
        return
    share.write_text(str(nice))
    assert share.read_text().split()[1:] == ["nice", str(nice)], share.read_text()
    time.sleep(0.3)  # it takes one a while


def beside_burner(bench, seconds, processors, measure):
    """What `measure` returns while a process that would come from elsewhere takes so many processors."""
    burner = bench.start(sys.executable, SOURCE / "tests/support/burner.py", seconds, processors)
    burner.wait_for("burning")
    weigh(burner, 19)
    result = measure()
    burner.join(seconds + 30)
    return result


def times(flooded_ms, before_ms, burner_ms, processors):
    """p99 under a flood beside two others: with nothing, and beside a process that takes what the flood took of the processors."""
    return (f"p99 of others {before_ms:.2f} -> {flooded_ms:.2f} ms ({flooded_ms / before_ms:.2f} times; the flood itself took "
            f"{processors:.2f} processors: beside a loop that takes as much {burner_ms:.2f} ms, of which the flood's is "
            f"{flooded_ms / burner_ms:.2f} times)")


def cache_directory():
    """Where twins and daemons of all tests and builds share what only depends on the gel: a sanitized daemon takes minutes."""
    path = SOURCE / "build" / "test-cache"
    path.mkdir(parents=True, exist_ok=True)
    return path


def lend_factors(state):
    """What daemons have computed before into a state directory, which is made. Links, as copies may fill a /tmp in memory."""
    state.mkdir(parents=True, exist_ok=True)
    for cached in cache_directory().glob("*.factors"):
        with contextlib.suppress(FileExistsError):
            (state / cached.name).symlink_to(cached)


def keep_factors(state):
    for made in state.glob("*.factors"):
        kept = cache_directory() / made.name
        if kept.exists():
            continue
        part = kept.with_name(f".{made.name}.{os.getpid()}")  # it is there whole or not at all
        shutil.copyfile(made, part)
        part.rename(kept)


class Lit:
    """A file of pictures in other light."""

    def __init__(self, source, light):
        self.source, self.light, self.number = source, light, -1

    def read(self, size):
        self.number += 1
        picture = np.frombuffer(self.source.read(size), np.uint8) * self.light(self.number)
        return np.rint(picture).clip(0, 255).astype(np.uint8).tobytes()


BITS = {"RGB8": 24, "BayerRG8": 8, "BayerGR8": 8, "Mono8": 8, "Mono12p": 12}  # of a pixel
Film = collections.namedtuple("Film", "fields markers description account")


class Rig(contextlib.ExitStack):
    """One test's folder and processes; all of them end with it."""

    def __enter__(self):
        super().__enter__()
        self.folder = pathlib.Path(self.enter_context(tempfile.TemporaryDirectory(prefix="traction-")))
        return self

    def start(self, *command, **options):
        process = Process(*command, **options)
        self.callback(process.kill)
        return process

    def twin(self, scenario, *options, address="127.0.0.1", truth=True, ready=True):
        truth_file = self.folder / f"truth-{address}.jsonl"
        command = [BIN / "traction-twin", scenario, "--address", address, "--cache", cache_directory()]
        if truth:
            command += ["--truth", truth_file]
        process = self.start(*command, *options)
        process.truth_file = truth_file
        if ready:
            process.wait_for("ready")
        return process

    def daemon(self, config="", *options, instance="default", camera="127.0.0.1", state=None, ready=True, before=(), **process):
        """`config` is TOML text put behind the camera's address; the solver's cache is shared between tests."""
        base = self.folder / instance
        (base / "run").mkdir(parents=True, exist_ok=True)
        state = pathlib.Path(state or base / "state")
        lend_factors(state)
        file = base / "tractiond.toml"
        file.write_text(config if camera is None else f'[camera]\nid = "{camera}"\n' + config)
        process = self.start(*before, BIN / "tractiond", "--instance", instance, "--config", file, "--state", state,
                             "--runtime", base / "run", *options, **process)
        process.endpoint = {name: f"ipc://{base / 'run' / name}" for name in ("stream", "latest", "control")}
        process.state = state
        if ready:
            process.wait_for("running")
            keep_factors(state)
        return process

    def feed(self, source, pictures, rest, config="", pixel_format="RGB8"):
        """Passes pictures of 640 x 480 from a binary file through a pipe into a daemon, as fast as it reads them: none is lost,
        however busy the machine. After the first `rest` pictures, if that is not None, it waits until the daemon has a zero.
        Returns the Film of all that was published.
        """
        pipe = self.folder / "pictures"
        os.mkfifo(pipe)
        ours = os.open(pipe, os.O_RDWR)  # so that the daemon waits for no writer, and the end comes when this is closed
        daemon = self.daemon(f'[camera]\nwidth_px = 640\nheight_px = 480\npixel_format = "{pixel_format}"\n' + config +
                             "[publish]\nhigh_water_mark = 100000\n",  # it may measure them all before we read
                             "--images", pipe, camera=None)
        subscriber = self.subscribe(daemon)
        film = Film([], [], subscriber.collect(1, "description")[0], None)  # so the subscription has arrived
        with open(pipe, "wb", buffering=0) as target:
            for number in range(pictures):
                if number == rest:
                    daemon.wait_for("zero taken, by itself|the zero is the one kept")
                picture = memoryview(source.read(640 * 480 * BITS[pixel_format] // 8))
                assert picture, f"there are {number} pictures, not {pictures}"
                while picture:
                    picture = picture[target.write(picture):]
        deadline = time.monotonic() + HUNG_S * PATIENCE
        while not film.fields or film.fields[-1].header.camera_frame_id != pictures:
            kind, message, _ = subscriber.receive(max(0.0, deadline - time.monotonic())) or ("nothing", None, None)
            assert kind != "nothing", f"{len(film.fields)} fields came:\n" + daemon.output()
            if kind in ("field", "markers"):
                deadline = time.monotonic() + HUNG_S * PATIENCE
                (film.fields if kind == "field" else film.markers).append(message)
        os.close(ours)
        assert daemon.join() == 0, daemon.output()
        return film._replace(account=daemon.wait_for("stopped: "))

    FILM_HZ = 20  # a third of a camera's: each picture is drawn and solved

    def film(self, scenario, seconds, *options, config="", pixel_format="RGB8", light=None):
        """Feeds a scenario's first seconds; its first load comes after four. `light`: brightness of the picture of a number, relative,
        for formats of 8 bits. Returns the Film and the truth of each frame, by camera_frame_id.
        """
        truth_file = self.folder / "truth.jsonl"
        command = [BIN / "traction-twin", scenario, "--cache", cache_directory(), "--truth", truth_file, "--images", "-",
                   "--format", pixel_format, "--rate", self.FILM_HZ, *options]
        twin = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL,
                                start_new_session=True)
        self.callback(twin.wait)
        self.callback(twin.kill)
        film = self.feed(Lit(twin.stdout, light) if light else twin.stdout, round(seconds * self.FILM_HZ), 3 * self.FILM_HZ, config, pixel_format)
        twin.send_signal(signal.SIGTERM)
        twin.stdout.close()
        twin.truth_file = truth_file
        return film, read_truth(twin)

    def gateway(self, daemon, config="", *options, keys=True, ready=True, before=(), **process):
        """`config` is TOML text behind the endpoints, which are at any free port; `keys`: the box has one."""
        base = pathlib.Path(self.enter_context(tempfile.TemporaryDirectory(prefix="gateway-", dir=self.folder)))
        file = base / "gateway.toml"
        file.write_text(f'[gateway]\nkeys = "{self.folder / "keys"}"\n' + "".join(
            f'{name} = ["tcp://127.0.0.1:*"]\n' for name in ("stream", "latest", "control")
            if not re.search(rf"(?m)^{name} = ", config)) + config)
        if keys and not (self.folder / "keys").exists():
            self.allow("nobody", zmq.curve_keypair()[0].decode())
        runtime = daemon.endpoint["stream"].removeprefix("ipc://").removesuffix("/stream")
        process = self.start(*before, BIN / "traction-gateway", "--config", file, "--runtime", runtime, *options, **process)
        process.file = file
        if ready:
            process.wait_for("listening.*")
            names = ("stream", "latest", "control") + ("preview",) * bool(re.search(r"(?m)^preview = ", config))
            while len(process.listening()) < len(names):
                process.read(0.1)
            process.endpoint = dict(zip(names, process.listening()))
        return process

    def allow(self, name, key, *options):
        """tractionctl keys allow; the box's public key."""
        code, text = self.ctl("keys", "allow", name, "--directory", self.folder / "keys", *options, "--", key)  # may begin with -
        assert code == 0, text
        return (self.folder / "keys" / "gateway.secret").read_text().split('public = "')[1].split('"')[0]

    def subscribe(self, daemon, topic="", keys=None):
        return Subscriber(self, daemon.endpoint["stream"], topic, keys)

    def ctl(self, *words, seconds=HUNG_S):
        """Runs tractionctl to its end: (exit code, output)."""
        process = self.start(BIN / "tractionctl", *words)
        return process.join(seconds), process.output()


class TestCase(seed.TestCase):
    """One with a rig of its own."""

    def setUp(self):
        self.bench = self.enterContext(Rig())

    def file(self, name, text):
        path = self.bench.folder / name
        path.write_text(text)
        return path

    def ctl(self, daemon, *words):
        """Runs tractionctl beside a daemon: (exit code, output)."""
        return self.bench.ctl("--control", daemon.endpoint["control"], *words)

    def status_where(self, daemon, holds):
        """(exit code, output) of a status for which `holds`. It is put together once a second."""
        until = time.monotonic() + HUNG_S
        while True:
            code, output = self.ctl(daemon, "status", "--json")
            if code in (os.EX_OK, os.EX_NOINPUT) and holds(json.loads(output.splitlines()[0])):
                return code, output
            self.assertLess(time.monotonic(), until, output)
            time.sleep(0.1)


class Systemd:
    """Hears what a service tells it, always: a service waits for whoever reads no notices."""

    def __init__(self, rig, watchdog_s=2.0):
        self.socket = rig.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        path = str(rig.folder / "notify")
        self.socket.bind(path)
        self.socket.setsockopt(socket.SOL_SOCKET, 35, 1)  # SO_TIMESTAMPNS: when it came, not when we find time to read
        self.env = {"NOTIFY_SOCKET": path, "WATCHDOG_USEC": str(int(1e6 * watchdog_s))}
        self.fed = []  # when the watchdog was
        self.notices = queue.Queue()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        while True:
            data, ((_, _, stamp), *_), *_ = self.socket.recvmsg(4096, 256)
            lines = data.decode().splitlines()
            if "WATCHDOG=1" in lines:
                seconds, nanoseconds = struct.unpack("qq", stamp)
                self.fed.append(time.monotonic() - (time.time() - seconds - 1e-9 * nanoseconds))
            self.notices.put(lines)

    def wait_for(self, wanted):
        """The notice that has this line, whole."""
        lines = []
        while wanted not in lines:
            lines = self.notices.get(timeout=HUNG_S * PATIENCE)
        return lines


class Subscriber:
    """A plain SUB socket and the generated messages: independent of our client library."""

    TYPES = {"field": messages.Field, "markers": messages.Markers, "description": messages.Description,
             "preview": messages.Preview, "contacts": messages.Contacts,
             "status": messages.Status}

    def __init__(self, rig, endpoint, topic="", keys=None):
        """`keys` for a gateway: a server's public key, and a pair."""
        self.socket = zmq.Context.instance().socket(zmq.SUB)
        rig.callback(self.socket.close, 0)
        self.socket.rcvhwm = 10000
        if keys:
            self.socket.curve_serverkey, self.socket.curve_publickey, self.socket.curve_secretkey = (
                key.encode() for key in keys)
        self.socket.connect(endpoint)
        self.socket.subscribe(topic)

    def receive(self, seconds=10.0):
        """(kind, message, CLOCK_MONOTONIC [ns] of the receive) or None after the time."""
        if not self.socket.poll(seconds * 1000):
            return None
        topic, payload, *_ = self.socket.recv_multipart()
        now = time.monotonic_ns()
        kind = topic.decode().rstrip("/").rsplit("/", 1)[1]
        return kind, self.TYPES[kind].FromString(payload), now

    def collect(self, count=None, kind="field", seconds=HUNG_S, until=None):
        """The next `count` messages of a kind, or all up to and including the one for which `until` holds."""
        result = []
        deadline = time.monotonic() + seconds * PATIENCE
        while count is None or len(result) < count:
            left = deadline - time.monotonic()
            item = self.receive(left) if left > 0 else None
            if item is None:
                raise AssertionError(f"only {len(result)} {kind} messages in {seconds} s")
            if item[0] == kind:
                result.append(item[1])
                if until is not None and until(item[1]):
                    break
        return result


def read_truth(twin):
    """Camera frame id -> record of the truth file (the last lap of the 16-bit counter wins)."""
    with open(twin.truth_file) as lines:
        return {record["camera_frame_id"]: record for record in map(json.loads, filter(str.strip, lines))}


def vector(message):
    return np.array([message.x, message.y, message.z])


def udp_ports(process):
    """The UDP ports of a process."""
    text = subprocess.run(["ss", "-Huanp"], capture_output=True, text=True, check=True).stdout
    return [int(line.split()[3].rsplit(":", 1)[1]) for line in text.splitlines() if f"pid={process.child.pid}," in line]
