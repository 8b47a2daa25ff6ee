"""The gel's block in CalculiX (ccx), a finite-element program that shares nothing with tractiond.

The block is bonded at z = thickness and free elsewhere. Quadratic bricks with reduced integration (C3D20R), a quarter
of the block: its two mirror planes split every load into four classes. Class (a, b) has a = 1 where the field is its
own mirror image in x = 0, -1 where it is the negative of it; b likewise for y = 0. CalculiX assembles the stiffness
matrix, a sparse Cholesky factorisation (CHOLMOD) solves it for unit forces at the markers, and by the theorem of Maxwell
and Betti the displacements of the surface are those of the markers under forces on the surface.
Lengths in mm, forces in N, stresses in MPa.
"""

import os
import pathlib
import subprocess

import numpy as np

CLASSES = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
MIRRORS = [(0, 0), (1, 0), (0, 1), (1, 1)]

# Nodes of a brick in ccx's order, in halves of its edges from its corner nearest to the origin.
BRICK = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
         (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
         (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
FACE = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]


def serendipity(a, b):
    """Shape functions of the quadratic face's eight nodes at (a, b) in [-1, 1]: 8 x ..."""
    corners = [(1 + s * a) * (1 + t * b) * (s * a + t * b - 1) / 4 for s, t in [(-1, -1), (1, -1), (1, 1), (-1, 1)]]
    return np.array(corners + [(1 - a * a) * (1 - b) / 2, (1 + a) * (1 - b * b) / 2,
                               (1 - a * a) * (1 + b) / 2, (1 - a) * (1 - b * b) / 2])


def run_ccx(folder, name, lines, threads=2):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n")
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    result = subprocess.run(["ccx", name], cwd=folder, capture_output=True, text=True, env=environment)
    (folder / f"{name}.log").write_text(result.stdout + result.stderr)
    if result.returncode or "*ERROR" in result.stdout:
        raise RuntimeError(f"ccx failed: see {folder / name}.log")


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
        shape = serendipity(2 * (points[0] - x[i]) / (x[i + 1] - x[i]) - 1, 2 * (points[1] - y[j]) / (y[j + 1] - y[j]) - 1)
        return np.array([self.number[2 * i + s, 2 * j + t, 2 * layer] for s, t in FACE]), shape

    def deck(self, material):
        """Nodes, elements, material, bonded base. The elements' order is right-handed as x, y, z are."""
        lines = ["*NODE, NSET=ALL"]
        lines += [f"{n + 1},{p[0]:.9g},{p[1]:.9g},{p[2]:.9g}" for n, p in enumerate(self.positions)]
        lines.append("*ELEMENT, TYPE=C3D20R, ELSET=GEL")
        cells = np.stack(np.meshgrid(*[np.arange(len(axis) - 1) for axis in self.planes], indexing="ij"), -1).reshape(-1, 3)
        for element, (i, j, k) in enumerate(cells, 1):
            nodes = [str(self.number[2 * i + a, 2 * j + b, 2 * k + c]) for a, b, c in BRICK]
            lines += [f"{element}," + ",".join(nodes[:10]) + ",", ",".join(nodes[10:])]
        lines += ["*MATERIAL, NAME=RUBBER", *material, "*DENSITY", "1e-9",
                  "*SOLID SECTION, ELSET=GEL, MATERIAL=RUBBER", "*BOUNDARY"]
        lines += [f"{n + 1},1,3" for n in np.flatnonzero(self.base)]
        return lines


# Fine at the touched surface and where the bonded base meets the free sides; markers are at nodes.
BELOW_MARKERS = {15: [10, 12, 13.5, 14.5], 25: [11, 15, 19, 22, 24], 40: [11, 15, 20, 25, 30, 34, 37, 39]}


def fine(thickness):
    across = np.concatenate([np.arange(0, 36.1, 1.5), [38.5, 41.5, 44.5, 47.5, 49, 50]])
    return Mesh(across, across, [0, 1, 2, 3, 4.5, 6, 8, *BELOW_MARKERS[thickness], thickness])


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


class Block:
    """Marker displacements [m] under forces on the surface, for E = 0.18 MPa."""

    YOUNG = 0.18

    def __init__(self, mesh, poisson, markers, folder):
        """`markers`: 3 x M [m]. Computes for minutes, once; then reads `folder`."""
        self.mesh, self.folder = mesh, pathlib.Path(folder)
        images, self.mirrored = fold(1e3 * np.asarray(markers))
        self.images, self.image_of = np.unique(images.round(6), axis=1, return_inverse=True)
        self.row_of = np.full(len(mesh.positions) + 1, -1)
        self.row_of[mesh.surface] = np.arange(len(mesh.surface))
        if not (self.folder / "operator.npy").exists():
            self._compute(poisson)
        self.operator = np.load(self.folder / "operator.npy", mmap_mode="r")  # class, marker image, 3, surface node, 3

    def _compute(self, poisson):
        material = ["*ELASTIC", f"{self.YOUNG},{poisson}"]
        run_ccx(self.folder, "block", self.mesh.deck(material) +
                ["*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "1", "*END STEP"])
        entries = np.fromfile(self.folder / "block.sti", sep=" ").reshape(-1, 3)
        dofs = np.array([line.split(".") for line in (self.folder / "block.dof").read_text().split()], int)
        i, j = entries[:, 0].astype(int) - 1, entries[:, 1].astype(int) - 1
        values = entries[:, 2]
        for name in ("sti", "mas"):
            (self.folder / f"block.{name}").unlink()
        count = self.images.shape[1]
        operator = np.zeros((4, count, 3, len(self.mesh.surface), 3), np.float32)
        nodes, shape = self.mesh.weights(self.images)
        for index, parity in enumerate(CLASSES):
            free = np.ones((len(self.mesh.positions) + 1, 4), bool)
            for axis in (0, 1):
                across = axis + 1
                for component in [across] if parity[axis] == 1 else [c for c in (1, 2, 3) if c != across]:
                    free[self.mesh.on_plane(axis), component] = False
            kept = free[dofs[:, 0], dofs[:, 1]]
            new = np.cumsum(kept) - 1
            unknown = np.full((len(self.mesh.positions) + 1, 4), -1)
            unknown[dofs[kept, 0], dofs[kept, 1]] = new[kept]
            inside = kept[i] & kept[j]
            self._solve(kept.sum(), new[i[inside]], new[j[inside]], values[inside], unknown, nodes, shape, operator[index])
        np.save(self.folder / "operator.npy", operator)

    def _solve(self, size, i, j, values, unknown, nodes, shape, result):
        row, column = np.maximum(i, j), np.minimum(i, j)
        order = np.lexsort((row, column))
        np.concatenate([[0], np.cumsum(np.bincount(column, minlength=size))]).astype(np.int32).tofile(self.folder / "columns")
        row[order].astype(np.int32).tofile(self.folder / "rows")
        values[order].tofile(self.folder / "values")
        ends, rows, weights = [0], [], []
        for image in range(nodes.shape[1]):
            for component in (1, 2, 3):
                at = unknown[nodes[:, image], component]
                used = (at >= 0) & (shape[:, image] != 0)
                rows.append(at[used])
                weights.append(shape[used, image])
                ends.append(ends[-1] + used.sum())
        np.array(ends, np.int32).tofile(self.folder / "right_columns")
        np.concatenate(rows).astype(np.int32).tofile(self.folder / "right_rows")
        np.concatenate(weights).tofile(self.folder / "right_values")
        read = unknown[self.mesh.surface][:, 1:]
        read[read >= 0].astype(np.int32).tofile(self.folder / "output")
        solver = self.folder.parent / "sparse_solver"
        if not solver.exists():
            source = pathlib.Path(__file__).parent / "sparse_solver.cpp"
            subprocess.run(["c++", "-std=c++20", "-O2", "-I/usr/include/eigen3", "-I/usr/include/suitesparse", source,
                            "-lcholmod", "-o", solver], check=True)
        subprocess.run([solver, self.folder], check=True)
        solution = np.fromfile(self.folder / "solution").reshape(nodes.shape[1], 3, -1)
        result[:, :, read >= 0] = solution
        for name in ("columns", "rows", "values", "right_columns", "right_rows", "right_values", "output", "solution"):
            (self.folder / name).unlink()

    def displacement(self, points, forces):
        """M x 3 [m]. `points`: 2 x P or 3 x P [m] on the surface, `forces`: 3 x P [N]."""
        points = np.vstack([1e3 * np.asarray(points)[:2], np.zeros(np.shape(points)[1])])
        images, mirrored = fold(points)
        nodes, shape = self.mesh.weights(images)
        result = np.zeros((3, self.mirrored.shape[1]))
        for index, parity in enumerate(CLASSES):
            character, turn = signs(mirrored, parity)
            folded = 0.25 * character * turn * np.asarray(forces)
            load = np.zeros((len(self.mesh.surface), 3))
            for node, weight in zip(nodes, shape):
                np.add.at(load, self.row_of[node], (weight * folded).T)
            used = np.flatnonzero(load.any(1))
            moved = np.einsum("qcnd,nd->qc", self.operator[index][:, :, used], load[used])
            character, turn = signs(self.mirrored, parity)
            result += character * turn * moved[self.image_of].T
        return 1e-3 * result.T
