"""Calibration of a sensor whose stiffness, pose and lens are not what its gel file says."""

import json

import numpy as np

import independent
import projector
import rig
import suite

DONE, TEMPORARY = 0, 75
# twin/scenarios/calibrate.toml
HIDDEN = {"youngs_modulus_pa": 200e3, "focal_px": 961.2, "k1": -0.08, "k2": 0.02, "position_x_mm": 1.2,
          "position_y_mm": -0.8, "position_z_mm": 158.1, "rotation_x_rad": 0.006, "rotation_y_rad": -0.009,
          "rotation_z_rad": 0.012}
GEL = """format = 1
period_s = 1000
[gel]
youngs_modulus_pa = 200000
[camera]
focal_px = 961.2
k1 = -0.08
k2 = 0.02
position_mm = [1.2, -0.8, 158.1]
rotation_rad = [0.006, -0.009, 0.012]
"""
# What the daemon is told at first. Coarser nodes, so that the factors take little time; the calibration has none.
NOMINAL = """format = 1
[nodes]
columns = 20
rows = 20
pitch_mm = 3.6
"""


class TestCase(rig.TestCase):
    def calibrate(self, daemon, *words):
        """The steps' reports by name; weights in a list."""
        code, output = self.ctl(daemon, "calibrate", "--yes", "--json", *words)
        self.assertEqual(code, DONE, output)
        reports = {"weight": []}
        for report in map(json.loads, output.splitlines()):
            if report["step"] == "weight":
                reports["weight"].append(report)
            else:
                reports[report["step"]] = report
        return reports

    def check_found(self, reports):
        """What geometry, noise and stiffness say, against what the gel was made with."""
        figures = {**reports["geometry"]["figures"], **reports["stiffness"]["figures"]}
        print()
        for name, hidden in HIDDEN.items():
            found = figures[name]
            print(f"  {name:18} hidden {hidden:<10g} found {found['value']:.7g} +- {found['deviation']:.2g}")
            self.assertLess(abs(found["value"] - hidden), 4 * found["deviation"] + 1e-3 * abs(hidden), name)
        error = figures["youngs_modulus_pa"]["value"] / HIDDEN["youngs_modulus_pa"] - 1
        print(f"  error of E {100 * error:+.3f} %, residual {figures['residual_px']['value']:.4f} px")
        self.assertLess(abs(error), 0.01)
        self.assertLess(figures["residual_px"]["value"], 0.006)
        self.assertLess(figures["linearity"]["value"], 0.01)
        noise = reports["noise"]["figures"]
        self.assertAlmostEqual(noise["noise_over_promised"]["value"], 1, delta=0.1)
        self.assertLess(noise["shift_px"]["value"], 0.005)

    def check_newtons(self, fields):
        """The last second's, of 3 N that press and 0.6 N that shear."""
        force = np.mean([rig.vector(field.resultant_N) for field in fields[-15:]], axis=0)
        print(f"  then 0.6 N, 3 N read as {force[0]:.3f} N, {force[2]:.3f} N")
        self.assertLess(np.abs(force - (0.6, 0, 3)).max(), 0.06)


