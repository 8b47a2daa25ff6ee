"""A thread that hangs, whosever it is: systemd's watchdog fires within a second, or the daemon mends it by itself."""

import os
import random
import signal
import socket
import threading
import time
import unittest

import freezer
import rig

WATCHDOG_S = 0.8  # WatchdogSec= of the unit


class Stalls(unittest.TestCase):
    def setUp(self):
        self.bench = self.enterContext(rig.Rig())
        self.systemd = self.enterContext(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        path = str(self.bench.folder / "notify")
        self.systemd.bind(path)
        self.env = {"NOTIFY_SOCKET": path, "WATCHDOG_USEC": str(int(1e6 * WATCHDOG_S))}
        self.fed = []  # when the watchdog was
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        while True:
            if b"WATCHDOG=1" in self.systemd.recv(4096):
                self.fed.append(time.monotonic())

    def starved(self):
        """Since when, if the watchdog would have fired."""
        return self.fed[-1] + WATCHDOG_S if time.monotonic() > self.fed[-1] + WATCHDOG_S else None

    def test_every_thread(self):
        self.bench.twin("idle", truth=False)
        names = None
        while names is None or names:
            daemon = self.bench.daemon(env=self.env)
            subscriber = self.bench.subscribe(daemon)
            subscriber.collect(60)
            running = freezer.threads(daemon.child.pid)
            if names is None:
                names = sorted(running.values())
            number, name = names[:-1].count(names[-1]), names.pop()
            with self.subTest(name):
                tid = [tid for tid, other in sorted(running.items()) if other == name][number]
                begin = time.monotonic()
                with freezer.Frozen(tid):
                    noticed = None
                    last = begin
                    while time.monotonic() < begin + 4 and not noticed:
                        item = subscriber.receive(0.05)
                        if item is not None and item[0] == "field":
                            last = time.monotonic()
                        noticed = self.starved()
                    flows = time.monotonic() - last < 0.5
                said = f"the watchdog fires after {noticed - begin:.2f} s" if noticed else "fields flow" if flows else "NOTHING"
                print(f"\n  {name:16} {said}", end=" ", flush=True)
                self.assertTrue(noticed or flows)
            daemon.kill()

    def test_what_takes_long_is_no_stall(self):
        """The machine is busy, and people ask for everything that is not done in a moment."""
        self.bench.twin("idle", truth=False)
        daemon = self.bench.daemon(env=self.env)
        self.bench.subscribe(daemon).collect(60)
        begin = len(self.fed)
        for _ in range(2 * os.cpu_count()):
            self.bench.start("sh", "-c", "while :; do :; done")
        words = [("zero", "--anyway"), ("snapshot", self.bench.folder / "a.png", "--marked"), ("camera", "list"),
                 ("calibrate", "geometry", "noise", "--seconds", "1", "--yes", "--anyway"), ("status",), ("describe",)]
        for ask in words + random.choices(words, k=3):
            asked = time.monotonic()
            code, text = self.bench.ctl("--control", daemon.endpoint["control"], *ask, seconds=60)
            print(f"\n  {ask[0]:10} {time.monotonic() - asked:5.2f} s, exit code {code}", end=" ", flush=True)
            daemon.child.send_signal(signal.SIGHUP)
        pauses = [after - before for before, after in zip(self.fed[begin:], self.fed[begin + 1:])]
        print(f"\n  longest pause {max(pauses):.2f} s of {WATCHDOG_S} s ", end="", flush=True)
        self.assertEqual(daemon.stop(), 0, daemon.output())


if __name__ == "__main__":
    unittest.main()
