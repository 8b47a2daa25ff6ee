"""A body from an influence file: measured as any other."""

import json
import subprocess
import sys
import types
import unittest

import numpy as np

import projector
import rig

EXAMPLES = rig.SOURCE / "docs" / "examples"
sys.path[:0] = [str(EXAMPLES), str(rig.SOURCE / "gel")]

import write_influence  # noqa: E402

try:
    from traction_gel import placement  # what places the dots of a description; needs scipy, and no gmsh
except ImportError:
    placement = None


class Body(rig.TestCase):
    def write(self, *options):
        """The example's files; returns the configuration that names them."""
        gel = self.bench.folder / "dome.toml"
        gel.write_text((EXAMPLES / "dome.toml").read_text())
        subprocess.run([sys.executable, EXAMPLES / "write_influence.py", self.influence(), *options], check=True)
        return f'[sensor]\ngel_file = "{gel}"\n'

    def influence(self):
        return self.bench.folder / "dome.npz"

    def fill_with_block(self):
        """Puts the displacements of the block that the pictures show into the file."""
        with np.load(self.influence()) as file:
            arrays = dict(file)
        nodes = arrays["node_positions"]
        unit = np.arange(3 * len(nodes))
        loads = np.column_stack([unit, nodes[unit // 3, :2], np.eye(3)[unit % 3]])
        loads.tofile(self.bench.folder / "forces.f64")
        gel = rig.SOURCE / "config" / "gels" / "paper.toml"
        subprocess.run([rig.BIN / "evaluation_parts", "mechanics", self.bench.folder, gel], check=True)
        displacement = np.fromfile(self.bench.folder / "displacement.f64").reshape(len(nodes), 3, -1, 3)
        np.savez(self.influence(), **arrays | {"influence": np.ascontiguousarray(displacement.transpose(2, 3, 0, 1))})

    def measure(self, config):
        """Mean resultant and moment under the hold's load, their deviations, the nodes' forces, and the description."""
        with rig.Rig() as bench:
            film, truth = bench.film("hold", 8, config=config)
        fields = film.fields[-50:]
        self.true_force = np.array(truth[fields[0].header.camera_frame_id]["force_N"])
        self.assertGreater(np.linalg.norm(self.true_force), 1)
        wrenches = np.array([np.concatenate([rig.vector(f.resultant_N), rig.vector(f.moment_Nm)]) for f in fields])
        nodes = np.mean([np.array(f.force_N) for f in fields], axis=0)
        return wrenches.mean(axis=0), wrenches.std(axis=0), nodes, film.description

    def test_block_from_a_file_measures_as_the_block(self):
        config = self.write("--radius", "0")
        self.fill_with_block()
        wrench, deviation, forces, description = self.measure(config)
        self.assertLess(np.linalg.norm(wrench[:3] - self.true_force), 0.01 * np.linalg.norm(self.true_force))
        model, _, model_forces, plain = self.measure("")
        # Two zeros were taken, of some frames each: the means differ by their noise.
        self.assertLess(np.linalg.norm((wrench - model)[:3]), 5e-3 * np.linalg.norm(model[:3]) + 5 * deviation[:3].max())
        self.assertLess(np.linalg.norm((wrench - model)[3:]), 5e-3 * np.linalg.norm(model[3:]) + 5 * deviation[3:].max())
        # The block knows round patches, a file has forces on its nodes alone: shapes agree, single nodes need not.
        self.assertEqual(np.argmax(np.abs(forces)), np.argmax(np.abs(model_forces)))
        self.assertGreater(forces @ model_forces, 0.95 * np.linalg.norm(forces) * np.linalg.norm(model_forces))
        self.assertEqual(description.solver.mechanics, "influence file")
        self.assertEqual(len(description.body.marker_positions_m), 3 * 1152)
        self.assertEqual(len(description.body.node_areas_m2), 576)
        self.assertFalse(plain.HasField("body"))
        self.assertNotEqual(description.calibration.id, plain.calibration.id)

    def write_fingertip(self, random=False, window=False):
        """A fingertip as the shipped one but for its mechanics: of each node a half-space that touches it there. Returns the
        path of its gel file. \\param random whether its markers are dots at random, and no grid
        \\param window whether the camera is in a hollow bone that refracts, from where it sees fewer markers"""
        def on_ball(count, pitch, depth):
            return wrap(write_influence.grid(count=count, pitch=pitch), depth)

        def wrap(plane, depth, name=None):
            angle, turn = np.hypot(*plane.T) / (10e-3 - depth), np.arctan2(plane[:, 1], plane[:, 0])
            inward = np.column_stack([-np.sin(angle) * np.cos(turn), -np.sin(angle) * np.sin(turn), np.cos(angle)])
            return [0, 0, 10e-3] - (10e-3 - depth) * inward, inward
        nodes, normals = on_ball(17, 1.3e-3, 0)
        side = 11 if window else 15
        markers, _ = on_ball(side, 1e-3, 2e-3)
        if random:
            layer = {"columns": 15, "rows": 15, "pitch_mm": 1e-3, "depth_mm": 2e-3, "least_mm": 0.65e-3}  # here in m
            markers, _ = placement.dots(types.SimpleNamespace(wrap=wrap), layer, "dots")
        influence = np.empty((len(markers), 3, len(nodes), 3))
        for n, axes in enumerate(write_influence.frames(normals)):
            local = write_influence.half_space((markers - nodes[n]) @ axes.T, 0.18e6, 0.49)
            influence[:, :, n, :] = axes.T @ local @ axes
        np.savez(self.bench.folder / "tip.npz", format="traction-influence/1", units="SI", youngs_modulus=0.18e6,
                 influence=influence, node_positions=nodes, node_normals=normals, node_areas=np.full(len(nodes), 1.69e-6),
                 marker_positions=markers)
        gel = self.bench.folder / "tip_gel.toml"
        gel.write_text('format = 1\n[gel]\ninfluence_file = "tip.npz"\nthickness_mm = 18\n[[layers]]\ncolour = "blue"\n'
                       f'columns = {side}\nrows = {side}\ndiameter_mm = 0.3\n[nodes]\ncolumns = 17\nrows = 17\n'
                       + ('[camera]\nfocal_px = 420\nposition_mm = [0, 0, 14]\ngel_index = 1.41\n'
                          '[[camera.surfaces]]\ncentre_mm = [0, 0, 10]\nradii_mm = [6, 6, 6]\nindex = 1.5\n'
                          '[[camera.surfaces]]\ncentre_mm = [0, 0, 10]\nradii_mm = [4.5, 4.5, 4.5]\nindex = 1\n' if window
                          else '[camera]\nfocal_px = 1000\nposition_mm = [0, 0, 45]\n'))
        return gel

    def check_fingertip(self, scenario, **kind):
        """Forces, moments and places of all frames, within the stated intervals of the twin's truth."""
        gel = self.write_fingertip(**kind)
        film, truth = self.bench.film(scenario, 12, "--gel", gel, config=f'[sensor]\ngel_file = "{gel}"\n')
        misses, places = [], []
        for field in film.fields:
            record = truth[field.header.camera_frame_id]
            true = np.concatenate([record["force_N"], record["moment_Nm"]])
            found = np.concatenate([rig.vector(field.resultant_N), rig.vector(field.moment_Nm)])
            variance = np.concatenate([np.add(of.noise, of.systematic)[[0, 4, 8]]
                                       for of in (field.resultant_covariance_N2, field.moment_covariance_N2m2)])
            misses.append(abs(found - true) / np.sqrt(variance))
            if np.linalg.norm(true[:3]) > 0.2:
                self.assertEqual(len(field.contacts), 1)
                contact, touched = field.contacts[0], record["contacts"][0]
                place = np.array([contact.position_m.x, contact.position_m.y, contact.position_z_m])
                places.append(np.linalg.norm(place - touched["position_m"]))
                self.assertLess(np.linalg.norm(found - true), 0.03 * np.linalg.norm(true))
                self.assertFalse(field.header.flags & 64)  # FLAG_OUT_OF_RANGE
        self.assertGreater(len(places), len(film.fields) / 3)
        self.assertGreater((np.array(misses) < 1.96).mean(), 0.95)
        self.assertLess(max(places), 0.2e-3)
        self.assertGreater(max(film.description.body.node_positions_m[2::3]), 1e-3)
        print(f"\n  {scenario}: at most {np.max(misses):.2f} of a deviation from the truth; places within "
              f"{1e3 * max(places):.3f} mm", end=" ")

    def test_fingertip_behind_a_curved_window(self):
        self.check_fingertip("fingertip", window=True)

    @unittest.skipUnless(placement, "needs python3-scipy")
    def test_random_dots_are_drawn_and_measured(self):
        self.check_fingertip("fingertip_roll", random=True)

    def test_fingertip_is_calibrated(self):
        """Of a finger that is stiffer than its file says, behind a camera that is turned and moved against it, by forces in several
        places, each known along a direction of its own."""
        gel = self.write_fingertip()
        hidden = {"position_x_mm": 0.4, "position_y_mm": -0.3, "position_z_mm": 45.5, "rotation_x_rad": 0.02,
                  "rotation_y_rad": -0.03, "rotation_z_rad": 0.015, "youngs_modulus_pa": 200e3}
        true = self.bench.folder / "true_gel.toml"
        values = list(hidden.values())
        true.write_text(gel.read_text().replace("[gel]\n", "[gel]\nyoungs_modulus_pa = 200000\n").replace(
            "position_mm = [0, 0, 45]", f"position_mm = {values[:3]}\nrotation_rad = {values[3:6]}"))
        forces = [(0, 0, (0, 0, 0.6)), (3, 2, (0, 0.1, 0.6)), (-3.5, 1, (0.15, 0, 0.8))]  # along and across the normal
        loads = self.bench.folder / "loads.toml"
        loads.write_text("format = 1\nperiod_s = 1000\n" + "".join(
            f"[[contacts]]\nradius_mm = 2\nx_mm = {x}\ny_mm = {y}\ntime_s = {[3 + n, 3.1 + n, 3.9 + n, 4 + n]}\n" + "".join(
                f"force_{axis}_n = {[0, part, part, 0]}\n" for axis, part in zip("xyz", force))
            for n, (x, y, force) in enumerate(forces)))
        truth = self.bench.folder / "truth.jsonl"
        rest, *loaded = projector.scenes(self.bench, loads, [(0, 0.5), (3.2, 3.8), (4.2, 4.8), (5.2, 5.8)], "--gel", true,
                                         "--truth", truth)
        with open(truth) as lines:
            records = [record for record in map(json.loads, lines) if record["contacts"]]
        known = [np.array(records[len(records) * (2 * n + 1) // 6]["force_N"]) for n in range(3)]
        along = [np.array(axis) for axis in ((0, 0, 1), (0.3, 0.2, 0.9), (-0.3, 0, 0.9))]
        newtons = [force @ axis / np.linalg.norm(axis) for force, axis in zip(known, along)]
        pictures = projector.Projector(self.bench, rest)
        daemon = self.bench.daemon(pictures.CONFIG + f'[sensor]\ngel_file = "{gel}"\n', "--images", pictures.pipe, camera=None)
        daemon.wait_for("more than .uncertainty. says: measure it with tractionctl calibrate")
        calibrate = ("--control", daemon.endpoint["control"], "calibrate", "--yes", "--json")
        code, output = self.bench.ctl(*calibrate, "geometry")
        self.assertEqual(code, 0, output)
        figures = json.loads(output.splitlines()[-1])["figures"]
        pictures.show(loaded[0])
        asking = self.bench.start(rig.BIN / "tractionctl", *calibrate, "weights", "--seconds", 600, "--weights",
                                  ",".join(f"{each}N" for each in newtons),
                                  *("--direction={},{},{}".format(*axis) for axis in along))
        for number, scene in enumerate(loaded[1:], 1):
            while sum("weight_gf" in line for line in asking.lines) < number:
                self.assertTrue(asking.read(0.1), asking.output())
            pictures.show(scene)
        self.assertEqual(asking.join(), 0, asking.output())
        figures |= json.loads(asking.lines[-1])["figures"]
        for name, value in hidden.items():
            found = figures[name]
            print(f"\n  {name:18} hidden {value:<8g} found {found['value']:.6g} +- {found['deviation']:.2g}", end=" ")
            self.assertLess(abs(found["value"] - value), 4 * found["deviation"] + 1e-3 * abs(value), name)
        # Between the nodes the twin moves the markers to 1 % (decision 62).
        self.assertLess(abs(figures["youngs_modulus_pa"]["value"] / 200e3 - 1), 0.02)
