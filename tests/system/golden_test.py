"""The tree's recordings: whatever the machine and the build, their pictures give their fields again."""

import numpy as np

import replays
import rig
import suite

SCENARIOS = sorted(path for path in (rig.SOURCE / "twin/scenarios").glob("*.toml")
                   if "[gripper]" not in path.read_text()  # two cameras, and what they see depends on a controller
                   and "gel_file" not in path.read_text())  # its influence takes minutes, and more space than the pictures


# The others are as one of these, or as a film of forces_test.
FEW = {"calibrate", "large_displacement", "twist", "two_contacts"}


class Golden(replays.Replays, rig.TestCase):
    def test_a_few_scenarios_give_their_fields(self):
        self.check(path for path in SCENARIOS if path.stem in FEW)

    @suite.minutes
    def test_the_other_scenarios_give_their_fields(self):
        self.check(path for path in SCENARIOS if path.stem not in FEW)

    def check(self, scenarios):
        """Within a hundredth of their deviation, and that within a hundredth of itself. tests/golden/make.py makes those that are missing."""
        for scenario in scenarios:
            with self.subTest(scenario.stem):
                path = rig.SOURCE / "tests/golden" / f"{scenario.stem}.mcap"
                again, _ = self.replay(path)
                expected, found = self.arrays(path), self.arrays(again)
                np.testing.assert_array_equal(found["frame_number"], expected["frame_number"])
                fits = scenario.stem != "calibrate"  # whose gel is not what the daemon is told
                np.testing.assert_array_equal(expected["valid"], fits)
                for key in ("valid", "flags"):
                    np.testing.assert_array_equal(found[key], expected[key])
                ok = expected["valid"]
                stated = [np.concatenate([np.sqrt(arrays[f"{name}_covariance_{unit}"].diagonal(axis1=1, axis2=2)[ok])
                                          for name, unit in (("resultant", "N2"), ("moment", "N2m2"))])
                          for arrays in (found, expected)]
                np.testing.assert_allclose(*stated, rtol=0.01)
                np.testing.assert_allclose(found["node_deviation_N"], expected["node_deviation_N"], rtol=0.01, atol=1e-9)
                deviation = stated[1][:ok.sum()]
                worst = (np.abs(found["resultant_N"] - expected["resultant_N"])[ok] / deviation).max(initial=0)
                self.assertLess(worst, 0.01)
                felt = expected["node_deviation_N"] > 0
                nodes = np.abs(found["force_N"] - expected["force_N"])[felt] / expected["node_deviation_N"][felt]
                self.assertLess(nodes.max(initial=0), 0.01)
                force = np.linalg.norm(expected["resultant_N"], axis=1)
                if fits and "[[contacts]]" in scenario.read_text():
                    self.assertGreater(force.min(), 0.5)
                else:
                    self.assertLess(force.max(), 0.1)
                print(f"\n  {scenario.stem:20} {len(force)} fields, {force.mean():.2f} N: off by {worst:.1e}, nodes by "
                      f"{nodes.max(initial=0):.1e} deviations", end=" ", flush=True)

    def test_a_recording_of_an_earlier_version(self):
        """Of a daemon that solved by a contact step: its configuration has keys that are no more, its fields are near."""
        path = rig.SOURCE / "tests/golden/earlier/press.mcap"
        again, process = self.replay(path)
        self.assertIn("which computed with other numbers", process.output())
        expected, found = self.arrays(path), self.arrays(again)
        common, before, now = np.intersect1d(expected["frame_number"], found["frame_number"], return_indices=True)
        self.assertGreater(len(common), 0)
        self.assertTrue(found["valid"][now].all())
        off = np.linalg.norm(found["resultant_N"][now] - expected["resultant_N"][before], axis=1)
        force = np.linalg.norm(expected["resultant_N"][before], axis=1)
        self.assertGreater(force.min(), 0.5)
        print(f"\n  {len(common)} fields, {force.mean():.2f} N: {100 * (off / force).max():.2f} % off", end=" ", flush=True)
        self.assertLess((off / force).max(), 0.02)
