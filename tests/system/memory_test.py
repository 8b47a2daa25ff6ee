"""Memory that peers make the daemon and the gateway hold, and what honest peers notice of it meanwhile."""

import os
import sys
import threading
import time
import unittest

import numpy as np
import zmq

import burner
import rig
import steady

HOARD = rig.SOURCE / "tests/support/hoard.py"
SECONDS = float(os.environ.get("TRACTION_HOARD_SECONDS", "4"))
MOST_MiB = 32


class Peak:
    """The largest memory of a process while this is entered."""

    def __init__(self, process):
        self.process, self.MiB, self.over = process, process.memory_MiB(), threading.Event()
        self.thread = threading.Thread(target=self.follow)

    def follow(self):
        while not self.over.wait(0.01):
            self.MiB = max(self.MiB, self.process.memory_MiB())

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()


class Memory(steady.TestCase):
    def setUp(self):
        self.bench = self.enterContext(rig.Rig())
        self.bench.twin("idle", "--rate", "60", truth=False)
        self.daemon = self.bench.daemon()
        self.bench.subscribe(self.daemon).collect(5)

    def follow(self, subscriber, seconds):
        """(p99 of the latency, longest pause between two fields), of a subscriber that loses nothing [ms]."""
        while subscriber.socket.poll(0):
            subscriber.socket.recv_multipart()
        found, until = [], time.monotonic() + seconds
        while time.monotonic() < until:
            _, field, now = subscriber.receive()
            found.append((now, field.header.sent_ns, field.header.sequence))
        reads, sends, numbers = np.array(found).T
        self.assertEqual(list(np.diff(numbers)), [1] * (len(numbers) - 1))
        return np.quantile(reads - sends, 0.99) * 1e-6, np.max(np.diff(reads)) * 1e-6

    def hoard(self, victim, subscriber, what, *words):
        self.follow(subscriber, 1)
        before_MiB, (before_ms, pause_before_ms) = victim.memory_MiB(), self.follow(subscriber, 2 * SECONDS)
        with Peak(victim) as peak:
            hoarder = self.bench.start(sys.executable, HOARD, *words[:1], SECONDS, *words[1:])
            hoarder.wait_for("hoarding")
            rig.weigh(hoarder, 19)  # it would come from elsewhere
            with burner.Share(hoarder) as share:
                during_ms, pause_ms = self.follow(subscriber, 0.9 * SECONDS)
            self.assertEqual(hoarder.join(), 0, hoarder.output())
        self.follow(subscriber, 5)
        after_MiB = victim.memory_MiB()
        burnt_ms, _ = rig.beside_burner(self.bench, SECONDS + 1, share.processors, lambda: self.follow(subscriber, SECONDS))
        times = rig.times(during_ms, before_ms, burnt_ms, share.processors)
        print(f"\n  {what}: {hoarder.lines[-1]}; memory {before_MiB:.1f} MiB, {peak.MiB - before_MiB:+.1f} at most, "
              f"{after_MiB - before_MiB:+.1f} 5 s after; {times}, longest pause "
              f"{pause_before_ms:.0f} -> {pause_ms:.0f} ms ", end="", flush=True)
        self.assertLess(peak.MiB - before_MiB, MOST_MiB)
        self.assertLess(after_MiB - before_MiB, MOST_MiB / 2)
        victim.read()
        return victim.output()

    def test_unfinished_messages(self):
        subscriber = self.bench.subscribe(self.daemon, "traction/v1/default/field/")
        for name, kind in (("control", "DEALER"), ("stream", "SUB"), ("latest", "SUB")):
            for hoarder in ("parts", "thousand"):
                with self.subTest(name, hoarder=hoarder):
                    self.hoard(self.daemon, subscriber, f"{name}, {hoarder}", hoarder, self.daemon.endpoint[name], kind)
        self.assertRegex(self.daemon.output(), r"connections were closed; the last was uid \d+, pid \d+: it ")
        code, text = self.bench.ctl("status", "--control", self.daemon.endpoint["control"])
        self.assertEqual(code, 0, text)
        self.assertEqual(self.daemon.stop(), 0, self.daemon.output())

    def gateway(self, *options):
        """(gateway, keys of an honest peer, keys of another)."""
        pairs = [tuple(key.decode() for key in zmq.curve_keypair()) for _ in range(2)]
        server = [self.bench.allow(name, pair[0], *options) for name, pair in zip(("ada", "eve"), pairs)][0]
        return self.bench.gateway(self.daemon, "high_water_mark = 100\n"), *((server, *pair) for pair in pairs)

    def test_unfinished_messages_with_a_key(self):
        gateway, ada, eve = self.gateway("--control")
        subscriber = self.bench.subscribe(gateway, "traction/v1/default/field/", keys=ada)
        for name, kind in (("control", "DEALER"), ("stream", "SUB"), ("latest", "SUB")):
            with self.subTest(name):
                self.hoard(gateway, subscriber, f"gateway's {name}, parts", "keyed", gateway.endpoint[name], kind, *eve)
        self.assertRegex(gateway.output(), r"connections were closed; the last was 127\.0\.0\.1: it ")
        self.assertEqual(gateway.stop(), 0, gateway.output())

    def test_subscriptions_of_a_key_that_may_read(self):
        gateway, ada, eve = self.gateway()
        subscriber = self.bench.subscribe(gateway, "traction/v1/default/field/", keys=ada)
        for name in ("stream", "latest"):
            with self.subTest(name):
                self.hoard(gateway, subscriber, f"gateway's {name}, subscriptions", "subscriptions", gateway.endpoint[name], *eve)
        self.assertRegex(gateway.output(), r"connections were closed; the last was 127\.0\.0\.1: it ")
        self.assertEqual(gateway.stop(), 0, gateway.output())

    def test_pictures_that_nobody_reads(self):
        local = self.bench.subscribe(self.daemon, "traction/v1/default/field/")
        self.hoard(self.daemon, local, "control, snapshots", "snapshots", self.daemon.endpoint["control"])
        local.socket.close(0)
        gateway, ada, eve = self.gateway("--control")
        subscriber = self.bench.subscribe(gateway, "traction/v1/default/field/", keys=ada)
        self.hoard(gateway, subscriber, "gateway's control, snapshots", "snapshots", gateway.endpoint["control"], *eve)
        self.assertEqual(gateway.stop(), 0, gateway.output())


if __name__ == "__main__":
    unittest.main()
