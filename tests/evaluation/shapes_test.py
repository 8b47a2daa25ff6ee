"""The random loads' truth: against CalculiX's loads stored from another mesh, another program, a textbook's formula,
equilibrium, mirrors, the project's own mechanics and projection; and the families. TRACTION_SEED=N repeats a run."""

import csv
import sys
import unittest

import numpy as np

import chain
import influence
import loads
import shapes
import truth
from report import SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "support"))
import seed  # noqa: E402

MARKERS = loads.markers()
POISSON = influence.POISSON


def peak(displacement):
    return np.linalg.norm(displacement, axis=-1).max()


class Truth(unittest.TestCase):
    def test_agrees_with_stored_loads_better_than_two_meshes_do(self):
        for thickness, sets in ((15, ["places", "rim"]), (25, ["places"]), (40, ["places", "rim", "random", "disc"])):
            meshes = float(np.loadtxt(truth.DATA / f"{thickness}_0.49_mesh_difference.txt"))
            for which in sets:
                stored = truth.load(thickness, 0.49, which)
                for number in np.random.default_rng(seed.SEED).choice(len(stored.contacts), 4, replace=False):
                    contacts = stored.contacts[number]
                    points, forces = truth.quadrature(contacts[~np.isnan(contacts[:, 0])])
                    off = shapes.displacements(thickness, points, forces) - stored.displacement[number]
                    self.assertLess(peak(off), 0.5 * meshes * peak(stored.displacement[number]), (which, number))
                    usual = np.sqrt(np.mean(np.sum(off**2, axis=1)))
                    self.assertLess(usual, 1e-3 * peak(stored.displacement[number]), (which, number))

    def test_agrees_with_another_program(self):
        """Finite elements of degree 6, not CalculiX's: 1 N pressed (A) and sheared (B) on a block of 0.018 MPa."""
        with open(SOURCE / "tests" / "golden" / "block_reference.csv") as file:
            rows = [row for row in csv.reader(file)][1:]
        for case, force in (("A", [0, 0, 1]), ("B", [1, 0, 0])):
            places, moved = np.split(1e-3 * np.array([row[2:] for row in rows if row[0] == case], float), 2, axis=1)
            marker = [np.linalg.norm(MARKERS.T - place, axis=1).argmin() for place in places]
            ours = shapes.displacements(40, *loads.patch("hertz", [0.7e-3, 0.4e-3], 2.5e-3, force))[marker]
            other = 0.018e6 / chain.YOUNG * moved
            self.assertLess(peak(ours - other), 1e-3 * peak(other), case)

    def test_moves_as_the_own_block_does_where_the_gel_is_not_as_drawn(self):
        """Markers beside their places, another thickness, another Poisson's ratio: the project's own mechanics."""
        load = shapes.draw("ball", np.random.default_rng(seed.SEED))
        rows = np.column_stack([np.zeros(load.points.shape[1]), load.points.T, load.forces.T])
        straight = chain.mechanics(chain.gel_text(25), rows)[0]
        kept = influence.of(25)
        whole = kept.displacement(load.points, load.forces)
        by = np.array([[0.3e-3], [-0.3e-3], [0.1e-3]])
        text = chain.gel_text(25, red_depth=8.1).replace("[1.5, 1.5]", "[1.8, 1.2]")
        text = text.replace("depth_mm = 6\n", "depth_mm = 6.1\ncentre_mm = [0.3, -0.3]\n")
        ours = chain.mechanics(text, rows)[0] - straight
        beside = kept.displacement(load.points, load.forces, np.tile(by, 1152)) - whole
        self.assertLess(peak(beside - ours), 2e-3 * peak(whole))
        self.assertGreater(peak(ours), 2e-2 * peak(whole))
        for by, gel, step, tolerance in (
            ("thickness", chain.gel_text(25.5), 0.5e-3, 0.05),
            ("poisson", chain.gel_text(25, poisson=0.485), -0.005, 0.25),
        ):
            ours = (chain.mechanics(gel, rows)[0] - straight) / step
            derivative = influence.of(25, by).displacement(load.points, load.forces)
            self.assertLess(np.linalg.norm(derivative - ours), tolerance * np.linalg.norm(ours), by)

    def test_is_a_half_spaces_less_what_the_base_takes(self):
        """Boussinesq's formula on the axis of a point force; a base at h takes a part that goes as force / (E h)."""
        marker = 12 * 24 + 12  # blue, near the middle
        depth = MARKERS[2, marker]
        textbook = (1 + POISSON) / (2 * np.pi * chain.YOUNG * depth) * (1 + 2 * (1 - POISSON))
        taken = {}
        for thickness in influence.THICKNESSES:
            moved = shapes.displacements(thickness, MARKERS[:2, [marker]], np.array([[0.0], [0.0], [1.0]]))
            taken[thickness] = thickness * (1 - moved[marker, 2] / textbook)
            self.assertLess(abs(moved[marker, :2]).max(), 0.02 * moved[marker, 2])
        for thickness, shift in taken.items():  # at the markers' depth the field is one of h, not of the depth alone
            self.assertLess(abs(shift / taken[25] - 1), 0.1, (thickness, taken))

    def test_carries_the_force_that_is_put_on(self):
        """Equilibrium: what shears the face of a flat block evenly shears its middle by force / (area G); a little
        more, because the free sides carry nothing."""
        across = 1e-3 * np.arange(-49, 50, 2)
        points = np.stack([axis.ravel() for axis in np.meshgrid(across, across)])
        stress, modulus = 1 / (2 * influence.HALF_WIDTH) ** 2, chain.YOUNG / (2 * (1 + POISSON))
        for axis in range(2):
            forces = np.zeros((3, points.shape[1]))
            forces[axis] = 1 / points.shape[1]
            blue, red = shapes.displacements(15, points, forces)[:, axis].reshape(2, 24, 24)
            above = (blue[:-1, :-1] + blue[:-1, 1:] + blue[1:, :-1] + blue[1:, 1:]) / 4  # a red marker
            middle = slice(7, 16)
            strain = (above - red[:-1, :-1])[middle, middle].mean() / 2e-3
            self.assertTrue(1 <= strain * modulus / stress < 1.05, strain * modulus / stress)

    def test_is_the_same_in_a_mirror(self):
        """Of the diagonal, which neither the kept classes nor the mesh's solution know of, and of the middle."""
        across = np.arange(1152).reshape(2, 24, 24).transpose(0, 2, 1).ravel()
        blue_mirrored = np.arange(576).reshape(24, 24)[:, ::-1].ravel()
        for thickness in influence.THICKNESSES:
            family = str(np.random.default_rng(seed.SEED).choice(shapes.FAMILIES))
            load = shapes.draw(family, np.random.default_rng(seed.SEED))
            moved = shapes.displacements(thickness, load.points, load.forces)
            swapped = shapes.displacements(thickness, load.points[::-1], load.forces[[1, 0, 2]])[across][:, [1, 0, 2]]
            self.assertLess(peak(swapped - moved), 1e-4 * peak(moved), load.text)
            flip = np.array([-1, 1, 1])
            turned = shapes.displacements(thickness, load.points * flip[:2, None], load.forces * flip[:, None])
            self.assertLess(peak(flip * turned[blue_mirrored] - moved[:576]), 1e-4 * peak(moved), load.text)

    def test_pixels_are_the_daemons(self):
        load = shapes.draw("disc", np.random.default_rng(seed.SEED))
        moved = shapes.displacements(40, load.points, load.forces)
        seen = chain.run(moved[None], given=0).true_px.reshape(1152, 2)
        self.assertLess(abs(shapes.pixels(MARKERS, moved) - seen).max(), 1e-9)


