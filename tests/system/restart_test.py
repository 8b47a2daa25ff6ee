"""A restart while something presses must not zero the load."""

import signal
import time
import unittest

import numpy as np

import rig
import seed
import steady

NOT_SOLVED = 512  # FLAG_NOT_SOLVED


class Restart(steady.TestCase):
    def test_killed_under_load_still_reads_the_load(self):
        with rig.Rig() as bench:
            twin = bench.twin("hold", ready=False)
            first = bench.daemon()
            before = bench.subscribe(first).collect(until=lambda field: field.resultant_N.z > 3.8)
            first.stop(signal.SIGKILL)
            second = bench.daemon(state=first.state)
            after = bench.subscribe(second).collect(20)
            self.assertEqual(second.stop(), 0, second.output())
            self.assertEqual(twin.stop(), 0, twin.output())
            truth = rig.read_truth(twin)
            self.assertEqual(before[-1].header.zero, after[-1].header.zero)
            self.assertNotEqual(before[-1].header.boot, after[-1].header.boot)
            self.assertTrue(after[-1].valid)
            for field in after:
                if field.header.flags & NOT_SOLVED:  # no model of an earlier frame yet, and this machine was too slow
                    self.assertFalse(field.valid)
                    continue
                true = np.array(truth[field.header.camera_frame_id]["force_N"])
                self.assertGreater(true[2], 3.8)
                self.assertLess(abs(field.resultant_N.z - true[2]), 0.4)
                self.assertTrue(field.header.flags & 1, "nothing has shown yet that the zero still holds")

    def test_killed_at_any_moment_the_first_try_has_frames(self):
        draw = seed.chance(self.id())
        with rig.Rig() as bench:
            bench.twin("idle")
            daemon = bench.daemon()
            waits = []
            for _ in range(6):
                bench.subscribe(daemon).collect(draw.randrange(1, 90))
                daemon.stop(signal.SIGKILL)
                killed = time.monotonic()
                time.sleep(draw.uniform(0.0, 3.2))  # also when the camera has just forgotten, or is about to
                daemon = bench.daemon(state=daemon.state)
                bench.subscribe(daemon).collect(1)
                waits.append(time.monotonic() - killed)
                self.assertNotIn("no frame seen yet", daemon.output())
            print("\n  killed: first field after", " ".join(f"{wait:.1f}" for wait in sorted(waits)), "s", end="")


if __name__ == "__main__":
    unittest.main()
