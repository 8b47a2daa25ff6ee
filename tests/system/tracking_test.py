"""Markers that move further than their spacing are followed and never swapped."""

import json
import unittest

import numpy as np

import rig


class Tracking(unittest.TestCase):
    def test_large_displacement_swaps_no_marker(self):
        with rig.Rig() as bench:
            twin = bench.twin("large_displacement", "--truth-markers", ready=False)
            daemon = bench.daemon()
            fields = bench.subscribe(daemon).collect(600, "markers")
            self.assertEqual(daemon.stop(), 0, daemon.output())
            self.assertEqual(twin.stop(), 0, twin.output())
            truth = rig.read_truth(twin)
            largest = wrong = valid = total = 0
            for markers in fields:
                true = np.array(truth[markers.header.camera_frame_id]["displacement_px"]).reshape(-1, 2)
                found = np.array(markers.displacement_px).reshape(-1, 2)
                ok = np.frombuffer(markers.marker_valid, np.uint8) == 1
                off = np.linalg.norm(found - true, axis=1)[ok]
                wrong += int((off > 2.0).sum())
                valid += int(ok.sum())
                total += len(ok)
                largest = max(largest, np.linalg.norm(true, axis=1).max())
            print(json.dumps({"frames": len(fields), "largest_px": largest, "swapped": wrong, "valid": valid / total}))
            self.assertGreater(largest, 25)
            self.assertEqual(wrong, 0)
            self.assertGreater(valid / total, 0.98)


if __name__ == "__main__":
    unittest.main()
