"""A camera that is aimed before there is a gel file: pictures can be seen and the camera be set, and it is said that nothing
is measured."""

import json
import re

import projector
import rig
from PIL import Image
from deadline import HUNG_S

USAGE, NO_FIELD, REFUSED, CONFIG = 64, 66, 75, 78
WHY = "no gel: nothing is measured; set sensor.gel_file"
NO_GEL = '[sensor]\ngel_file = "none"\n'
WIDTH, HEIGHT = 333, 217  # unlike the paper's gel's
PICTURE = bytes((7 * x + 3 * y) % 256 for y in range(HEIGHT) for x in range(WIDTH))


class NoGel(rig.TestCase):
    def expect_the_words(self, daemon):
        """Status, zero and calibration say that there is no gel."""
        code, output = self.status_where(daemon, lambda status: status["ledger"]["no_gel"] > 0)
        self.assertEqual(code, NO_FIELD, output)
        line, error = output.splitlines()
        status = json.loads(line)
        self.assertEqual(status["markers"]["remark"], WHY)
        self.assertEqual(status["markers"]["layers"], [])
        self.assertEqual(error, "tractionctl: no field can come: " + WHY)
        self.assertEqual(status["ledger"]["published"], 0)
        self.assertRegex(self.ctl(daemon, "status")[1], rf"\d+ not measured, as there is no gel\n(.*\n)*markers +{WHY}\n")
        for words in (("zero",), ("zero", "--undo"), ("calibrate", "noise", "--yes"), ("calibrate", "finish", "--yes")):
            code, output = self.ctl(daemon, *words)
            self.assertEqual(code, REFUSED, output)
            self.assertRegex(output, "there is no gel, so there is no.*sensor.gel_file")

    def expect_a_snapshot(self, daemon, width, height):
        file = self.bench.folder / "seen.png"
        code, output = self.ctl(daemon, "snapshot", file)
        self.assertEqual(code, 0, output)
        self.assertRegex(output, f"{width} x {height} pixels of Mono8, frame [0-9]+; no gel: no markers are sought")
        with Image.open(file) as image:
            self.assertEqual((image.size, image.mode), ((width, height), "L"))
            return image.tobytes()

    def expect_a_balanced_end(self, daemon):
        self.assertEqual(daemon.stop(), 0, daemon.output())
        line = daemon.wait_for("stopped: ")
        received, shown, lost = map(int, re.search(
            r"stopped: (\d+) frames received, (\d+) not measured as there is no gel, (\d+) lost", line).groups())
        self.assertEqual(received, shown + lost)
        return lost

    def with_pictures(self, *options, **more):
        pictures = projector.Projector(self.bench, [PICTURE])
        camera = f'[camera]\nwidth_px = {WIDTH}\nheight_px = {HEIGHT}\npixel_format = "Mono8"\nstills = true\n'
        return self.bench.daemon(NO_GEL + camera, "--images", pictures.pipe, *options, camera=None, **more)

    def test_pictures_of_any_size_are_seen_and_each_frame_is_accounted_for(self):
        daemon = self.with_pictures()
        daemon.wait_for("warning: " + WHY)
        stream = self.bench.subscribe(daemon)
        previews = self.bench.subscribe(daemon, "traction/v1/default/preview/")
        self.expect_the_words(daemon)
        self.assertEqual(self.expect_a_snapshot(daemon, WIDTH, HEIGHT), PICTURE)
        code, output = self.ctl(daemon, "snapshot", "--marked", self.bench.folder / "marked.png")
        self.assertEqual((code, output.partition("; ")[2]), (0, "no gel: there is nothing to mark"))
        preview = previews.collect(1, "preview")[0]
        self.assertEqual((preview.width, preview.height, preview.scale), (WIDTH // 2, HEIGHT // 2, 2))
        description = json.loads(self.ctl(daemon, "describe")[1])
        self.assertIsNone(description["gel"])
        self.assertEqual((description["camera"]["width_px"], description["camera"]["height_px"]), (WIDTH, HEIGHT))

        kinds, statuses = set(), []
        while len(statuses) < 2:
            kind, message, _ = stream.receive(HUNG_S)
            kinds.add(kind)
            statuses += [message] * (kind == "status")
        self.assertLessEqual(kinds, {"status", "description", "preview"})  # no field, no markers
        ledger = statuses[-1].ledger
        self.assertEqual(ledger.received, ledger.in_flight + sum(getattr(ledger, loss) for loss in rig.LOSSES))
        self.assertGreater(ledger.no_gel, 0)
        self.assertEqual(self.expect_a_balanced_end(daemon), 0)  # of a film each picture counts

    def test_a_monochrome_camera_is_seen_and_set(self):
        scenario = self.bench.folder / "small.toml"
        scenario.write_text('format = 1\n[camera]\nwidth_px = 400\nheight_px = 300\nprincipal_px = [200, 150]\n'
                            '[stream]\npixel_format = "Mono8"\n')
        self.bench.twin(scenario)
        refused = self.bench.daemon(instance="refused", ready=False)
        self.assertEqual(refused.join(), CONFIG, refused.output())
        self.assertIn('to aim a camera before there is a gel file, set sensor.gel_file = "none"', refused.output())

        daemon = self.bench.daemon(NO_GEL)
        self.expect_the_words(daemon)
        self.assertEqual(len(self.expect_a_snapshot(daemon, 400, 300)), 400 * 300)
        code, output = self.ctl(daemon, "camera", "get", "Width")
        self.assertEqual(code, 0, output)
        self.assertRegex(output, r"Width.*\b400\b")
        code, output = self.ctl(daemon, "camera", "set", "ExposureTimeAbs=3000")
        self.assertEqual(code, 0, output)
        code, output = self.bench.ctl("top", "--once", daemon.endpoint["stream"])
        self.assertEqual(output.count(WHY), 1, output)
        self.expect_a_balanced_end(daemon)

    def test_the_configuration_is_accepted_and_a_recording_with_pictures_is_not(self):
        file = self.bench.folder / "none.toml"
        file.write_text(NO_GEL)
        check = self.bench.start(rig.BIN / "tractiond", "--config", file, "--check-config")
        self.assertEqual(check.join(), 0, check.output())
        recording = self.with_pictures("--record", self.bench.folder / "pictures.mcap", ready=False)
        self.assertEqual(recording.join(), USAGE, recording.output())
        self.assertRegex(recording.output(), "--record .* there is no gel; name a gel file in sensor.gel_file")
        self.assertFalse((self.bench.folder / "pictures.mcap").exists())
