"""Markers that move further than their spacing are followed and never swapped."""

import subprocess
import unittest

import numpy as np

import rig


def follow(scenario, pictures):
    """Holds every marker of every frame against the truth."""
    with rig.Rig() as bench:
        film, truth = bench.film(scenario, pictures, "--truth-markers")
    largest = swapped = valid = total = 0
    for markers in film.markers:
        true = np.array(truth[markers.header.camera_frame_id]["displacement_px"]).reshape(-1, 2)
        found = np.array(markers.displacement_px).reshape(-1, 2)
        ok = np.frombuffer(markers.marker_valid, np.uint8) == 1
        swapped += int((np.linalg.norm(found - true, axis=1)[ok] > 2.0).sum())
        valid += int(ok.sum())
        total += len(ok)
        largest = max(largest, np.linalg.norm(true, axis=1).max())
    return {"frames": len(film.markers), "largest_px": largest, "swapped": swapped, "valid": valid / total}


class Tracking(unittest.TestCase):
    def test_a_film_gives_the_same_fields_each_time(self):
        """Nobody waits for the zero: it takes the first 30 pictures, and no other is missing, however long its judgement takes."""
        runs = []
        for _ in range(3):
            with rig.Rig() as bench:
                film, _ = bench.film("press", 90, rest=None)
            runs.append([(field.header.camera_frame_id, field.header.flags, list(field.force_N)) for field in film.fields])
            self.assertRegex(film.account, "stopped: 90 frames received, 60 published, 30 for the zero, 0 lost")
        self.assertEqual([number for number, _, _ in runs[0]], list(range(31, 91)))
        self.assertEqual(runs[0], runs[1])
        self.assertEqual(runs[0], runs[2])

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

    def test_large_displacement_swaps_no_marker(self):
        result = follow("large_displacement", 900)
        print(result)
        self.assertGreater(result["largest_px"], 25)
        self.assertEqual(result["swapped"], 0)
        self.assertGreater(result["valid"], 0.98)


if __name__ == "__main__":
    unittest.main()
