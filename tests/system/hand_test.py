"""A hand of two fingers, through pictures: the example's controller picks up an egg of which it knows nothing."""

import unittest

import hand
import rig


class Hand(unittest.TestCase):
    def test_an_egg_is_lifted_held_lightly_and_put_down(self):
        bench = self.enterContext(rig.Rig())
        code, said, states = hand.grasp(bench, "egg", opening_mm=60, jerk_m_s2=3)
        self.assertEqual(code, 0, said)
        found = hand.outcome(states, friction=0.5, jerk_m_s2=3)
        self.assertFalse(found["dropped"], said)
        self.assertFalse(found["broken"], said)
        self.assertGreater(found["held_N"], found["least_N"])
        self.assertLess(found["held_N"], 1.3 * found["least_N"])
        self.assertGreater(max(state["clearance_m"] for state in states), 0.035)
        self.assertLess(abs(states[-1]["clearance_m"]), 1e-3)


if __name__ == "__main__":
    unittest.main()
