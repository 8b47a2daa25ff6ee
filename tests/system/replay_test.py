"""Recordings with the camera's pictures: the same fields once more."""

import os
import re
import subprocess
import sys
import time

import numpy as np

import replays
import rig
import steady
import seed


class Replay(replays.Replays, steady.TestCase):
    def record(self, *options, config="", seconds=6.0, meanwhile=()):
        """A recording of some seconds, through which the events that are called `meanwhile` are spread."""
        path = self.bench.folder / "live.mcap"
        daemon = self.bench.daemon(config, "--record", path, *options)
        fields = self.bench.subscribe(daemon)
        for event in (*meanwhile, None):
            first = fields.collect(1)[0].header.received_ns
            fields.collect(until=lambda field: field.header.received_ns > first + seconds / (1 + len(meanwhile)) * 1e9)
            if event is not None:
                event(daemon)
        self.assertEqual(daemon.stop(), 0, daemon.output())
        self.assertRegex(daemon.output(), "recorded: .* pictures")
        return path, daemon

    def assert_equal(self, live, again):
        """By frame number, what both have, to the bit; up to where the recorder lost a picture, which the replay flags. What the
        daemon had no time to solve, the replay has: there the daemon's next field has a flag, and the replay's none.
        """
        common, ours, theirs = np.intersect1d(live["frame_number"], again["frame_number"], return_indices=True)
        gap = rig.messages.FLAG_DISCONTINUITY
        lost = np.flatnonzero(again["flags"][theirs] & ~live["flags"][ours] & gap)
        if len(lost):
            common, ours, theirs = common[:lost[0]], ours[:lost[0]], theirs[:lost[0]]
        self.assertGreater(len(common), 10)
        live, again = ({**fields, "flags": fields["flags"] & ~gap} for fields in (live, again))
        for key in live:
            np.testing.assert_array_equal(live[key][ours], again[key][theirs], key)
        return len(common)

    def test_the_same_fields(self):
        """Any touch, and whatever people and a cable do meanwhile."""
        draw = seed.chance(self.id())
        for scenario in draw.sample(("press", "twist", "hold", "two_contacts"), 2):
            with self.subTest(scenario), rig.Rig() as self.bench:
                self.twin = self.bench.twin(scenario, "--rate", "20", truth=False)
                path, daemon = self.record(meanwhile=self.events(scenario, draw))
                print("\n  " + daemon.output().split("recorded: ")[1].splitlines()[0], end=" ", flush=True)
                again, process = self.replay(path)
                print("\n  " + process.lines[-1], end=" ", flush=True)
                count = self.assert_equal(self.arrays(path), self.arrays(again))
                print(f"{count} fields equal", end=" ", flush=True)

    def events(self, scenario, draw):
        """Zeros that are asked for, refused, taken and put back, and a camera that goes and comes."""
        def zero(*words):
            return lambda daemon: self.bench.ctl("zero", *words, "--control", daemon.endpoint["control"])

        def camera(daemon):
            self.twin.kill()
            self.twin = self.bench.twin(scenario, "--rate", "20", truth=False)

        kinds = {"zero": zero(), "zero anyway": zero("--anyway"), "zero undone": zero("--undo"), "camera": camera}
        names = draw.choices(list(kinds), k=4)
        print("\n  " + ", ".join([scenario] + names), end=" ", flush=True)
        return [kinds[name] for name in names]

    def test_what_the_fields_rest_on_is_in_the_recording(self):
        """An influence file and a gel file that have gone since."""
        self.bench.twin("hold", "--rate", "20", truth=False)
        gel, influence = self.bench.folder / "dome.toml", self.bench.folder / "dome.npz"
        gel.write_text((rig.SOURCE / "docs/examples/dome.toml").read_text())
        subprocess.run([sys.executable, rig.SOURCE / "docs/examples/write_influence.py", influence], check=True)
        path, _ = self.record(config=f'[sensor]\ngel_file = "{gel}"\n', seconds=2)
        gel.unlink()
        influence.unlink()
        again, _ = self.replay(path)
        self.assert_equal(self.arrays(path), self.arrays(again))

    def test_fewer_pictures(self):
        """What lies between is missing in the tracker's state, and the replay says so."""
        self.bench.twin("press", "--rate", "20", truth=False)
        path, _ = self.record("--record-hz", "8", seconds=8)
        again, process = self.replay(path)
        self.assertRegex(process.output(), r"pictures are missing in the recording at \d+ places")
        live, again = self.arrays(path), self.arrays(again)
        common, ours, theirs = np.intersect1d(live["frame_number"], again["frame_number"], return_indices=True)
        self.assertGreater(len(common), 10)
        self.assertLess(len(again["frame_number"]), len(live["frame_number"]) / 2)
        deviation = np.sqrt(live["resultant_covariance_N2"].diagonal(axis1=1, axis2=2))[ours]
        worst = (np.abs(again["resultant_N"][theirs] - live["resultant_N"][ours]) / deviation).max()
        print(f"{worst:.2g} deviations", end=" ", flush=True)
        self.assertLess(worst, 1)

    def test_the_pace_and_the_subscribers_of_a_replay(self):
        golden = rig.SOURCE / "tests/golden/press.mcap"
        begin = time.monotonic()
        process = self.bench.start(rig.BIN / "tractiond", "--replay", golden, "--replay-rate", "0.5",
                                   "--state", self.bench.folder / "state", "--runtime", self.bench.folder / "run")
        process.wait_for("replaying .*stream", 120)
        subscriber = rig.Subscriber(self.bench, f"ipc://{self.bench.folder}/run/stream")
        last = subscriber.collect(1, seconds=60)[0]
        self.assertTrue(last.valid)
        self.assertEqual(process.join(60), 0, process.output())
        self.assertGreater(time.monotonic() - begin, 1.0)  # its two pictures are a second apart

    def test_a_disk_that_is_full(self):
        """The recording ends, whole and closed, and says so; the daemon goes on."""
        limit_MB = 64
        self.bench.twin("press", "--rate", "20", truth=False)
        path = self.bench.folder / "full.mcap"
        daemon = self.bench.daemon("", "--record", path,
                                   before=("sh", "-c", f"ulimit -f {limit_MB * 2000}; trap '' XFSZ; exec \"$@\"", "sh"))
        fields = self.bench.subscribe(daemon)
        daemon.wait_for("nothing more is recorded: .*the recording has stopped with", 60)
        fields.collect(20)
        self.assertEqual(daemon.stop(), os.EX_IOERR, daemon.output())
        again, process = self.replay(path)
        recorded = re.search(r"has stopped with (\d+) pictures", daemon.output())[1]
        self.assertIn(f"replayed: {recorded} pictures", process.output())
        self.assert_equal(self.arrays(path), self.arrays(again))

    def test_with_another_gel(self):
        """The zeros are taken again; forces go with the stiffness, as they are in proportion to it."""
        self.twin = self.bench.twin("hold", "--rate", "20", truth=False)
        path, _ = self.record("--record-packed", seconds=3, meanwhile=[
            lambda daemon: self.bench.ctl("zero", "--anyway", "--control", daemon.endpoint["control"])])
        gel = self.bench.folder / "stiffer.toml"
        text = (rig.SOURCE / "config/gels/paper.toml").read_text()
        stiffness = float(re.search(r"(?m)^youngs_modulus_pa = ([0-9.e+]+)", text)[1])
        gel.write_text(re.sub(r"(?m)^youngs_modulus_pa = .*$", f"youngs_modulus_pa = {2 * stiffness}", text))
        config = self.bench.folder / "stiffer-config.toml"
        config.write_text(f'[sensor]\ngel_file = "{gel}"\n')
        twice, _ = self.replay(path, "--config", config, name="twice")
        config.write_text("")
        once, _ = self.replay(path, "--config", config, name="once")
        once, twice = self.arrays(once), self.arrays(twice)
        common, first, second = np.intersect1d(once["frame_number"], twice["frame_number"], return_indices=True)
        self.assertGreater(len(common), 10)
        np.testing.assert_allclose(twice["resultant_N"][second], 2 * once["resultant_N"][first], rtol=1e-3,
                                   atol=1e-3 * np.abs(twice["resultant_N"]).max())

    def test_what_cannot_be_replayed(self):
        """One line that names the file and says what is wrong, with the right exit code."""
        content = (rig.SOURCE / "tests/golden/twist.mcap").read_bytes()
        place = seed.chance(self.id())

        def refused(name, bytes_, code, pattern, *options):
            file = self.bench.folder / f"{name}.mcap"
            file.write_bytes(bytes_)
            _, process = self.replay(file, *options, code=code, name="refused")
            last = process.lines[-1]
            self.assertIn(str(file), last)
            self.assertRegex(last, pattern)
            self.assertNotIn("terminate", process.output())

        refused("empty", b"", os.EX_DATAERR, "is empty")
        refused("text", b"this is no recording at all", os.EX_DATAERR, "is no recording")
        refused("newer", content[:5] + b"1" + content[6:], os.EX_PROTOCOL, "newer version.*;")
        refused("cut", content[:place.randrange(9, len(content) - 1)], os.EX_DATAERR, "not closed|no pictures")
        process = self.bench.start(rig.BIN / "tractiond", "--replay", self.bench.folder / "none.mcap")
        self.assertEqual(process.join(), os.EX_NOINPUT, process.output())
        other = self.bench.folder / "other.toml"
        other.write_text(re.sub(r"(?m)^width_px = .*$", "width_px = 320",
                                (rig.SOURCE / "config/gels/paper.toml").read_text()))
        config = self.bench.folder / "other-config.toml"
        config.write_text(f'[sensor]\ngel_file = "{other}"\n')
        refused("other", content, os.EX_CONFIG, "is of another sensor: its pictures are 640", "--config", config)
        self.bench.twin("idle", truth=False)
        plain = self.bench.folder / "plain.mcap"
        daemon = self.bench.daemon()
        self.bench.subscribe(daemon).collect(1)
        code, out = self.bench.ctl("record", plain, "--seconds", "1", "--connect", daemon.endpoint["stream"])
        self.assertEqual(code, 0, out)
        self.assertEqual(daemon.stop(), 0, daemon.output())
        refused("plain", plain.read_bytes(), os.EX_DATAERR, "has no pictures.*--record")
