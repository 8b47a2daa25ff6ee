"""More connections than the daemon and the gateway may have file descriptors."""

import os
import sys
import time
import unittest

import numpy as np
import zmq

import burner
import rig
import steady

HOARD = rig.SOURCE / "tests/support/hoard.py"
SECONDS = float(os.environ.get("TRACTION_HOARD_SECONDS", "4"))
RESERVED = 128


class Descriptors(steady.TestCase):
    def setUp(self):
        self.bench = self.enterContext(rig.Rig())
        self.bench.twin("idle", "--rate", "60", truth=False)

    @staticmethod
    def follow(subscriber, seconds, victim=None):
        """(p99 of the latency [ms], numbers of the fields, most descriptors of the victim)."""
        while subscriber.socket.poll(0):
            subscriber.socket.recv_multipart()
        found, most, until = [], 0, time.monotonic() + seconds
        while time.monotonic() < until:
            _, field, now = subscriber.receive()
            found.append((now - field.header.sent_ns, field.header.sequence))
            if victim is not None and len(found) % 10 == 0:
                most = max(most, len(os.listdir(f"/proc/{victim.child.pid}/fd")))
        latencies, numbers = np.array(found).T
        return np.quantile(latencies, 0.99) * 1e-6, numbers, most

    def hoard(self, what, victim, limit, endpoints, subscribe, kinds):
        """A subscriber that was there before loses nothing; one that comes afterwards is let in."""
        for kind in kinds:
            honest = subscribe()
            honest.collect(5)
            before_ms = self.follow(honest, SECONDS)[0]
            hoarder = self.bench.start(sys.executable, HOARD, kind, SECONDS, *endpoints)
            hoarder.wait_for("hoarding")
            rig.weigh(hoarder, 19)  # it would come from elsewhere
            with burner.Share(hoarder) as share:
                during_ms, numbers, most = self.follow(honest, 0.9 * SECONDS, victim)
            self.assertEqual(hoarder.join(), 0, hoarder.output())
            lost = int(np.sum(np.diff(numbers) - 1))
            begin = time.monotonic()
            subscribe().collect(1)
            served_s = time.monotonic() - begin
            burnt_ms = rig.beside_burner(self.bench, SECONDS + 1, share.processors, lambda: self.follow(honest, SECONDS)[0])
            times = rig.times(during_ms, before_ms, burnt_ms, share.processors)
            print(f"\n  {what}, {limit} descriptors, {kind}: {hoarder.lines[-1]}; {most} descriptors in use at most; an honest "
                  f"subscriber received {len(numbers)} fields and lost {lost}; a new one is served "
                  f"{served_s:.2f} s after the end; {times} ", end="", flush=True)
            self.assertEqual(lost, 0)
            self.assertLess(most, limit - RESERVED + 16)  # and what the program opens besides
        self.assertEqual(victim.stop(), 0, victim.output())

    def test_daemon(self):
        for limit in (1024, 4096):
            with self.subTest(limit):
                daemon = self.bench.daemon(before=("prlimit", f"--nofile={limit}:{limit}"))
                self.hoard("daemon", daemon, limit, [*daemon.endpoint.values(), "tcp://127.0.0.1:9872", "tcp://127.0.0.1:9873"],
                           lambda daemon=daemon: self.bench.subscribe(daemon, "traction/v1/default/field/"), ("silent", "greeted"))
                self.assertRegex(daemon.output(), r"\d+ connections were refused: \d+ file descriptors are in use")

    def test_gateway(self):
        daemon = self.bench.daemon()
        public, secret = (key.decode() for key in zmq.curve_keypair())
        server = self.bench.allow("ada", public)
        for limit in (1024, 4096):
            with self.subTest(limit):
                # As many peers as there may be: a crowd fills the descriptors before limits.peers ends its connections.
                gateway = self.bench.gateway(daemon, f"[limits]\npeers = {limit - 200}\npeers_per_address = {limit - 200}\n",
                                             before=("prlimit", f"--nofile={limit}:{limit}"))
                self.hoard("gateway", gateway, limit, list(gateway.endpoint.values()), lambda gateway=gateway: self.bench.subscribe(
                    gateway, "traction/v1/default/field/", keys=(server, public, secret)), ("silent",))


if __name__ == "__main__":
    unittest.main()