class Families(unittest.TestCase):
    def loads(self):
        for family in shapes.FAMILIES:
            for number in range(6):
                yield family, shapes.draw(family, np.random.default_rng([seed.SEED, number]))

    def test_the_same_seed_draws_the_same_load(self):
        for family in shapes.FAMILIES:
            one, other = (shapes.draw(family, np.random.default_rng(seed.SEED)) for _ in range(2))
            self.assertEqual(one.text, other.text)
            np.testing.assert_array_equal(one.forces, other.forces)

    def test_lie_where_they_say(self):
        for family, load in self.loads():
            reach = abs(load.points).max()
            beyond = load.pressure[(abs(load.points) > shapes.OUTERMOST).any(0)].sum()
            if load.zone in ("inside", "rim", "corner"):
                self.assertLessEqual(reach, shapes.OUTERMOST + 1e-9, load.text)
            if load.zone == "beyond":
                self.assertTrue(0 < beyond <= 0.5 + 1e-9, load.text)
            self.assertLessEqual(reach, influence.HALF_WIDTH - 3e-3 + 1e-9, load.text)
            self.assertEqual(family.endswith("beyond"), load.zone == "beyond", load.text)

    def test_weigh_what_they_say(self):
        for family, load in self.loads():
            least, most = (100, 1500) if family in shapes.PALMS else (3, 4 * 750)
            self.assertTrue(least <= load.size / chain.GF + 1e-6 <= most + 1e-3, load.text)
            amounts, patterns = shapes.by_patterns(load), shapes.patterns(load)
            np.testing.assert_allclose(np.tensordot(amounts, patterns, 1), load.forces, atol=1e-9 * load.size)
            arms = np.vstack([load.points, 0 * load.points[:1]])
            moment = np.cross(arms.T, load.forces.T).sum(0)
            np.testing.assert_allclose(load.resultant, [*load.forces.sum(1), *moment], atol=1e-9 * load.size)

    def test_bound_is_what_least_squares_reaches(self):
        """Scatter of the weighted least-squares estimate of a load's patterns and the picture's motion."""
        generator = np.random.default_rng(seed.SEED)
        load = shapes.draw("ring", generator)
        answers = shapes.displacements(40, load.points, shapes.patterns(load))
        columns = shapes.pixels(MARKERS, 1e-3 * answers) / 1e-3
        rest = shapes.CAMERA[0] * MARKERS[:2] * [[1], [-1]] / (shapes.CAMERA[1] - MARKERS[2])
        motion = [np.tile([1, 0], 1152), np.tile([0, 1], 1152), rest.T.ravel(), (rest[::-1].T * [-1, 1]).ravel()]
        matrix = np.vstack([columns.reshape(len(answers), -1), motion]).T
        prior = np.hstack([np.zeros((4, len(answers))), np.diag(shapes.MARKER_NOISE_PX / shapes.MOTION)])
        trials = 400
        strayed = shapes.MOTION[:, None] * generator.standard_normal((4, trials))
        seen = matrix[:, -4:] @ strayed + shapes.MARKER_NOISE_PX * generator.standard_normal((2304, trials))
        found = np.linalg.lstsq(np.vstack([matrix, prior]), np.vstack([seen, np.zeros((4, trials))]), rcond=None)[0]
        off = shapes.patterns(load).sum(2).T @ found[:-4]
        reached = np.sqrt(np.mean(np.sum(off**2, axis=0)))
        bound = shapes.bound(load, MARKERS, answers)
        self.assertLess(abs(reached / bound - 1), 0.15)

    def test_scaled_is_linear(self):
        load = shapes.draw("several", np.random.default_rng(seed.SEED))
        np.testing.assert_allclose(load.scaled(2).resultant, 2 * load.resultant)
        moved = [shapes.displacements(25, one.points, one.forces) for one in (load, load.scaled(2))]
        np.testing.assert_allclose(moved[1], 2 * moved[0], atol=1e-9 * peak(moved[0]))


if __name__ == "__main__":
    print(f"seed {seed.SEED}: repeat with TRACTION_SEED={seed.SEED}")
    unittest.main()
