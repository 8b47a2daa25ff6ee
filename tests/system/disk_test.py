"""A slow disk stops neither fields nor the watchdog's feed, and a zero comes into force when it has been written."""

import signal

import rig
import steady

WATCHDOG_S = 0.8  # WatchdogSec= of the unit


class Disk(steady.TestCase):
    def setUp(self):
        super().setUp()
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
