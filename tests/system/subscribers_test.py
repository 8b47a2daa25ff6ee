"""Fifty subscribers, of which forty-five read nothing: what the others and the daemon's memory notice of it."""

import random
import socket
import time
import unittest

import numpy as np
import zmq

import rig

FROZEN, READING = 45, 5


class Frozen:
    """Connects and subscribes by ZMTP 3.0, and reads no more."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(10)
        self.socket.connect(path)
        self.socket.sendall(b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32))
        self.read(64)
        ready = b"\x05READY\x0bSocket-Type" + (3).to_bytes(4, "big") + b"SUB"
        self.socket.sendall(b"\x04" + bytes([len(ready)]) + ready)
        self.read(self.read(2)[1])
        self.socket.sendall(b"\x00\x01\x01")  # to everything

    def read(self, count):
        data = b""
        while len(data) < count:
            data += self.socket.recv(count - len(data))
        return data

    def close(self):
        self.socket.close()


class Subscribers(unittest.TestCase):
    def latencies_ms(self, seconds):
        """From the daemon's sending to the reading, of all who read."""
        found = []
        poller = zmq.Poller()
        for reader in self.readers:
            poller.register(reader.socket, zmq.POLLIN)
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            ready = dict(poller.poll(20))
            for reader in self.readers:
                item = reader.receive(0.02) if reader.socket in ready else None
                if item is not None and item[0] == "field":
                    found.append((time.monotonic_ns() - item[1].header.sent_ns) / 1e6)
        return found

    def check(self, pause):
        with rig.Rig() as bench:
            bench.twin("idle", truth=False)
            self.daemon = bench.daemon()
            self.readers = [bench.subscribe(self.daemon) for _ in range(READING)]
            self.latencies_ms(3)
            before_ms, before_MiB = self.latencies_ms(8), self.daemon.memory_MiB()
            path = self.daemon.endpoint["stream"].removeprefix("ipc://")
            frozen = []
            for _ in range(FROZEN):
                frozen.append(Frozen(path))
                self.latencies_ms(pause())
            during_ms, during_MiB = self.latencies_ms(15), self.daemon.memory_MiB()
            for one in frozen:
                one.close()
            self.latencies_ms(3)
            after_MiB = self.daemon.memory_MiB()
            print(f"\n  p99 of the others {np.quantile(before_ms, 0.99):.2f} -> {np.quantile(during_ms, 0.99):.2f} ms; memory "
                  f"{before_MiB:.1f} MiB, {during_MiB - before_MiB:+.1f} with them, {after_MiB - before_MiB:+.1f} after them ",
                  end="", flush=True)
            self.assertLess(during_MiB - before_MiB, 16)
            self.assertLess(after_MiB - before_MiB, 4)
            self.assertEqual(self.daemon.stop(), 0, self.daemon.output())

    def test_frozen_at_once(self):
        self.check(lambda: 0.0)

    def test_frozen_one_by_one(self):
        self.check(lambda: random.uniform(0.2, 0.8))


if __name__ == "__main__":
    unittest.main()
