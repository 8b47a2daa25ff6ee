"""A hand of two fingers, through pictures: the example's controller picks up an egg of which it knows nothing."""

import numpy as np

import hand
import rig


class Hand(rig.TestCase):
    def test_an_egg_is_lifted_held_lightly_and_put_down(self):
        code, said, states, grasps = hand.grasp(self.bench, "egg", opening_mm=60, jerk_m_s2=3)
        self.assertEqual(code, 0, said)
        found = hand.outcome(states, friction=0.5, jerk_m_s2=3)
        self.assertFalse(found["dropped"], said)
        self.assertFalse(found["broken"], said)
        self.assertGreater(found["held_N"], found["least_N"])
        self.assertLess(found["held_N"], 1.3 * found["least_N"])
        self.assertGreater(max(state["clearance_m"] for state in states), 0.035)
        self.assertLess(abs(states[-1]["clearance_m"]), 1e-3)

        # The grasp's intervals contain the truth. How many frames make one says nothing in lockstep, where the cameras' clocks do
        # not run as the host's.
        off = np.array([[*(grasp.force_N - truth[:3]), *(grasp.moment_Nm - truth[3:])] for grasp, truth in grasps])
        deviations = np.array([[*grasp.force_covariance_N2.deviation, *grasp.moment_covariance_N2m2.deviation] for grasp, _ in grasps])
        weights = np.array([truth[2] for _, truth in grasps])
        held = weights < -0.5
        covered = (abs(off[held]) < 1.96 * deviations[held]).mean(axis=0)
        print(f"{held.sum()} of {len(grasps)} grasps hold it: off {np.sqrt((off[held] ** 2).mean(axis=0))}, covered {covered}")
        self.assertGreater(covered.min(), 0.85)
        self.assertAlmostEqual(np.mean([grasp.force_N[2] for grasp, _ in np.array(grasps, object)[held]]), weights[held].mean(), delta=0.02)
