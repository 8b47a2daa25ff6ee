"""A body from an influence file: measured as any other, and refused with one line where the file is wrong."""

import subprocess
import sys
import unittest

import numpy as np

import rig

DATA, NO_INPUT = 65, 66
EXAMPLES = rig.SOURCE / "docs" / "examples"


class Body(unittest.TestCase):
    def setUp(self):
        self.bench = self.enterContext(rig.Rig())

    def write(self, *options):
        """The example's files; returns the configuration that names them."""
        gel = self.bench.folder / "dome.toml"
        gel.write_text((EXAMPLES / "dome.toml").read_text())
        subprocess.run([sys.executable, EXAMPLES / "write_influence.py", self.influence(), *options], check=True)
        return f'[sensor]\ngel_file = "{gel}"\n'

    def influence(self):
        return self.bench.folder / "dome.npz"

    def change(self, **arrays):
        """Other arrays in the file; None: none."""
        with np.load(self.influence()) as file:
            whole = {**file, **arrays}
        np.savez(self.influence(), **{name: array for name, array in whole.items() if array is not None})

    def fill_with_block(self):
        """Puts the displacements of the block that the pictures show into the file."""
        with np.load(self.influence()) as file:
            nodes = file["node_positions"]
        unit = np.arange(3 * len(nodes))
        loads = np.column_stack([unit, nodes[unit // 3, :2], np.eye(3)[unit % 3]])
        loads.tofile(self.bench.folder / "forces.f64")
        gel = rig.SOURCE / "config" / "gels" / "paper.toml"
        subprocess.run([rig.BUILD / "bin" / "evaluation_mechanics", self.bench.folder, gel], check=True)
        displacement = np.fromfile(self.bench.folder / "displacement.f64").reshape(len(nodes), 3, -1, 3)
        self.change(influence=np.ascontiguousarray(displacement.transpose(2, 3, 0, 1)))

    def measure(self, config):
        """Mean resultant and moment under the hold's load, their deviations, the nodes' forces, and the description."""
        with rig.Rig() as bench:
            film, truth = bench.film("hold", 500, config=config)
        fields = film.fields[-100:]
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

    def test_dome_is_measured(self):
        wrench, _, _, description = self.measure(self.write("--radius", "1"))
        self.assertGreater(wrench[2], 1.0)
        self.assertGreater(max(description.body.node_positions_m[2::3]), 1e-3)

    # --- what is wrong is said before anything is published

    def refused(self, code, words, config):
        daemon = self.bench.daemon(config, camera=None, ready=False)
        self.assertEqual(daemon.join(), code, daemon.output())
        self.assertEqual(len(daemon.lines), 1, daemon.output())
        for word in ["dome.npz", *words]:
            self.assertIn(word, daemon.lines[0])

    def test_bad_files(self):
        config = self.write("--radius", "0")
        self.change(units="mm")
        self.refused(DATA, ["units", "mm", "docs/influence-file.md"], config)
        self.influence().unlink()
        self.refused(NO_INPUT, ["gel.influence_file"], config)

if __name__ == "__main__":
    unittest.main()