class Projected(TestCase):
    """At any speed: each scene is shown for as long as its step takes. A zero is averaged over 30 pictures, and so many are
    shown in a loop: whichever it takes, they are the same."""

    def daemon(self, scene, config):
        pictures = projector.Projector(self.bench, scene)
        daemon = self.bench.daemon(pictures.CONFIG + config, "--images", pictures.pipe, camera=None)
        daemon.wait_for("zero taken, by itself")
        return pictures, daemon

    def test_everything_that_is_hidden_is_found(self):
        weights = (100, 200, 500)
        loads = self.file("weights.toml", GEL + "[[contacts]]\nradius_mm = 4\nx_mm = 1.3\ny_mm = -2.1\n"
                          "time_s = [3, 3.1, 4.1, 4.2, 5.2, 5.3, 9]\nforce_z_n = "
                          f"{[0] + [gf * rig.GRAM_FORCE for gf in weights for _ in range(2)]}\n")
        rest, *loaded = projector.scenes(self.bench, loads, [(0, 0.5), (3.1, 4.1), (4.2, 5.2), (5.3, 6.3)])
        nominal = self.file("nominal.toml", NOMINAL)
        pictures, daemon = self.daemon(rest, f'[sensor]\ngel_file = "{nominal}"\n')
        reports = self.calibrate(daemon, "geometry", "noise", "--seconds", 2)
        pictures.show(loaded[0])
        asking = self.bench.start(rig.BIN / "tractionctl", "--control", daemon.endpoint["control"], "calibrate", "weights",
                                  "--weights", ",".join(f"{gf}gf" for gf in weights), "--seconds", 600, "--yes", "--json")
        for scene, gf in zip(loaded[1:], weights):
            asking.wait_for(rf'"weight_gf":{{"value":{gf},')
            pictures.show(scene)
        self.assertEqual(asking.join(), DONE, asking.output())
        reports["stiffness"] = json.loads(asking.lines[-1])
        self.check_found(reports)
        code, output = self.ctl(daemon, "calibrate", "finish", "--name", "left", "--json")
        self.assertEqual(code, DONE, output)
        path = json.loads(output)["path"]
        self.assertEqual(daemon.stop(), 0, daemon.output())
        pictures.stop()

        press = self.file("press.toml", GEL + "[[contacts]]\nradius_mm = 3\nx_mm = -4\ny_mm = 3\ntime_s = [4, 5]\n"
                          "force_z_n = [0, 3]\nforce_x_n = [0, 0.6]\n")
        film, _ = self.bench.film(press, 6, config=f'[sensor]\ngel_file = "{path}"\n')
        self.check_newtons(film.fields)


@suite.realtime
class RealTime(TestCase):
    def test_geometry_from_pictures_that_none_of_our_programs_drew(self):
        camera = independent.Camera(position_mm=(1.5, -1.0, 179.0), rotation_rad=(0.01, -0.012, 0.03), k1=-0.1,
                                    focal_px=961.0, gel_index=1.41, window_index=1.49, window_thickness_mm=10.0)
        nominal = independent.Camera(position_mm=(0.0, 0.0, 178.0), gel_index=1.41, window_index=1.49,
                                     window_thickness_mm=10.0)
        noise, pixels = np.random.default_rng(1), camera.project(independent.MARKERS)
        levels = independent.picture(camera, pixels)
        pictures = self.bench.folder / "pictures.raw"
        with open(pictures, "wb") as file:
            for _ in range(60):
                file.write(independent.frame(levels, "RGB8", noise))
        self.bench.twin("idle", "--serve", pictures, "--rate", 20, ready=False)
        gel = self.file("nominal.toml", nominal.gel_file() + NOMINAL.partition("\n")[2])
        daemon = self.bench.daemon(f'[sensor]\ngel_file = "{gel}"\n')
        daemon.wait_for("zero taken, by itself")
        found = self.calibrate(daemon, "geometry")["geometry"]["figures"]
        value = {name: figure["value"] for name, figure in found.items()}
        fitted = independent.Camera(
            position_mm=tuple(value[f"position_{axis}_mm"] for axis in "xyz"),
            rotation_rad=tuple(value[f"rotation_{axis}_rad"] for axis in "xyz"), focal_px=value["focal_px"],
            principal_px=(value["principal_u_px"], value["principal_v_px"]), k1=value["k1"], k2=value["k2"],
            gel_index=1.41, window_index=1.49, window_thickness_mm=10.0)
        error = np.sqrt(((fitted.project(independent.MARKERS) - pixels) ** 2).mean())
        print(f"\n  residual {value['residual_px']:.4f} px; fitted camera off by {error:.4f} px; position "
              f"{np.subtract(fitted.position_mm, camera.position_mm)} mm, rotation "
              f"{np.subtract(fitted.rotation_rad, camera.rotation_rad)} rad")
        self.assertLess(value["residual_px"], 0.006)
        self.assertLess(error, 0.006)
        for axis in "xyz":
            self.assertLess(abs(value[f"position_{axis}_mm"] - camera.position_mm["xyz".index(axis)]),
                            4 * found[f"position_{axis}_mm"]["deviation"])
