"""What goes wrong in a soak: each fault by itself, with numbers from a generator of its own."""

import contextlib
import ctypes
import json
import os
import signal
import subprocess
import sys
import threading
import time


import deaf
import freezer
import rig

NEAR, CAMERA, STRANGER = "10.9.8.1", "10.9.8.2", "10.9.8.3"  # the daemon's end of the cable, the camera's, another there
RATE = 60  # frames/s
PACKET = 8996 - 36  # bytes of picture in a packet of the default size
FLOODS = ("silence", "junk", "handshakes", "connections", "subscriptions", "requests", "snapshots")

FAULTS = []


def fault(*touched):
    """Two that touch the same do not come together."""
    def add(method):
        method.touched = set(touched)
        FAULTS.append(method)
        return method
    return add


class Faults:
    """Of a Soak, which has what they happen to."""

    def wait(self, draw, at_least, at_most):
        seconds = self.brief * draw.uniform(at_least, at_most)
        time.sleep(seconds)
        return seconds

    def set_wire(self, **state):
        self.wire.child.stdin.write(json.dumps(state).encode() + b"\n")
        self.wire.child.stdin.flush()

    def at_camera(self, make):
        """What `make` makes, in the camera's network namespace: a socket stays where it was made."""
        made = []

        def enter():
            with open(self.inside) as there:
                if ctypes.CDLL(None).setns(there.fileno(), 0) == 0:
                    made.append(make())
        thread = threading.Thread(target=enter)
        thread.start()
        thread.join()
        return made[0]

    def ctl(self, *words, remote=False):
        """tractionctl, here or through the gateway: (exit code, output)."""
        where = [self.gateway.endpoint["control"], "--key", self.key_file] if remote else [self.daemon.endpoint["control"]]
        return self.bench.ctl(*words, "--control", *where, seconds=90)

    @fault("camera")
    def camera_dies(self, draw):
        how, away = draw.choice([signal.SIGKILL, signal.SIGTERM]), draw.choice([0, self.brief * draw.uniform(0, 3)])
        self.twin.stop(how)
        if how == signal.SIGKILL:
            self.truth.camera_was_killed()
        time.sleep(away)
        self.plug_camera()
        return f"{how.name}, away for {away:.2f} s"

    def hang(self, process, draw):
        process.child.send_signal(signal.SIGSTOP)
        seconds = self.wait(draw, 0.05, 4)
        process.child.send_signal(signal.SIGCONT)
        return f"for {seconds:.2f} s"

    @fault("camera")
    def camera_hangs(self, draw):
        return self.hang(self.twin, draw)

    @fault("camera")
    def cable_pulled(self, draw):
        how = draw.choice(["carrier", "silence", "interface"])
        if how == "carrier":
            self.set_wire(carrier=False)
        elif how == "silence":
            self.set_wire(cut=True)
        else:
            subprocess.run(["ip", "link", "set", "cable", "down"], check=True)
        seconds = self.wait(draw, 0.02, 4)
        subprocess.run(["ip", "link", "set", "cable", "up"], check=True)
        self.set_wire(cut=False, carrier=True)
        return f"{how}, for {seconds:.2f} s"

    @fault("camera")
    def cable_bad(self, draw):
        bad = {what: 10 ** draw.uniform(-4, -1.3) for what in draw.sample(["loss", "twice", "late"], draw.randint(1, 3))}
        self.set_wire(**bad, late_ms=draw.uniform(0.1, 30))
        seconds = self.wait(draw, 1, 5)
        self.set_wire(loss=0, twice=0, late=0)
        return (", ".join(f"{what} {share:.4f}" for what, share in bad.items()) + f", for {seconds:.2f} s")

    def forgers(self, sources):
        """Senders to the stream's port: from here, and from where the camera is."""
        port = rig.stream_port(self.daemon)
        return [rig.Forger(NEAR, port, NEAR) if source == NEAR else
                self.at_camera(lambda source=source: rig.Forger(NEAR, port, source)) for source in sources]

    @fault("camera")
    def stranger(self, draw):
        """Whole pictures, before the camera sends them."""
        source, end = draw.choice([NEAR, STRANGER]), time.monotonic() + self.brief * draw.uniform(1, 4)
        forger, = self.forgers([source])
        picture, count = draw.randbytes(3 * 640 * 480), 0
        while time.monotonic() < end:
            header = self.local.field.header
            with contextlib.suppress(OSError):
                forger.frame(header.camera_frame_id % 65535 + 1, picture, 640, 480, header.device_time_ns + 16_000_000,
                             chunk=PACKET)
            count += 1
        forger.close()
        return f"{count} pictures from {source}"

    @fault("camera")
    def driver_hangs(self, draw):
        thread = next(tid for tid, name in freezer.threads(self.daemon.child.pid).items() if name == "arv_gv_stream")
        with freezer.Frozen(thread):
            seconds = self.wait(draw, 0.1, 3)
        return f"for {seconds:.2f} s"

    @fault()
    def subscribers_freeze(self, draw):
        count, between = draw.randint(1, 45), draw.choice([0, draw.uniform(0.01, 0.1)])
        path = self.daemon.endpoint["stream"].removeprefix("ipc://")
        some = []
        for _ in range(count):
            with contextlib.suppress(OSError):  # it may be cut off before it has greeted, if others come with it
                some.append(deaf.Subscriber(path))
            time.sleep(self.brief * between)
        seconds = self.wait(draw, 0.5, 8)
        for one in some:
            one.close()
        return f"{len(some)} of {count}, {between:.2f} s apart, for {seconds:.2f} s"

    @fault("gateway")
    def gateway_flood(self, draw):
        kind, seconds = draw.choice(FLOODS), self.brief * draw.uniform(2, 5)
        ports = [at.rsplit(":", 1)[1] for at in self.gateway.endpoint.values()]
        flood = self.bench.start(sys.executable, rig.SOURCE / "tests/support/flood.py", kind, seconds, *ports, *self.eve)
        flood.wait_for("flooding")
        rig.weigh(flood, 19)  # it would come from elsewhere
        flood.join(seconds + 30)
        return f"{kind}, for {seconds:.2f} s: {flood.lines[-1]}"

    @fault("gateway")
    def gateway_dies(self, draw):
        how = draw.choice([signal.SIGKILL, signal.SIGTERM])
        self.gateway_away.set()
        self.end_process(self.gateway, how)
        seconds = self.wait(draw, 0, 2)
        self.start_gateway()
        self.gateway_away.clear()
        return f"{how.name}, away for {seconds:.2f} s"

    @fault("gateway")
    def gateway_hangs(self, draw):
        return self.hang(self.gateway, draw)

    def reload(self, text):
        self.file.write_text(text)
        self.daemon.child.send_signal(signal.SIGHUP)

    @fault("camera", "configuration")
    def reload_right(self, draw):
        rate = draw.randint(30, 59)
        for text in (self.configuration.replace(f"= {RATE}", f"= {rate}"), self.configuration):
            self.reload(text)
            self.wait(draw, 1, 3)
        return f"{rate} frames/s, and as before"

    @fault("configuration")
    def reload_wrong(self, draw):
        right = self.configuration
        wrong = draw.choice([right + "gain = \n", right.replace(f"= {RATE}", "= 0.5e9"), right + "width_px = 320\n",
                             "\ufeff" + draw.randbytes(2000).decode("latin-1"), right + "a." * 5000 + "b = 1\n",
                             right + '[sensor]\ngel_file = "/nowhere.toml"\n'])
        self.reload(wrong)
        self.wait(draw, 0.2, 1)
        self.reload(self.configuration)
        self.wait(draw, 0.2, 0.5)
        return repr(wrong[len(right):][:40] or wrong[:40])

    @fault("configuration")
    def log_unread(self, draw):
        self.unread.set()
        end, count = time.monotonic() + self.brief * draw.uniform(2, 6), 0
        while time.monotonic() < end:
            self.reload(self.configuration + "nonsense\n")
            count += 1
            time.sleep(0.02)
        self.reload(self.configuration)
        self.unread.clear()
        return f"while it was told {count} times of a wrong configuration"

    @fault("control")
    def requests(self, draw):
        """Of all kinds, also while something presses: a zero is refused then."""
        said = []
        for _ in range(draw.randint(2, 8) if self.brief == 1 else 3):
            words = draw.choice([["zero"], ["zero"], ["zero", "--undo"],
                                 ["calibrate", "geometry", "noise", "--seconds", "1", "--yes"],
                                 ["snapshot", self.bench.folder / "a.png", "--marked"],
                                 ["camera", "list"], ["describe"], ["status"], ["metrics"]])
            remote = words[0] != "metrics" and draw.random() < 0.4
            begin = time.monotonic()
            code, text = self.ctl(*words, remote=remote)
            said.append(f"{words[0]}{' --undo' * ('--undo' in words)}{' from remote' * remote}: {code} after "
                        f"{time.monotonic() - begin:.2f} s{f' ({text.splitlines()[-1]})' if code != 0 and text else ''}")
            if code not in (0, os.EX_NOINPUT, os.EX_UNAVAILABLE, os.EX_TEMPFAIL):
                self.blame(f"{words} ended with {code}: {text[-1000:]}")
        return "; ".join(said)

    @fault()
    def busy_machine(self, draw):
        hogs = [self.bench.start("sh", "-c", "while :; do :; done") for _ in range(draw.randint(1, 2) * os.cpu_count())]
        seconds = self.wait(draw, 1, 5)
        for one in hogs:
            one.kill()
        return f"{len(hogs)} hogs, for {seconds:.2f} s"

    def set_time_of_day(self, ahead_s):
        with open(self.time_of_day_file, "r+b") as file:
            file.write(ahead_s.to_bytes(8, "little", signed=True))

    @fault("time")
    def time_of_day(self, draw):
        """It is set, for the daemon; the camera keeps its own."""
        ahead_s = draw.choice([-1, 1]) * int(10 ** draw.uniform(0, 5))
        self.set_time_of_day(ahead_s)
        seconds = self.wait(draw, 0.5, 4)
        self.set_time_of_day(0)
        return f"{ahead_s:+} s, for {seconds:.2f} s"
