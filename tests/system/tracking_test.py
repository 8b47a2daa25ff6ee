"""Markers that move further than their spacing are followed and never swapped."""

import unittest

import numpy as np

import rig
import steady


def follow(scenario, frames):
    """Runs twin and daemon and holds every marker of every frame against the truth."""
    with rig.Rig() as bench:
        twin = bench.twin(scenario, "--truth-markers", ready=False)
        daemon = bench.daemon()
        fields = bench.subscribe(daemon).collect(frames, "markers")
        codes = daemon.stop(), twin.stop()
        if codes != (0, 0):
            raise AssertionError(f"exit codes {codes}:\n" + daemon.output() + "\n" + twin.output())
        truth = rig.read_truth(twin)
    largest = swapped = valid = total = 0
    for markers in fields:
        true = np.array(truth[markers.header.camera_frame_id]["displacement_px"]).reshape(-1, 2)
        found = np.array(markers.displacement_px).reshape(-1, 2)
        ok = np.frombuffer(markers.marker_valid, np.uint8) == 1
        swapped += int((np.linalg.norm(found - true, axis=1)[ok] > 2.0).sum())
        valid += int(ok.sum())
        total += len(ok)
        largest = max(largest, np.linalg.norm(true, axis=1).max())
    return {"frames": len(fields), "largest_px": largest, "swapped": swapped, "valid": valid / total}


class Tracking(steady.TestCase):
    def test_large_displacement_swaps_no_marker(self):
        result = follow("large_displacement", 600)
        print(result)
        self.assertGreater(result["largest_px"], 25)
        self.assertEqual(result["swapped"], 0)
        self.assertGreater(result["valid"], 0.98)


if __name__ == "__main__":
    unittest.main()
