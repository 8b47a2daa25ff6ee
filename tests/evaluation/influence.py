"""What any forces on the surface of the paper's block do to its markers, by CalculiX, in a form small enough to keep.

The influence of a surface point is a half-space's closed form (Boussinesq, Cerruti) and a rest, which is smooth because
what bends it, base and sides, is far away. The rest is CalculiX's influence less the closed form, so the sum is
CalculiX's whatever the closed form says. It is kept as Chebyshev polynomials of the surface point's place, by the four
classes of calculix.py, cut to its largest singular values; `python3 influence.py FOLDER THICKNESS...` computes it and
says what is lost. SI; for E = 0.18 MPa, Poisson's ratio 0.49.
"""

import functools
import pathlib
import sys

import numpy as np

import calculix
import loads

DATA = pathlib.Path(__file__).parent / "data"
YOUNG, POISSON = 0.18e6, 0.49
HALF_WIDTH = 50e-3  # of the block
DEGREE = 23
KEPT = 4e-4  # singular values above so much of the largest influence
THICKNESSES = (15, 25, 40)


def half_space(markers, points, young=YOUNG, poisson=POISSON):
    """Displacement of each marker (3 x M, m) per newton at each surface point (2 x P): 3 x M x 3 x P [m/N], first the
    displacement's direction, third the force's. As precise as the markers are."""
    x, y = (markers[axis][:, None] - points[axis][None].astype(markers.dtype) for axis in (0, 1))
    z, kind = markers[2][:, None], markers.dtype.type
    r = np.sqrt(x * x + y * y + z * z)
    c = kind((1 + poisson) / (2 * np.pi * young)) / r
    far, near = c / (r * r), kind(1 - 2 * poisson) * c / (r + z)
    bend, lean = far - near / (r + z), z * far
    result = np.empty((3, r.shape[0], 3, r.shape[1]), markers.dtype)
    result[0, :, 0] = c + near * r + x * x * bend
    result[1, :, 1] = c + near * r + y * y * bend
    result[0, :, 1] = result[1, :, 0] = x * y * bend
    result[2, :, 0], result[2, :, 1] = x * (lean + near), y * (lean + near)
    result[0, :, 2], result[1, :, 2] = x * (lean - near), y * (lean - near)
    result[2, :, 2] = z * lean + kind(2 * (1 - poisson)) * c
    return result


STEP = {"poisson": -0.005, "thickness": 0.5e-3}
CLOSED_FORM = {
    None: half_space,
    "poisson": lambda markers, points: (
        half_space(markers, points, poisson=POISSON + STEP["poisson"]) - half_space(markers, points)
    )
    / STEP["poisson"],
    "thickness": lambda markers, points: np.zeros((3, markers.shape[1], 3, points.shape[1])),
}


def kept_in(thickness, by=None):
    return DATA / f"{thickness}_{POISSON}_influence{'_by_' + by if by else ''}.npz"


def chebyshev(places):
    """T_0 .. T_DEGREE at places on the surface [m]: degrees x P."""
    return np.cos(np.arange(DEGREE + 1)[:, None] * np.arccos(np.clip(places / HALF_WIDTH, -1, 1)))


def degrees(parity, axis, direction):
    """Degrees along an axis of the class's fields of one direction: even or odd."""
    even = (parity[axis] == 1) != (direction == axis)
    return np.arange(0 if even else 1, DEGREE + 1, 2)


class Influence:
    """Marker displacements under any forces on the surface. Forces are ... x 3 x P [N] at `points`, 2 x P [m]; answers
    are ... x M x 3 [m]. `by`: their derivative by "poisson" or "thickness" [m]."""

    def __init__(self, thickness, by=None):
        with np.load(kept_in(thickness, by)) as file:
            self.parts = [
                (file[f"left_{i}"] * file[f"left_scale_{i}"], file[f"right_{i}"] * file[f"right_scale_{i}"])
                for i in range(4)
            ]
        self.by, self.markers = by, loads.markers()
        points, self.mirrored = calculix.fold(1e3 * self.markers)
        self.of = np.unique(points.round(6), axis=1, return_inverse=True)[1]

    def displacement(self, points, forces, scatter=None):
        """`scatter`: 3 x M [m], how far the markers sit from their places, some tenths of a millimetre."""
        columns = forces.reshape(-1, *forces.shape[-2:])
        result = np.array([self._rest(points, one) for one in columns])
        if scatter is not None:
            result += np.array([beside(one, scatter) for one in result])
        markers = (self.markers if scatter is None else self.markers + scatter).astype(np.float32)
        for first in range(0, points.shape[1], 64):  # as much as fits a cache
            part = slice(first, first + 64)
            closed_form = CLOSED_FORM[self.by](markers, points[:, part]).reshape(3 * markers.shape[1], -1)
            moved = closed_form @ columns[:, :, part].reshape(len(columns), -1).T.astype(np.float32)
            result += moved.reshape(3, -1, len(columns)).transpose(2, 1, 0)
        return result.reshape(*forces.shape[:-2], *result.shape[1:])

    def _rest(self, points, forces):
        """All but the half-space's part."""
        moments = np.einsum("dp,kp,lp->dkl", forces, chebyshev(points[0]), chebyshev(points[1]), optimize=True)
        result = 0.0
        for parity, (left, right) in zip(calculix.CLASSES, self.parts):
            character, turn = calculix.signs(self.mirrored, parity)
            moved = left @ (right.T @ moments_of(parity, moments))
            result = result + 0.25 * (character * turn * moved.reshape(-1, 3)[self.of].T).T
        return result


