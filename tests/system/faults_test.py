"""What a network and its inhabitants do to a stream: counted, never published, and the stream goes on."""

import os
import sys
import time

import numpy as np

import rig
import steady

SUPPORT = rig.SOURCE / "tests/support"


class Faults(steady.TestCase):
    def setUp(self):
        super().setUp()
        self.published = []

    def begin(self, *options):
        self.twin = self.bench.twin("idle", *options, ready=False)
        # The address sanitizer keeps what is freed, up to 256 MB without this: its memory would tell nothing.
        self.daemon = self.bench.daemon(env={"ASAN_OPTIONS": "quarantine_size_mb=8"})
        self.subscriber = self.bench.subscribe(self.daemon)
        self.stream(30)

    def stream(self, count):
        self.published += self.subscriber.collect(count)

    def status(self):
        """It is put together once a second: the first that comes may know nothing of what has just been done."""
        return self.subscriber.collect(2, "status")[1]

    def ledger(self):
        return self.status().ledger

    def refused(self, least=0):
        """The daemon looks once a second, where it has the time: until there are so many."""
        deadline = time.monotonic() + 20 * rig.PATIENCE
        while (count := self.status().camera_link.packets_refused) < least and time.monotonic() < deadline:
            pass
        return count

    def end(self):
        """Every published frame is one that the camera sent, newer than the one before, and reads what it shows."""
        self.assertEqual(self.daemon.stop(), 0, self.daemon.output())
        self.assertEqual(self.twin.stop(), 0, self.twin.output())
        truth = rig.read_truth(self.twin)
        numbers = [field.header.frame_number for field in self.published]
        self.assertEqual(numbers, sorted(set(numbers)))
        times = [field.header.device_time_ns for field in self.published]
        self.assertEqual(times, sorted(set(times)))
        for field in self.published:
            record = truth.get(field.header.camera_frame_id)
            self.assertIsNotNone(record, "a frame was published that the camera never sent")
            self.assertEqual(record["device_ns"], field.header.device_time_ns)
            self.assertLess(np.linalg.norm(rig.vector(field.resultant_N)), 0.6)

    def test_lost_packets(self):
        self.begin("--lost-ratio", "0.002")
        self.stream(200)
        ledger = self.ledger()
        self.assertGreater(ledger.incomplete, 10)
        self.end()

    def test_any_datagrams_from_another_address(self):
        """20,000 a second: nothing is invented, and the process stays as it is."""
        self.begin()
        seed_number, seconds = self.draw.randrange(1 << 32), float(os.environ.get("TRACTION_DATAGRAM_SECONDS", 60))
        without = self.lost_within(seconds)
        refused, memory_MiB = self.refused(), self.daemon.memory_MiB()
        sender = self.bench.start(sys.executable, SUPPORT / "datagrams.py", seed_number, 20_000, seconds, "127.0.0.2",
                                  *rig.udp_ports(self.daemon))
        self.addCleanup(sender.kill)
        sender.wait_for("sending")
        rig.weigh(sender, 10)  # it would come from elsewhere
        lost = self.lost_within(seconds)
        self.assertEqual(sender.join(60), 0, sender.output())
        sent, changed = map(int, sender.lines[-1].split())
        refused, grown_MiB = self.refused(refused + sent // 4 + 1) - refused, self.daemon.memory_MiB() - memory_MiB
        print(f"\n  {sent} datagrams in {seconds:.0f} s, {changed} of them changed at random, {refused} refused; "
              f"lost without them {without}, with them {lost}; memory {grown_MiB:+.1f} MiB", end=" ", flush=True)
        self.assertGreater(refused, sent // 4)  # what went to the stream's port and to that of the questions
        # Of the others a machine may be guilty that is too slow for both.
        self.assertFalse({"wrong_size", "wrong_format", "stale", "implausible", "doubted"} & lost.keys())
        self.assertLess(grown_MiB, 16)
        self.end()

    def lost_within(self, seconds):
        """Fields, and by cause the frames that are none; cameras."""
        before, begin, fields = self.ledger(), time.monotonic(), len(self.published)
        while time.monotonic() < begin + seconds:
            self.stream(10)
        fields, after = len(self.published) - fields, self.ledger()
        lost = {loss: getattr(after, loss) - getattr(before, loss) for loss in rig.LOSSES + ("missing", "doubted", "reconnects")}
        return {"of": fields} | {loss: count for loss, count in lost.items() if count}

    def test_the_camera_dies_and_returns(self):
        self.begin()
        begin = time.monotonic()
        self.twin.kill()
        self.daemon.wait_for("is lost: it does not answer")
        noticed = time.monotonic() - begin
        noticed_ns = time.monotonic_ns()
        first = rig.read_truth(self.twin)
        old = self.published
        self.assertTrue(all(field.header.camera_frame_id in first for field in old[:-3]))
        self.twin = self.bench.twin("idle")
        begin = time.monotonic()
        self.published = self.subscriber.collect(until=lambda field: field.header.received_ns > noticed_ns)[-1:]
        print(f"\n  noticed after {noticed:.2f} s, first field {time.monotonic() - begin:.2f} s after it was back")
        self.stream(59)
        self.assertTrue(self.published[0].header.flags & 4, "the first frame after a gap says so")
        self.assertGreater(self.published[0].header.frame_number, old[-1].header.frame_number)
        self.assertGreaterEqual(self.ledger().reconnects, 1)
        self.end()
