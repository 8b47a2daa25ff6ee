"""The same fault in the simulation (tests/simulation/worlds/*.story) and against twin and daemon: the same lines in the log, the
same answers, the same counters and flags.

A line of the log counts in both worlds, unless it is of a part that the simulation does not have (NOT_SIMULATED). Numbers, names
and addresses in lines do not count, the number and order of lines does. All counters count but those that tell for how long a
world ran (NOT_COUNTED); a fault whose number of frames is left to chance names the counters that are only compared with 0.
"""

import collections
import os
import re
import signal
import socket
import subprocess
import threading
import time
import unittest

import freezer
import relay
import rig
import steady

STORIES = rig.SOURCE / "tests/simulation/worlds"
CAMERA, RELAY = "127.0.0.1", "127.0.0.2"
WATCHDOG_S = 0.8  # WatchdogSec= of the unit
FLAGS = {4: "discontinuity", 256: "doubted_origin"}
NOT_COUNTED = {"received", "published", "in_flight", "no_rest_pose"}
EVICTED = {"evicted_before_track", "evicted_before_solve", "evicted_before_publish"}  # by a machine that is busy with other work
FOR_A_WHILE = ("doubted", "flag doubted_origin")  # frames of some frame times
NOT_SIMULATED = [  # lines of the log
    r"^running: |^stopped: |^real time: ",  # the program around the instrument
    r"^warning: the kernel grants a receive buffer",
    r"^camera: ",  # what opening has set, a line each
    r"^  \{ |^\] \(was ",  # the further lines of a list in the configuration, which the simulation says in one piece
]
MASKED = [
    (r"Simulated-1|Traction-Twin-[-\d]+", "CAMERA"),
    (r"(?<=is opened as before: ).*", "REASON"),  # in the camera's words
    (r", packets of \d+ bytes.*", ""),  # of the stream, which the simulated driver has none of
    (r"somebody|uid \d+, pid \d+", "ASKER"),
    (r"(/[^ /:]+)*/(?=[\w.]+\.pose)|/state$|/[^ ]*/state$", "STATE/"),
    (r"\d+\.\d+\.\d+\.\d+", "ADDRESS"),
    (r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "N"),
]

World = collections.namedtuple("World", "log answers counters")


def masked(line):
    for pattern, mask in MASKED:
        line = re.sub(pattern, mask, line)
    return line


def simulated(name):
    """What the simulation makes of a story."""
    out = subprocess.run([rig.BIN / "simulate", "--story", STORIES / f"{name}.story", "--log"], capture_output=True, text=True,
                         check=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}).stdout
    log, answers, counters = [], [], {}
    for line in out.splitlines():
        if said := re.match(r" *\d+ ms  log: (.*)", line):
            log.append(masked(said[1]))
        elif ended := re.match(r" *\d+ ms  (the watchdog ends the daemon|the daemon is killed)$", line):
            log.append(ended[1])
        elif answer := re.match(r" *\d+ ms  answer: (.*)", line):
            answers.append("done" if re.match(r"zero [0-9a-f]{8}$", answer[1]) else masked(answer[1]))
        elif counter := re.match(r"(?:flag )?(\w+): (\d+)$", line):
            if counter[1] not in NOT_COUNTED and not line.startswith("flag ") or counter[1] in FLAGS.values():
                counters[("flag " if line.startswith("flag ") else "") + counter[1]] = int(counter[2])
    return World(log, answers, counters)


