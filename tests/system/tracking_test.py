"""A film of pictures is measured to its end."""

import subprocess
import unittest

import rig


class Tracking(unittest.TestCase):
    def test_a_film_that_ends_before_the_verdict_is_measured_to_its_end(self):
        """Its last pictures wait for the zero and its solver, as all others do."""
        pictures = 36
        with rig.Rig() as bench:
            file = bench.folder / "pictures"
            with subprocess.Popen([rig.BIN / "traction-twin", "idle", "--cache", rig.cache_directory(), "--images", "-"],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as twin:
                file.write_bytes(twin.stdout.read(pictures * 640 * 480 * 3))
                twin.kill()
            daemon = bench.daemon('[camera]\nwidth_px = 640\nheight_px = 480\npixel_format = "RGB8"\n', "--images", file,
                                  camera=None, ready=False)
            self.assertEqual(daemon.join(), 0, daemon.output())
        self.assertIn("the model takes the places of 1152 markers from the zero", daemon.output())
        self.assertIn("stopped: 36 frames received, 6 published, 30 for the zero, 0 lost", daemon.output())

if __name__ == "__main__":
    unittest.main()