def beside(rest, scatter):
    """How much the smooth part differs beside the markers' places: its slopes by differences between markers."""
    layers = rest.reshape(2, 24, 24, 3)
    down, right = (np.gradient(layers, 3e-3, axis=axis, edge_order=2) for axis in (1, 2))
    blue, red = layers + 0.75e-3 * np.array([1, -1])[:, None, None, None] * (down + right)  # both half-way between
    deeper = np.broadcast_to((red - blue) / 2e-3, layers.shape)
    slopes = np.stack([right, down, deeper]).reshape(3, -1, 3)
    return np.einsum("jmi,jm->mi", slopes, scatter)


@functools.cache
def of(thickness, by=None):
    return Influence(thickness, by)


def moments_of(parity, moments):
    """Those of a class, one after another."""
    return np.concatenate(
        [moments[d][np.ix_(degrees(parity, 0, d), degrees(parity, 1, d))].ravel() for d in range(3)]
    )


def rounded(columns):
    """16-bit steps and their sizes, one for each column."""
    scale = abs(columns).max(0) / 32767
    return np.round(columns / scale).astype(np.int16), scale


def rests(block, poisson=POISSON):
    """CalculiX's answers less the half-space's, class by class: marker, its direction, force's, surface node."""
    markers, surface = 1e-3 * block.images.points, surface_of(block)
    kernels = [half_space(markers, surface * [[1 - 2 * x], [1 - 2 * y]], poisson=poisson) for x, y in calculix.MIRRORS]
    for parity, operator in zip(calculix.CLASSES, block.operator):
        rest = np.moveaxis(1e-3 * np.asarray(operator, float), 2, 3)
        for mirror, kernel in zip(calculix.MIRRORS, kernels):
            character, turn = calculix.signs(np.array(mirror)[:, None], parity)
            rest = rest - np.einsum("j,imjp->mijp", character[0] * turn[:, 0], kernel)
        yield rest


def surface_of(block):
    return 1e-3 * block.mesh.positions[block.mesh.surface - 1, :2].T


def keep(path, surface, answers, kept):
    """Answers like rests(): as polynomials of the surface's nodes, singular values above `kept`."""
    values = [chebyshev(axis) for axis in surface]
    weight = np.sqrt(np.sqrt(np.prod(1.05 - (surface / HALF_WIDTH) ** 2, 0)))  # nodes are dense at the sides
    arrays = {}
    for number, (parity, answer) in enumerate(zip(calculix.CLASSES, answers)):
        parts = []
        for d in range(3):
            basis = np.einsum("kp,lp->pkl", values[0][degrees(parity, 0, d)], values[1][degrees(parity, 1, d)])
            basis = basis.reshape(surface.shape[1], -1)
            rows = answer[:, :, d].reshape(-1, surface.shape[1])
            parts.append(np.linalg.lstsq(basis * weight[:, None], (rows * weight).T, rcond=1e-9)[0].T)
        left, size, right = np.linalg.svd(np.hstack(parts), full_matrices=False)
        root = np.sqrt(size[size > kept])
        arrays[f"left_{number}"], arrays[f"left_scale_{number}"] = rounded(left[:, : len(root)] * root)
        arrays[f"right_{number}"], arrays[f"right_scale_{number}"] = rounded(right[: len(root)].T * root)
    np.savez_compressed(path, **arrays)


def main(folder, thicknesses=THICKNESSES):
    """Computes, keeps, and says how far what is kept is from CalculiX under patches of 3 to 12 mm anywhere. The
    derivatives are differences; by thickness on coarser meshes."""
    for thickness in thicknesses:

        def block_on(mesh, label, poisson=POISSON):
            return calculix.Block(mesh, poisson, loads.markers(), folder / f"{label}_{thickness}_{poisson}")

        block = block_on(calculix.deep(thickness), "deep")
        surface = surface_of(block)
        largest = abs(half_space(loads.markers(), np.zeros((2, 1)))).max()
        keep(kept_in(thickness), surface, rests(block), KEPT * largest)
        say(block.displacement, Influence(thickness), f"{thickness} mm")
        softer = POISSON + STEP["poisson"]
        coarse = calculix.coarse(thickness)
        thicker = calculix.thicker(thickness, 1e3 * STEP["thickness"], calculix.coarse)
        for by, other, straight, poisson, part in (
            ("poisson", block_on(calculix.deep(thickness), "deep", softer), block, softer, 0.2),
            ("thickness", block_on(thicker, "thicker"), block_on(coarse, "coarse"), POISSON, 80 / thickness),
        ):
            pairs = zip(rests(other, poisson), rests(straight))
            answers = ((a - b) / STEP[by] for a, b in pairs)
            keep(kept_in(thickness, by), surface_of(straight), answers, part * largest)

            def derivative(points, forces):
                return (other.displacement(points, forces) - straight.displacement(points, forces)) / STEP[by]

            say(derivative, Influence(thickness, by), f"    by {by}")


def say(true, kept, label):
    generator, lost = np.random.default_rng(20061), []
    for axis in np.tile(np.eye(3), (20, 1)):
        centre, radius = generator.uniform(-40e-3, 40e-3, 2), generator.uniform(1.5e-3, 6e-3)
        patch = loads.patch("hertz", centre, radius, axis)
        full = true(*patch)
        off = np.linalg.norm(kept.displacement(*patch) - full, axis=1) / np.linalg.norm(full, axis=1).max()
        lost.append((off.max(), np.sqrt(np.mean(off**2))))
    worst, usual = 100 * np.max(lost, 0)
    ranks = ", ".join(str(left.shape[1]) for left, _ in kept.parts)
    print(f"{label}: kept ({ranks}) within {worst:.3f} % of the peak, rms {usual:.4f} %", flush=True)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), [int(word) for word in sys.argv[2:]] or THICKNESSES)