class Real:
    """Twin, relay and daemon, and what they say."""

    def __init__(self, bench, scenario="idle", config="", state=None, before=(), **options):
        self.bench, self.scenario, self.options = bench, scenario, options
        self.config = config + "[track]\nzero_frames = 10\n"
        self.log, self.answers, self.counters = [], [], collections.Counter()
        self.relay = relay.Relay(CAMERA, RELAY)
        bench.callback(self.relay.close)
        self.relay.change = lambda frame, packets: relay.with_id(packets, frame)
        self.twin = bench.twin(scenario, truth=False)
        self.state = state
        self.start()

    def start(self):
        self.daemon = self.bench.daemon(self.config, camera=RELAY, state=self.state, ready=False, **self.options)
        self.state = self.daemon.state
        self.path = self.bench.folder / "default/run/stream"
        self.daemon.wait_for("running")
        self.subscriber = self.bench.subscribe(self.daemon)
        self.last, self.force_N = None, 0.0
        self.run(1)

    def run(self, seconds):
        """Lets it run, and counts fields."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            item = self.subscriber.receive(left)
            if item and item[0] == "field":
                self.force_N = item[1].resultant_N.z
                for flag, name in FLAGS.items():
                    self.counters["flag " + name] += bool(item[1].header.flags & flag)
            elif item and item[0] == "status":
                self.last = item[1].ledger
            self.daemon.read()

    def wait(self, pattern, times=1):
        deadline = time.monotonic() + rig.HUNG_S
        while len(re.findall(pattern, self.daemon.output())) < times:
            assert time.monotonic() < deadline, f"no line with {pattern!r}:\n{self.daemon.output()}"
            self.run(0.1)

    def ask(self, *words):
        asking = self.bench.start(rig.BIN / "tractionctl", "--control", self.daemon.endpoint["control"], *words)
        deadline = time.monotonic() + 2 * rig.HUNG_S
        while asking.child.poll() is None and time.monotonic() < deadline:
            asking.read()
            self.run(0.1)
        code = asking.join()
        text = re.sub("^tractionctl: ", "", asking.output())
        self.answers.append("done" if code == 0 else masked(text))

    def take(self):
        """Adds what this life of the daemon has said and counted."""
        prefix = "tractiond: "
        lines = [line.removeprefix(prefix) for line in self.daemon.lines]
        self.log += [masked(line) for line in lines if not any(re.search(each, line) for each in NOT_SIMULATED)]
        if self.last is not None:
            for field, value in self.last.ListFields():
                self.counters[field.name] += value if field.name not in NOT_COUNTED else 0

    def die(self, how):
        self.daemon.stop(signal.SIGKILL)
        self.take()
        self.log.append(how)
        time.sleep(2)
        self.start()

    def end(self):
        self.run(2.2)  # a status that knows of all
        code = self.daemon.stop()
        self.take()
        assert code == 0, self.daemon.output()
        return World(self.log, self.answers, {name: value for name, value in self.counters.items() if value})


class OtherClient:
    """A program that controls the camera, and keeps it."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((CAMERA, 0))
        self.socket.connect((CAMERA, relay.CONTROL_PORT))
        self.socket.settimeout(1)
        self.number = 0
        self.ask(0x82, 0x0A00, 2)  # control channel privilege: control
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self.keep, daemon=True)
        self.thread.start()

    def ask(self, command, *words):
        self.number += 1
        body = b"".join(word.to_bytes(4, "big") for word in words)
        for _ in range(int(rig.HUNG_S)):
            self.socket.send(bytes([0x42, 1, 0, command, 0, len(body)]) + self.number.to_bytes(2, "big") + body)
            try:
                answer = self.socket.recv(1000)
            except TimeoutError:
                continue
            assert answer[:2] == bytes(2), f"the camera refuses command {command:#x}: {answer.hex()}"
            return
        raise AssertionError("the camera does not answer")

    def keep(self):
        while not self.ended.wait(0.5):
            self.ask(0x80, 0x0A00)  # the heartbeat

    def close(self):
        self.ended.set()
        self.thread.join()
        self.ask(0x82, 0x0A00, 0)
        self.socket.close()


