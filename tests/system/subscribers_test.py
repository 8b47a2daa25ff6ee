"""Fifty subscribers, of which forty-five read nothing: what the others and the daemon's memory notice of it."""

import os
import time

import numpy as np
import zmq

import rig
import seed
import steady
import zmtp

FROZEN, READING = 45, 5
FRAME_MS = 1000 / 60
TIMES = int(os.environ.get("TRACTION_FREEZES", 5))


class Subscribers(steady.TestCase):
    def latencies_ms(self, seconds):
        """From the daemon's sending to the reading, of all who read; what was read is looked at afterwards."""
        found = []
        poller = zmq.Poller()
        for reader in self.readers:
            poller.register(reader.socket, zmq.POLLIN)
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            for socket, _ in poller.poll(20):
                topic, payload, *_ = socket.recv_multipart()
                found.append((time.monotonic_ns(), topic, payload))
        return [(read_ns - rig.messages.Field.FromString(payload).header.sent_ns) / 1e6
                for read_ns, topic, payload in found if b"/field/" in topic]

    def check(self, pause, most_MiB):
        self.bench.twin("idle", truth=False)
        self.daemon = self.bench.daemon()
        self.readers = [self.bench.subscribe(self.daemon) for _ in range(READING)]
        self.latencies_ms(22)  # until what the start took has been returned
        before_MiB, with_MiB, after_MiB, before_ms, during_ms = self.daemon.memory_MiB(), [], [], [], []
        for _ in range(TIMES):
            before_ms.append(np.quantile(self.latencies_ms(8), 0.99))
            frozen = []
            for _ in range(FROZEN):
                frozen.append(zmtp.Peer(self.daemon.endpoint["stream"], "SUB"))
                frozen[-1].send(zmtp.frame(b"\x01"))  # subscribes to everything, and reads nothing
                self.latencies_ms(pause())
            during_ms.append(np.quantile(self.latencies_ms(8), 0.99))
            with_MiB.append(self.daemon.memory_MiB() - before_MiB)
            for one in frozen:
                one.close()
            self.latencies_ms(12)  # memory is returned every ten seconds
            after_MiB.append(self.daemon.memory_MiB() - before_MiB)
        ratios = sorted(during / before for during, before in zip(during_ms, before_ms))
        print(f"\n  p99 of the others {np.median(before_ms):.2f} -> {np.median(during_ms):.2f} ms, times "
              f"{' '.join(f'{ratio:.2f}' for ratio in ratios)}; memory {before_MiB:.1f} MiB, {max(with_MiB):+.1f} with "
              f"them, {max(after_MiB):+.1f} after them ", end="", flush=True)
        self.assertLess(np.median(during_ms), FRAME_MS, "a field is read before the next one comes")
        self.assertLess(max(with_MiB), most_MiB)
        self.assertLess(max(after_MiB), 4)
        self.assertEqual(self.daemon.stop(), 0, self.daemon.output())

    def test_frozen_at_once(self):
        self.check(lambda: 0.0, 16)

    def test_frozen_one_by_one(self):
        draw = seed.chance(self.id())
        self.check(lambda: draw.uniform(0.2, 0.8), 140)
