"""The gel's block in CalculiX (ccx), a finite-element program that shares nothing with tractiond.

The block is bonded at z = thickness and free elsewhere. Quadratic bricks with reduced integration (C3D20R), a quarter
of the block: its two mirror planes split every load into four classes. Class (a, b) has a = 1 where the field is its
own mirror image in x = 0, -1 where it is the negative of it; b likewise for y = 0. CalculiX assembles the stiffness
matrix, a sparse Cholesky factorisation (CHOLMOD) solves it for unit forces at the markers, and by the theorem of
Maxwell and Betti the displacements of the surface are those of the markers under forces on the surface.
Lengths in mm, forces in N, stresses in MPa.
"""

import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "gel"))
import traction_gel.calculix  # noqa: E402
from traction_gel.calculix import deck, run  # noqa: E402

CLASSES = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
MIRRORS = [(0, 0), (1, 0), (0, 1), (1, 1)]

# Nodes of a brick in ccx's order, in halves of its edges from its corner nearest to the origin: corners, middles of edges.
BRICK = [
    (0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
    (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
    (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1),
]
FACE = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]


def serendipity(a, b):
    """Shape functions of the quadratic face's eight nodes at (a, b) in [-1, 1]: 8 x ..."""
    corners = [(1 + s * a) * (1 + t * b) * (s * a + t * b - 1) / 4 for s, t in [(-1, -1), (1, -1), (1, 1), (-1, 1)]]
    return np.array(
        corners
        + [(1 - a * a) * (1 - b) / 2, (1 + a) * (1 - b * b) / 2, (1 - a * a) * (1 + b) / 2, (1 - a) * (1 - b * b) / 2]
    )


class Mesh:
    """Bricks between the planes x, y, z [mm]; the first z is the touched surface, the last the bonded base."""

    def __init__(self, x, y, z):
        self.planes = [np.asarray(axis, float) for axis in (x, y, z)]
        self.halves = [np.sort(np.concatenate([axis, (axis[1:] + axis[:-1]) / 2])) for axis in self.planes]
        i, j, k = np.meshgrid(*[np.arange(len(axis)) for axis in self.halves], indexing="ij")
        exists = (i % 2 + j % 2 + k % 2) <= 1
        self.number = np.where(exists, np.cumsum(exists).reshape(exists.shape), 0)  # from 1; 0: no such node
        self.lattice = np.stack([i[exists], j[exists], k[exists]], 1)
        self.positions = np.stack([self.halves[axis][self.lattice[:, axis]] for axis in range(3)], 1)
        self.surface = self.number[:, :, 0][self.number[:, :, 0] > 0]
        self.base = self.lattice[:, 2] == len(self.halves[2]) - 1

    def on_plane(self, axis):
        """Numbers of the nodes on the mirror plane where this axis is 0, but for the base's."""
        return np.flatnonzero((self.positions[:, axis] == 0) & ~self.base) + 1

    def weights(self, points):
        """Nodes and shape functions on the layer z of each point (3 x P, mm), a plane between bricks: 8 x P each."""
        x, y, z = self.planes
        layer = np.searchsorted(z, points[2] - 1e-9)
        assert np.allclose(z[layer], points[2])
        i = np.clip(np.searchsorted(x, points[0], side="right") - 1, 0, len(x) - 2)
        j = np.clip(np.searchsorted(y, points[1], side="right") - 1, 0, len(y) - 2)
        shape = serendipity(
            2 * (points[0] - x[i]) / (x[i + 1] - x[i]) - 1, 2 * (points[1] - y[j]) / (y[j + 1] - y[j]) - 1
        )
        return np.array([self.number[2 * i + s, 2 * j + t, 2 * layer] for s, t in FACE]), shape

    def deck(self, material):
        cells = np.stack(np.meshgrid(*[np.arange(len(axis) - 1) for axis in self.planes], indexing="ij"), -1).reshape(
            -1, 3
        )
        bricks = [[self.number[2 * i + a, 2 * j + b, 2 * k + c] for a, b, c in BRICK] for i, j, k in cells]
        return deck(self.positions, [(bricks, material)], self.base)


# Fine at the touched surface and where the bonded base meets the free sides; markers are at nodes.
BELOW_MARKERS = {15: [10, 12, 13.5, 14.5], 25: [11, 15, 19, 22, 24], 40: [11, 15, 20, 25, 30, 34, 37, 39]}


def fine(thickness):
    across = np.concatenate([np.arange(0, 36.1, 1.5), [38.5, 41.5, 44.5, 47.5, 49, 50]])
    return Mesh(across, across, [0, 1, 2, 3, 4.5, 6, 8, *BELOW_MARKERS[thickness], thickness])


def deep(thickness):
    """fine() with layers of 1 mm above the markers, for the influence of points close above them: fine() errs by up to
    0.4 % of the peak there, this by 0.1."""
    x, y, z = fine(thickness).planes
    return Mesh(x, y, np.unique(np.concatenate([np.arange(0, 9), z[z > 8]])))


def thicker(thickness, by, mesh=fine):
    """A mesh, stretched below the markers."""
    x, y, z = mesh(thickness).planes
    return Mesh(x, y, np.where(z > 8, 8 + (z - 8) * (thickness + by - 8) / (thickness - 8), z))


def around_markers(thickness, by):
    """fine() with planes so much above and below the markers."""
    x, y, z = fine(thickness).planes
    return Mesh(x, y, np.unique(np.concatenate([z, [6 - by, 6 + by, 8 - by, 8 + by]])))


def coarse(thickness):
    """About twice as coarse. The blue markers are not at its nodes."""
    across = np.concatenate([np.arange(0, 36.1, 3), [41.5, 47.5, 50]])
    return Mesh(across, across, [0, 2, 4, 6, 8, *BELOW_MARKERS[thickness][1::2], thickness])


def fold(points):
    """The mirror images in the quarter, and which mirrors lead there (2 x P of 0 and 1)."""
    mirrored = (points[:2] < 0).astype(int)
    return np.vstack([abs(points[:2]), points[2:]]), mirrored


def signs(mirrored, parity):
    """The class's sign of each image (P), and what the mirrors do to a vector there (3 x P)."""
    character = np.where(mirrored[0], parity[0], 1) * np.where(mirrored[1], parity[1], 1)
    return character, np.vstack([1 - 2 * mirrored, np.ones(mirrored.shape[1], int)])


class Stiffness(traction_gel.calculix.Stiffness):
    """A mesh's stiffness matrix, assembled by CalculiX."""

    YOUNG = 0.18

    def __init__(self, mesh, poisson, folder):
        self.mesh = mesh
        super().__init__(folder, mesh.deck(["*ELASTIC", f"{self.YOUNG},{poisson}"]))

    def solve(self, parity, columns, read):
        """Displacement [mm] of the nodes `read` in a class, columns x nodes x 3. A column is a load: nodes and their
        forces, K x 3 [N]."""
        free = np.ones((len(self.mesh.positions) + 1, 4), bool)
        for axis in (0, 1):
            across = axis + 1
            for component in [across] if parity[axis] == 1 else [c for c in (1, 2, 3) if c != across]:
                free[self.mesh.on_plane(axis), component] = False
        return super().solve(columns, read, free)


class Images:
    """Markers (3 x M, m) as mirror images of fewer points in the quarter."""

    def __init__(self, mesh, markers):
        points, self.mirrored = fold(1e3 * np.asarray(markers))
        self.points, self.of = np.unique(points.round(6), axis=1, return_inverse=True)
        self.nodes, self.shape = mesh.weights(self.points)

    def unfold(self, parity, moved):
        """From the quarter's displacement in a class, points x 3, that of all markers, M x 3."""
        character, turn = signs(self.mirrored, parity)
        return (character * turn * moved[self.of].T).T


def folded_load(mesh, points, forces, parity):
    """Nodal forces of a class on the quarter's surface: numbers of all nodes + 1 rows x 3. Points 2 x P [m]."""
    images, mirrored = fold(np.vstack([1e3 * np.asarray(points), np.zeros(np.shape(points)[1])]))
    character, turn = signs(mirrored, parity)
    folded = 0.25 * character * turn * np.asarray(forces)
    nodes, shape = mesh.weights(images)
    load = np.zeros((len(mesh.positions) + 1, 3))
    for node, weight in zip(nodes, shape):
        np.add.at(load, node, (weight * folded).T)
    return load


class Block:
    """Marker displacements under any forces on the surface, by Maxwell and Betti's theorem from unit forces at the
    markers. For E = 0.18 MPa."""

    def __init__(self, mesh, poisson, markers, folder):
        """`markers`: 3 x M [m]. Computes for minutes, once; then reads `folder`."""
        self.mesh, self.images = mesh, Images(mesh, markers)
        operator = pathlib.Path(folder) / "operator.npy"
        if not operator.exists():
            stiffness = Stiffness(mesh, poisson, operator.parent)
            units = [
                (nodes, np.outer(shape, axis))
                for nodes, shape in zip(self.images.nodes.T, self.images.shape.T)
                for axis in np.eye(3)
            ]
            np.save(
                operator,
                np.array([stiffness.solve(parity, units, mesh.surface) for parity in CLASSES], np.float32).reshape(
                    4, -1, 3, len(mesh.surface), 3
                ),
            )
        self.operator = np.load(operator, mmap_mode="r")  # class, marker image, 3, surface node, 3

    def displacement(self, points, forces):
        """M x 3 [m]. `points`: 2 x P [m] on the surface, `forces`: 3 x P [N]."""
        result = 0.0
        for parity, operator in zip(CLASSES, self.operator):
            load = folded_load(self.mesh, points, forces, parity)[self.mesh.surface]
            used = np.flatnonzero(load.any(1))
            result = result + self.images.unfold(parity, np.einsum("qcnd,nd->qc", operator[:, :, used], load[used]))
        return 1e-3 * result


def few_loads(mesh, poisson, markers, load_list, folder):
    """The same for a few loads (points, forces), loads x M x 3 [m]: quicker than a Block."""
    stiffness, images = Stiffness(mesh, poisson, folder), Images(mesh, markers)
    read = np.unique(images.nodes)
    result = 0.0
    for parity in CLASSES:
        columns = []
        for points, forces in load_list:
            load = folded_load(mesh, points, forces, parity)
            used = np.flatnonzero(load.any(1))
            columns.append((used, load[used]))
        moved = np.zeros((len(load_list), len(mesh.positions) + 1, 3))
        moved[:, read] = stiffness.solve(parity, columns, read)
        quarter = np.einsum("kq,lkqc->lqc", images.shape, moved[:, images.nodes])
        result = result + np.array([images.unfold(parity, one) for one in quarter])
    return 1e-3 * result


def around_centre(thickness):
    across = np.concatenate([np.arange(0, 12.1, 1.5), np.arange(15, 36.1, 3), [41.5, 47.5, 50]])
    return Mesh(across, across, [0, 1, 2, 3, 4.5, 6, 8, 11, 15, 20, 27, 34, 38, thickness])


def for_large_strain(thickness, half_width):
    """Elements that bear being deformed; with `half_width` the mirror plane x = 0 is not used."""
    across = np.concatenate([np.arange(0, 36.1, 3), [41.5, 47.5, 50]])
    return Mesh(
        np.concatenate([-across[:0:-1], across]) if half_width else across,
        across,
        [0, 3, 6, 8, 11, 15, 20, 27, 34, 38, thickness],
    )


def at_centre(thickness):
    """For loads near the centre of a 40 mm block: fine below them, and at the base's edge."""
    across = np.concatenate([np.arange(0, 7.6, 0.75), [9, 10.5, 12], np.arange(15, 36.1, 3), [41, 45.5, 48.5, 50]])
    return Mesh(across, across, [0, 0.75, 1.5, 2.25, 3, 4, 5, 6, 7, 8, 10, 13, 17, 22, 27, 32, 36, 38.5, thickness])


def under_ball(thickness):
    """at_centre() still finer, for how the surface itself moves under a ball of some millimetres there."""
    x, y, z = at_centre(thickness).planes
    across = np.concatenate([np.arange(0, 6.1, 0.5), [6.75, 7.5], x[x > 8]])
    return Mesh(across, across, np.concatenate([np.arange(0, 2.1, 0.5), [2.75, 3.5, 4.25], z[z > 4.5]]))


def static(mesh, parity, material, steps, markers, folder, name, large=False, extra=()):
    """Displacements [m], steps x M x 3, in CalculiX alone, of loads (points 2 x P [m], forces 3 x P [N]) one by one.
    parity[axis] 1: mirror plane; 0: the mesh spans it. Loads and fields have the symmetry that is assumed. With large
    deformations it may end early: the loads that were reached."""
    lines = mesh.deck(material)
    for axis in (0, 1):
        if parity[axis]:
            lines += [f"{n},{axis + 1},{axis + 1}" for n in mesh.on_plane(axis)]
    planes = mesh.number[:, :, np.isin(mesh.halves[2], (6, 8))]
    lines += ["*NSET, NSET=MARKERS", *map(str, planes[planes > 0]), *extra]
    for points, forces in steps:
        lines += [f"*STEP{', NLGEOM, INC=1000' if large else ''}", "*STATIC, SOLVER=SPOOLES"] + (
            ["0.25, 1.0, 1e-4"] if large else []
        )
        if points is None:
            lines += ["*TEMPERATURE", "ALL, 1.0"]
        else:
            images, _ = fold(np.vstack([1e3 * points, np.zeros(points.shape[1])]))
            shares = np.array(forces) / 2 ** sum(map(bool, parity))
            for axis in (0, 1):
                if not parity[axis]:
                    images[axis] = 1e3 * points[axis]
            nodes, shape = mesh.weights(images)
            load = np.zeros((len(mesh.positions) + 1, 3))
            for node, weight in zip(nodes, shape):
                np.add.at(load, node, (weight * shares).T)
            lines += ["*CLOAD, OP=NEW"]
            lines += [
                f"{n},{c + 1},{load[n, c]:.9e}" for n in np.flatnonzero(load.any(1)) for c in range(3) if load[n, c]
            ]
        lines += ["*NODE PRINT, NSET=MARKERS, FREQUENCY=1000", "U", "*END STEP"]
    if not (folder / f"{name}.finished").exists():
        run(folder, name, lines, may_end_early=large)
        (folder / f"{name}.finished").touch()
    images, mirrored = fold(1e3 * np.asarray(markers))
    turn = np.vstack([1 - 2 * mirrored, np.ones(mirrored.shape[1], int)])
    for axis in (0, 1):
        if not parity[axis]:
            images[axis], turn[axis] = 1e3 * markers[axis], 1
    nodes, shape = mesh.weights(images)
    result, moved = [], None
    for line in (folder / f"{name}.dat").read_text().splitlines():
        words = line.split()
        if words[:1] == ["displacements"]:
            moved = np.zeros((len(mesh.positions) + 1, 3))
            result.append(moved)
        elif len(words) == 4 and moved is not None:
            moved[int(words[0])] = [float(word) for word in words[1:]]
    return np.array([1e-3 * np.einsum("km,kmc->mc", shape, moved[nodes]) * turn.T for moved in result])