class Worlds(steady.TestCase):
    maxDiff = None

    def setUp(self):
        self.bench = self.enterContext(rig.Rig())

    def compare(self, real, title, roughly=()):
        """Prints whether both worlds are the same, with the first difference; `roughly`: counters that are only compared with 0."""
        name = self._testMethodName.removeprefix("test_").replace("_", "-")
        ours, theirs = simulated(name), real.end()
        found = [f"log line {i + 1}: simulation {a!r}, real {b!r}" for i, (a, b) in enumerate(
            zip([*ours.log, *[None] * len(theirs.log)], [*theirs.log, *[None] * len(ours.log)])) if a != b]
        busy = any(theirs.counters.get(counter) for counter in EVICTED)  # then there are gaps that nobody made
        found += [f"answer {i + 1}: simulation {a!r}, real {b!r}" for i, (a, b) in enumerate(
            zip([*ours.answers, None], [*theirs.answers, None])) if a != b]
        for counter in sorted((ours.counters.keys() | theirs.counters.keys()) - (EVICTED - set(roughly))):
            a, b = ours.counters.get(counter, 0), theirs.counters.get(counter, 0)
            if a != b and not (counter in roughly and a and b) and not (counter == "flag discontinuity" and busy and b > a):
                found.append(f"{counter}: simulation {a}, real {b}")
        counted = ", ".join(f"{'about ' * (counter in roughly)}{value} {counter}" for counter, value in sorted(ours.counters.items()))
        what = f"{len(ours.log)} lines, {len(ours.answers)} answers, {counted or 'nothing lost'}"
        print(f"\n  {title:44} {'different: ' + found[0] if found else 'same: ' + what}", end=" ", flush=True)
        self.assertFalse(found, "\n".join([*found, "simulation:", *ours.log, *ours.answers, str(ours.counters),
                                           "real:", *theirs.log, *theirs.answers, str(theirs.counters), *real.daemon.lines]))

    def change_frames(self, real, count, change):
        """Changes so many frames from now on."""
        first, usual = real.relay.frames + 1, real.relay.change

        def changed(frame, packets):
            packets = usual(frame, packets)
            return change(frame, packets) if first <= frame < first + count else packets
        real.relay.change = changed
        real.run(3)

    def test_vanishes(self):
        real = Real(self.bench)
        real.run(3)
        real.twin.kill()
        real.run(9)
        real.relay.frames = 0  # it counts anew
        real.twin = self.bench.twin("idle", truth=False)
        real.wait("is back")
        real.run(3)
        self.compare(real, "the camera has no power for 9 s")

    def test_held(self):
        real = Real(self.bench)
        real.run(3)
        real.twin.kill()
        real.run(3)
        real.relay.frames, real.relay.deaf = 0, True
        real.twin = self.bench.twin("idle", truth=False)
        other = OtherClient()
        real.relay.deaf = False
        real.wait("close that client")
        real.wait("(?m)is held by another client$", 2)  # the next try, which takes a while
        other.close()
        real.wait("is back")
        real.run(3)
        self.compare(real, "another client holds the camera that is back", roughly=("missing",))

    def test_refuses(self):
        real = Real(self.bench)
        real.run(3)
        file = self.bench.folder / "default" / "tractiond.toml"
        file.write_text(f'[camera]\nid = "{RELAY}"\nfeatures = [{{ NoSuchFeature = 1 }}]\n' + real.config)
        real.daemon.child.send_signal(signal.SIGHUP)
        real.wait("is opened as before")
        real.run(3)
        self.compare(real, "the camera refuses a setting of a reload", roughly=("missing",))

    def test_silent(self):
        real = Real(self.bench)
        real.run(3)
        real.relay.silent = True
        real.run(4)
        real.relay.silent = False
        real.run(8)
        self.compare(real, "no picture for 4 s, while the camera answers", roughly=("missing",))

    def test_gap(self):
        real = Real(self.bench)
        real.run(3)
        self.change_frames(real, 6, lambda frame, packets: [])
        self.compare(real, "6 frames are lost")

    def test_broken(self):
        real = Real(self.bench)
        real.run(3)
        first = real.relay.frames + 1
        real.relay.lost = set(range(first, first + 60))
        self.change_frames(real, 6, lambda frame, packets: packets[:40] + packets[41:])
        self.compare(real, "of 6 frames a packet is lost for good")

    def test_restarts(self):
        real = Real(self.bench)
        real.run(3)
        first = real.relay.frames
        self.change_frames(real, 10**9, lambda frame, packets: relay.with_id(packets, frame - first))
        self.compare(real, "the camera's counter begins anew", roughly=FOR_A_WHILE)

    def test_jumps(self):
        real = Real(self.bench)
        real.run(3)
        self.change_frames(real, 10**9, lambda frame, packets: relay.with_id(packets, frame + 1000))
        self.compare(real, "the camera's counter jumps by 1,000", roughly=FOR_A_WHILE)

    def test_clock(self):
        real = Real(self.bench)
        real.run(3)
        self.change_frames(real, 10**9, lambda frame, packets: relay.later(packets, 5 * 10**9))
        self.compare(real, "the camera's clock is set forward by 5 s", roughly=FOR_A_WHILE)

    def test_again(self):
        real = Real(self.bench)
        real.run(3)
        kept = collections.deque()

        def again(frame, packets):
            kept.append(packets)
            return packets + (kept.popleft() if len(kept) > 5 else [])
        self.change_frames(real, 11, again)
        self.compare(real, "6 frames come a second time", roughly=FOR_A_WHILE)

    def disk(self):
        """Returns a state directory on a small disk, with room for the factors that are lent to the daemon."""
        lent = sum(file.stat().st_size for file in rig.cache_directory().glob("*.factors"))
        state = self.bench.folder / "default" / "state"
        state.mkdir(parents=True)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={lent + (64 << 20)}", "tmpfs", state], check=True)
        self.bench.callback(subprocess.run, ["umount", "-l", state])
        return state

    def test_full_disk(self):
        state = self.disk()
        real = Real(self.bench, state=state)
        real.run(3)
        filling = state / "filling"
        with open(filling, "wb", buffering=0) as file:
            try:
                while True:
                    file.write(bytes(4096))
            except OSError:
                pass
        real.ask("zero")
        real.run(14)
        filling.unlink()
        real.wait("has been written to the disk")
        self.compare(real, "the disk is full when a zero is kept")

    def test_disk_hangs(self):
        wish = self.bench.folder / "disk"
        wish.write_text("0")
        real = Real(self.bench, env={"LD_PRELOAD": rig.BUILD / "tests/support/traction_slow_disk.so", "TRACTION_SLOW_DISK": wish})
        real.run(3)
        wish.write_text("hold")
        real.ask("zero")
        real.run(2)
        wish.write_text("0")
        real.run(3)
        self.compare(real, "the disk hangs for a minute when a zero is kept")

    def test_under_load(self):
        scenario = self.bench.folder / "touch.toml"
        scenario.write_text('format = 1\nperiod_s = 1000000\n[[contacts]]\nshape = "hertz"\nradius_mm = 2.5\n'
                            "time_s = [8, 8.5, 20, 20.5]\nx_mm = 0.7\ny_mm = 0.4\nforce_z_n = [0, 3.9, 3.9, 0]\n")
        real = Real(self.bench, scenario)
        while real.force_N < 3.5:
            real.run(0.5)
        real.run(0.5)
        real.ask("zero")
        while real.force_N > 0.3:
            real.run(0.5)
        real.run(1.5)
        real.ask("zero")
        real.run(1)
        real.ask("zero", "--undo")
        real.run(2)
        self.compare(real, "a zero is asked for under load")

    def test_killed(self):
        real = Real(self.bench)
        real.run(3)
        real.die("the daemon is killed")
        real.run(3)
        self.compare(real, "the daemon is killed")

    def test_stalled(self):
        systemd = rig.Systemd(self.bench, WATCHDOG_S)
        real = Real(self.bench, env=systemd.env)
        real.run(3)
        solving = next(tid for tid, name in freezer.threads(real.daemon.child.pid).items() if name == "tr-solve")
        with freezer.Frozen(solving):
            while time.monotonic() <= systemd.fed[-1] + WATCHDOG_S:
                real.run(0.05)
            real.run(1)  # a status, which comes without the solver
            real.daemon.child.send_signal(signal.SIGKILL)
        real.die("the watchdog ends the daemon")
        real.run(3)
        self.compare(real, "a stage stands still", roughly=("evicted_before_solve",))


if __name__ == "__main__":
    unittest.main()
