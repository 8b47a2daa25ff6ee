"""A camera whose scale differs in x and y, from its rest picture to forces: traction-twin's pictures, the pose that
traction-lens finds in the first of them, and the fields of tractiond with that gel file against the twin's own load."""

import re
import subprocess
import unittest

import numpy as np

import png
import rig

ASPECT = 1.035
SCENARIO = f"""
format = 1
period_s = 40

[camera]
aspect = {ASPECT}
position_mm = [1.3, -0.9, 166.0]
rotation_rad = [0.012, -0.008, 0.01]
k1 = -0.08

[[contacts]]
shape = "hertz"
radius_mm = 4
time_s = [4, 5, 38, 39]
x_mm = 6
y_mm = -5
force_x_n = [0, 0.6, 0.6, 0]
force_y_n = [0, 1.2, 1.2, 0]
force_z_n = [0, 3, 3, 0]
"""
FORCE = (0.6, 1.2, 3.0)
PICTURES, REST = 400, 200  # the whole load from picture 300 on
SETTLED = 320


class Scale(unittest.TestCase):
    def pose(self, bench, scenario, gel):
        """Runs traction-lens pose on the scenario's first picture and a gel file."""
        twin = subprocess.Popen([rig.BIN / "traction-twin", scenario, "--cache", rig.cache_directory(), "--images", "-",
                                 "--format", "RGB8", "--rate", "60"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        levels = np.frombuffer(twin.stdout.read(640 * 480 * 3), np.uint8).reshape(480, 640, 3)
        twin.stdout.close()
        twin.kill()
        twin.wait()
        png.write(bench.folder / "rest.png", levels)
        bench.folder.joinpath("lens.toml").write_text(gel)
        return subprocess.run([rig.BIN / "traction-lens", "pose", "rest.png", "--gel", "lens.toml", "--output", "gel.toml"],
                              cwd=bench.folder, capture_output=True, text=True, timeout=rig.HUNG_S)

    def test_from_the_rest_picture_to_forces(self):
        with rig.Rig() as bench:
            scenario = bench.folder / "scale.toml"
            scenario.write_text(SCENARIO)
            # Without the key it is refused, and the cause and the value to write are named.
            done = self.pose(bench, scenario, "format = 1\n")
            self.assertEqual(done.returncode, 65, done.stdout + done.stderr)
            self.assertIn("scale differs in x and y: along y it is 3.5 % larger than camera.aspect = 1", done.stderr)
            aspect = float(re.search(r"write aspect = ([0-9.]+) ", done.stderr).group(1))
            self.assertAlmostEqual(aspect, ASPECT, delta=1e-3)
            # With it, the pose is found, and the forces are the load's.
            done = self.pose(bench, scenario, f"format = 1\n[camera]\naspect = {aspect}\n")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            film, truth = bench.film(scenario, PICTURES, rest=REST,
                                     config=f'[sensor]\ngel_file = "{bench.folder / "gel.toml"}"\n')
        self.assertAlmostEqual(film.description.camera.aspect, aspect, places=12)
        fields = [field for field in film.fields if field.header.camera_frame_id >= SETTLED]
        self.assertEqual(len(fields), PICTURES + 1 - SETTLED)
        for field in fields:
            self.assertTrue(field.valid)
            self.assertLess(np.abs(np.array(truth[field.header.camera_frame_id]["force_N"]) - FORCE).max(), 1e-6)
        force = np.mean([rig.vector(field.resultant_N) for field in fields], axis=0)
        print(f"force {force} N for {FORCE} N")
        # With the wrong aspect the force along y errs by 3.5 %.
        self.assertLess(np.abs(force - FORCE).max(), 0.02, f"{force}")
        centre = np.mean([(field.centre_of_pressure_m.x, field.centre_of_pressure_m.y) for field in fields], axis=0)
        self.assertLess(np.abs(centre - (0.006, -0.005)).max(), 0.0003, f"{centre}")


if __name__ == "__main__":
    unittest.main()
