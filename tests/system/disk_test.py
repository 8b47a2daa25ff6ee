"""A slow disk stops neither fields nor the watchdog's feed, and a zero comes into force when it has been written."""

import signal
import threading
import time
import unittest

import rig
import seed
import steady
import suite

WATCHDOG_S = 0.8  # WatchdogSec= of the unit
RATE_HZ = 60
DELAYS_S = (0.3, 2.0, 10.0)


class Disk(steady.TestCase):
    def setUp(self):
        self.draw = seed.chance(self.id())
        self.bench = self.enterContext(rig.Rig())
        self.systemd = rig.Systemd(self.bench, WATCHDOG_S)
        self.wish = self.bench.folder / "disk"
        self.takes("0")
        self.gel = self.bench.folder / "gel.toml"
        self.gel.write_text((rig.SOURCE / "config/gels/paper.toml").read_text())

    def takes(self, seconds):
        """Sets how long each call to the disk takes from now on [s]; "hold": until this is called again."""
        new = self.wish.with_suffix(".new")
        new.write_text(str(seconds))
        new.rename(self.wish)

    def daemon(self, **options):
        return self.bench.daemon(f'[sensor]\ngel_file = "{self.gel}"\n', **options,
                                 env=self.systemd.env | {"LD_PRELOAD": rig.BUILD / "tests/support/traction_slow_disk.so",
                                                         "TRACTION_SLOW_DISK": self.wish})

    def ask(self, daemon, *words):
        return self.bench.start(rig.BIN / "tractionctl", "--control", daemon.endpoint["control"], *words)

    def flows(self, fields, zero=None, count=100):
        """Waits for fields and for feeds of the watchdog."""
        fed = len(self.systemd.fed)
        for field in fields.collect(count):
            if zero:
                self.assertEqual(field.header.zero, zero)
        fields.collect(until=lambda _: len(self.systemd.fed) > fed + 3)

    def test_what_waits_for_the_disk_stops_nothing(self):
        self.bench.twin("idle", truth=False)
        daemon = self.daemon()
        self.takes("hold")
        fields = self.bench.subscribe(daemon)
        first = fields.collect(1)[0].header.zero  # the first zero is in force, kept or not
        asking = self.ask(daemon, "zero")
        self.flows(fields, first)
        self.takes("0")
        self.assertEqual(asking.join(), 0, asking.output())
        second = fields.collect(until=lambda field: field.header.zero != first)[-1].header.zero

        self.takes("hold")
        asking = self.ask(daemon, "zero", "--undo")
        self.flows(fields, second)
        self.assertIsNone(asking.child.poll(), asking.output())
        self.takes("0")
        self.assertEqual(asking.join(), 0, asking.output())
        fields.collect(until=lambda field: field.header.zero == first)

        self.takes("hold")
        daemon.child.send_signal(signal.SIGHUP)
        self.systemd.wait_for("RELOADING=1")
        self.flows(fields, first)
        self.takes("0")
        self.systemd.wait_for("READY=1")
        self.takes("hold")
        daemon.child.send_signal(signal.SIGHUP)
        self.systemd.wait_for("RELOADING=1")
        self.assertEqual(daemon.stop(), 0, daemon.output())  # it does not wait for its file
        self.takes("0")
        kept = self.bench.subscribe(self.daemon(state=daemon.state)).collect(1)[0]
        self.assertEqual(kept.header.zero, first)

    @suite.realtime
    def test_figures(self):
        for delay_s in DELAYS_S:
            self.bench = self.enterContext(rig.Rig())
            self.gel = self.bench.folder / "gel.toml"
            self.gel.write_text((rig.SOURCE / "config/gels/paper.toml").read_text())
            with self.subTest(delay_s), self.bench:
                self.figures(delay_s)

    def figures(self, delay_s):
        twin = self.bench.twin("idle", "--rate", str(RATE_HZ), truth=False)
        self.takes("0")
        daemon = self.daemon()
        self.takes(delay_s)
        fields = self.bench.subscribe(daemon)
        fields.collect(1)
        self.measure(fields, f"first zero, {delay_s} s", lambda: len(list(daemon.state.glob("rest.pose"))) == 1)
        for words in (("zero",), ("zero", "--undo"), ("calibrate", "noise", "--seconds", "1", "--yes"),
                      ("calibrate", "finish", "--yes", "--name", "left")):
            asking = self.ask(daemon, *words)
            self.measure(fields, f"{' '.join(words[:2])}, {delay_s} s", lambda: asking.child.poll() is not None)
            self.assertEqual(asking.child.returncode, 0, asking.output())
        daemon.child.send_signal(signal.SIGHUP)
        self.systemd.wait_for("RELOADING=1")
        waiting = threading.Thread(target=self.systemd.wait_for, args=("READY=1",))
        waiting.start()
        self.measure(fields, f"reload, {delay_s} s", lambda: not waiting.is_alive())
        self.takes("0")
        daemon.stop()
        twin.stop()

    def measure(self, fields, what, is_over):
        begin = time.monotonic()
        frames = [fields.collect(1)[0].header.camera_frame_id]
        while not is_over():
            item = fields.receive(1.0)
            if item and item[0] == "field":
                frames.append(item[1].header.camera_frame_id)
        end = time.monotonic()
        gap = max((after - before for before, after in zip(frames, frames[1:])), default=1)
        fed = [begin, *(at for at in self.systemd.fed if begin < at < end), end]
        hungry_s = max(after - before for before, after in zip(fed, fed[1:]))
        print(f"\n  {what + ' a call:':32} {end - begin:5.1f} s, {len(frames)} fields, {gap - 1} frames missing in a row at "
              f"most; longest gap between feeds {hungry_s:.3f} s", end=" ", flush=True)
        self.assertLessEqual(gap, 2)
        self.assertLessEqual(hungry_s, 0.25)


if __name__ == "__main__":
    unittest.main()
