"""A gel file that is not the gel's, a pose that is far off, and markers that cannot be seen: nothing wrong is published,
and the daemon says what it sees instead."""

import json
import os
import pathlib

import projector
import rig
from PIL import Image

GEL_MISMATCH = 128
# Coarse nodes and closed-form mechanics: no test here needs a force that is true, and factors take little time.
MECHANICS = '[solve]\nmodel = "half-space"\n'
NODES = "[nodes]\ncolumns = 12\nrows = 12\npitch_mm = 6\n"
LAYER = "[[layers]]\ncolour = \"{0}\"\ncolumns = {1}\nrows = {2}\npitch_mm = {3}\ncentre_mm = [{4}, {4}]\ndepth_mm = {5}\n"


def layers(columns=24, rows=24, pitch=3.0, blue=6.0, red=8.0):
    return LAYER.format("blue", columns, rows, pitch, 0, blue) + LAYER.format("red", columns, rows, pitch, 1.5, red)


class Gel(rig.TestCase):
    def daemon(self, config="", scenario="idle", **options):
        """A daemon that sees a scenario's first second, again and again."""
        scene, = projector.scenes(self.bench, scenario, [(0, 1)])
        pictures = projector.Projector(self.bench, scene)
        return self.bench.daemon(pictures.CONFIG + MECHANICS + config, "--images", pictures.pipe, camera=None, **options)

    def with_gel(self, gel, **options):
        path = self.file("gel.toml", "format = 1\n" + gel)
        return self.daemon(f'[sensor]\ngel_file = "{path}"\n', **options)

    def expect_nothing_wrong(self, daemon, subscriber, count=60):
        for field in subscriber.collect(count):
            self.assertTrue(field.header.flags & GEL_MISMATCH)
            self.assertFalse(field.valid)
            self.assertEqual([field.resultant_N.x, field.resultant_N.y, field.resultant_N.z], [0, 0, 0])
            self.assertFalse(any(field.force_N))

    def test_an_adopted_gel_that_does_not_run_is_taken_back(self):
        """Whether a start ends by an exit code, after which the service manager would not start it again, or by a signal."""
        good, adopted = "format = 1\n" + layers() + NODES, '[sensor]\ngel_file = "adopted"\n'
        for name, bad in (("exit code", "format = 9\n"), ("signal", good.replace("= 12", "= 13"))):
            state = self.bench.folder / f"state-{name[0]}"
            state.mkdir(mode=0o700)
            for file, text in (("adopted.toml", bad), ("adopted.toml.earlier", good), ("adopted.toml.starts", "")):
                (state / file).write_text(text)
            if name == "signal":
                for _ in range(2):
                    daemon = self.daemon(adopted, state=state, ready=False)
                    daemon.wait_for("computing its factors")
                    daemon.kill()
            daemon = self.daemon(adopted, state=state)
            said = daemon.wait_for("did not run in two starts.*the one before is in force again")
            self.assertEqual((state / "adopted.toml").read_text(), good)
            self.assertEqual((state / "adopted.toml.refused").read_text(), bad)
            self.assertFalse((state / "adopted.toml.starts").exists())
            self.assertEqual(daemon.stop(), 0)
            print(f"\n  an adopted gel ends each start by {name}: {said}; right: the one before, without a person", end=" ")

    def test_wrong_numbers_in_the_gel_file_are_noticed_before_a_force_is_published(self):
        for name, gel, says in (("number", layers(columns=20, rows=20), r"the file has 20 x 20 blue markers"),
                                ("depth", layers(red=9.6), r"3\.60 mm below"),
                                ("mirrored", layers().replace("[1.5, 1.5]", "[-1.5, 1.5]"), r"mirrored left to right.*ReverseX")):
            with self.subTest(name), rig.Rig() as bench:
                self.bench = bench
                daemon = self.with_gel(gel + NODES)
                fields = bench.subscribe(daemon, "traction/v1/default/field/")
                daemon.wait_for(r"does not fit the picture.*" + says)
                self.expect_nothing_wrong(daemon, fields)
                _, output = self.status_where(daemon, lambda status: status["markers"]["remark"] and status["invalid_why"])
                status = json.loads(output.splitlines()[0])
                markers = status["markers"]
                self.assertRegex(markers["remark"], says)
                self.assertIn("sensor.gel_file", status["invalid_why"])
                self.assertGreater(status["ledger"]["invalid"], 0)
                self.assertTrue(any(finding["contradicts"] for finding in markers["findings"]))
                self.assertEqual(daemon.stop(), 0)

    def test_a_pose_that_is_far_off_is_no_hindrance_and_is_mended_by_a_calibration(self):
        daemon = self.with_gel("[camera]\nposition_mm = [11, -13, 167]\nrotation_rad = [0.05, -0.05, 0.05]\n" + NODES)
        fields = self.bench.subscribe(daemon, "traction/v1/default/field/")
        daemon.wait_for(r"the camera's pose in the file is off by 19\.\d mm .* and \d\.\d\d°.*tractionctl calibrate")
        self.expect_nothing_wrong(daemon, fields, 20)
        code, output = self.ctl(daemon, "calibrate", "geometry", "--yes", "--json")
        self.assertEqual(code, 0, output)
        code, output = self.ctl(daemon, "calibrate", "finish", "--json")
        self.assertEqual(code, 0, output)
        path = pathlib.Path(json.loads(output.splitlines()[-1])["path"])
        self.assertEqual(daemon.stop(), 0)
        mended = self.daemon(f'[sensor]\ngel_file = "{path}"\n', state=self.bench.folder / "mended")
        for field in self.bench.subscribe(mended, "traction/v1/default/field/").collect(20):
            self.assertFalse(field.header.flags & GEL_MISMATCH)
            self.assertTrue(field.valid)

    def test_why_markers_are_not_found(self):
        for optics, says in (("contrast_levels = 8\nbackground_levels = 2\n", r"the picture is dark"),
                             ("contrast_levels = 255\nbackground_levels = 255\n", r"saturated")):
            with self.subTest(says), rig.Rig() as bench:
                self.bench = bench
                daemon = self.daemon(scenario=self.file("light.toml", "format = 1\n[optics]\n" + optics))
                daemon.wait_for(r"too few markers are found: blue: 0 of 576 markers, red: 0 of 576 markers; .*" + says)
                code, output = self.ctl(daemon, "status")
                self.assertRegex(output, r"markers +blue 0 of 576 \(0 in the zero\), red 0 of 576")
                picture = bench.folder / "dark.png"
                code, output = self.ctl(daemon, "snapshot", str(picture), "--marked")
                self.assertEqual(code, 0, output)
                with Image.open(picture) as image:
                    self.assertEqual((image.size, image.mode), ((640, 480), "RGB"))

    def test_a_source_that_repeats_its_last_picture_measures_nothing(self):
        scene, = projector.scenes(self.bench, "idle", [(0, 1)])
        pictures = projector.Projector(self.bench, scene)
        daemon = self.bench.daemon(pictures.CONFIG + MECHANICS, "--images", pictures.pipe, camera=None)
        fields = self.bench.subscribe(daemon, "traction/v1/default/field/")
        fields.collect(1)
        pictures.show(scene[:1])
        daemon.wait_for("warning: camera images: it sends one picture again and again")
        # In a status that tells it, a second without a field has passed.
        code, output = self.status_where(daemon, lambda status: status["ledger"]["repeated"] and status["rates"]["published_hz"] == 0)
        self.assertEqual(code, os.EX_NOINPUT, output)
        self.assertIn("the camera sends nothing new: it sends one picture again and again", output)
        ledger = json.loads(output.splitlines()[0])["ledger"]
        self.assertGreater(ledger["repeated"], 0)
        code, output = self.status_where(daemon, lambda status: status["ledger"]["repeated"] > ledger["repeated"] + 60)
        more = json.loads(output.splitlines()[0])["ledger"]["published"] - ledger["published"]
        print(f"\n  a program repeats its last picture: {more} fields of {ledger['repeated']} repeated pictures and all that follow, and the "
              "status says why; right: 0", end=" ", flush=True)
        self.assertEqual(more, 0)
        pictures.show(scene)
        self.status_where(daemon, lambda status: not status["camera_why"] and status["ledger"]["published"] > ledger["published"])
        self.assertEqual(daemon.stop(), 0, daemon.output())

    def test_a_snapshot_shows_the_picture_and_what_was_found_in_it(self):
        daemon = self.daemon()
        # The pictures of a film wait until the first zero's solver is made.
        self.bench.subscribe(daemon, "traction/v1/default/field/").collect(1)
        plain, marked = self.bench.folder / "plain.png", self.bench.folder / "marked.png"
        code, output = self.ctl(daemon, "snapshot", str(plain))
        self.assertEqual(code, 0, output)
        self.assertRegex(output, r"640 x 480 pixels of RGB8, frame \d+; of 1152 markers 11\d\d found")
        code, output = self.ctl(daemon, "snapshot", str(marked), "--marked")
        self.assertEqual(code, 0, output)
        rings = [sum(pixel == (90, 220, 255) for pixel in Image.open(path).getdata()) for path in (plain, marked)]  # of blue markers
        self.assertEqual(rings[0], 0)
        self.assertGreater(rings[1], 1000)
        code, output = self.ctl(daemon, "snapshot", "/nowhere/picture.png")
        self.assertNotEqual(code, 0)
        self.assertIn("/nowhere/picture.png", output)
