"""A thread that hangs, whosever it is: systemd's watchdog fires within a second, or the daemon mends it by itself."""

import os
import random
import signal
import threading
import time
import unittest

import freezer
import rig

WATCHDOG_S = 0.8  # WatchdogSec= of the unit


class Pauses:
    """The longest for which a process that wants a moment now and then is not let run: the machine's, nobody's stall."""

    def __enter__(self):
        self.longest, self.over = 0.0, threading.Event()
        self.thread = threading.Thread(target=self.watch)
        self.thread.start()
        return self

    def watch(self, every=0.02):
        while not self.over.is_set():
            begin = time.monotonic()
            self.over.wait(every)
            self.longest = max(self.longest, time.monotonic() - begin - every)

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()


class Stalls(unittest.TestCase):
    def setUp(self):
        self.bench = self.enterContext(rig.Rig())
        self.systemd = rig.Systemd(self.bench, WATCHDOG_S)

    def starved(self):
        """Since when, if the watchdog would have fired."""
        return self.systemd.fed[-1] + WATCHDOG_S if time.monotonic() > self.systemd.fed[-1] + WATCHDOG_S else None

    def test_every_thread(self):
        self.bench.twin("idle", truth=False)
        names = None
        while names is None or names:
            daemon = self.bench.daemon(env=self.systemd.env)
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
        daemon = self.bench.daemon(env=self.systemd.env)
        self.bench.subscribe(daemon).collect(60)
        begin = len(self.systemd.fed)
        machine = self.enterContext(Pauses())
        for _ in range(2 * os.cpu_count()):
            self.bench.start("sh", "-c", "while :; do :; done")
        words = [("zero", "--anyway"), ("snapshot", self.bench.folder / "a.png", "--marked"), ("camera", "list"),
                 ("calibrate", "geometry", "noise", "--seconds", "1", "--yes", "--anyway"), ("status",), ("describe",)]
        for ask in words + random.choices(words, k=3):
            asked = time.monotonic()
            code, text = self.bench.ctl("--control", daemon.endpoint["control"], *ask, seconds=60)
            print(f"\n  {ask[0]:10} {time.monotonic() - asked:5.2f} s, exit code {code}", end=" ", flush=True)
            self.assertEqual(code, 0, text)
            daemon.child.send_signal(signal.SIGHUP)
        fed = self.systemd.fed[begin:]
        longest = max(after - before for before, after in zip(fed, fed[1:]))
        print(f"\n  longest pause {longest:.2f} s of {WATCHDOG_S} s, of the machine itself {machine.longest:.2f} s ", end="", flush=True)
        self.assertLess(longest, WATCHDOG_S + machine.longest)
        self.assertEqual(daemon.stop(), 0, daemon.output())


if __name__ == "__main__":
    unittest.main()
