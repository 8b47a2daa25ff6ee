"""CalculiX (ccx), a finite-element program that shares nothing with this one, assembles the stiffness of bricks.

Bricks have 20 nodes and reduced integration (C3D20R). Lengths in mm, forces in N, stresses in MPa.
"""

import os
import subprocess

import numpy as np

BATCH = 48  # right-hand sides at a time


def run(folder, name, lines, threads=2, may_end_early=False):
    """Runs NAME.inp of these lines in the folder. Raises RuntimeError if CalculiX finds an error."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n")
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    result = subprocess.run(["ccx", name], cwd=folder, capture_output=True, text=True, env=environment)
    (folder / f"{name}.log").write_text(result.stdout + result.stderr)
    if (result.returncode or "*ERROR" in result.stdout) and not may_end_early:
        errors = " ".join(line.strip() for line in result.stdout.splitlines() if "*ERROR" in line)
        raise RuntimeError(f"CalculiX (ccx) failed on {name}.inp: {errors[:200]}")


def deck(positions, parts, base):
    """Lines of nodes (P x 3), of parts, each its bricks (20 numbers of nodes from 1 each, right-handed) and the lines of its
    material, and of the bonded nodes (P)."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n + 1},{p[0]:.9g},{p[1]:.9g},{p[2]:.9g}" for n, p in enumerate(positions)]
    element = 0
    for number, (bricks, material) in enumerate(parts):
        lines.append(f"*ELEMENT, TYPE=C3D20R, ELSET=PART{number}")
        for nodes in bricks:
            element += 1
            nodes = list(map(str, nodes))
            lines += [f"{element}," + ",".join(nodes[:10]) + ",", ",".join(nodes[10:])]
        lines += [f"*MATERIAL, NAME=RUBBER{number}", *material, "*DENSITY", "1e-9"]
        lines += [f"*SOLID SECTION, ELSET=PART{number}, MATERIAL=RUBBER{number}"]
    return [*lines, "*BOUNDARY", *(f"{n + 1},1,3" for n in np.flatnonzero(base))]


class Stiffness:
    """The stiffness matrix of a deck. Its unknowns are `dofs`: numbers of a node, from 1, and of an axis, from 1."""

    def __init__(self, folder, lines):
        import scipy.sparse  # decks do not need it

        run(folder, "gel", [*lines, "*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "1", "*END STEP"])
        entries = np.fromfile(folder / "gel.sti", sep=" ").reshape(-1, 3)
        self.dofs = np.array([line.split(".") for line in (folder / "gel.dof").read_text().split()], int)
        row, column = np.sort(entries[:, :2].astype(int) - 1, axis=1).T[::-1]
        self.lower = scipy.sparse.csc_matrix((entries[:, 2], (row, column)), shape=2 * [len(self.dofs)])
        for name in ("gel.sti", "gel.mas"):
            (folder / name).unlink()

    def solve(self, columns, read, free=None):
        """Displacements [mm] of the nodes `read`, columns x nodes x 3, under loads: the numbers of nodes, and their forces,
        K x 3 [N]. `free`: whether an axis (from 1) of a node (from 1) can move; if not given, all but the bonded."""
        from .cholesky import Factor

        kept = np.ones(len(self.dofs), bool) if free is None else free[self.dofs[:, 0], self.dofs[:, 1]]
        size = 1 + max(self.dofs[:, 0].max(), max(read), *(nodes.max() for nodes, _ in columns))
        unknown = np.full((size, 4), -1)
        unknown[tuple(self.dofs[kept].T)] = np.arange(kept.sum())
        factor, target = Factor(self.lower[kept][:, kept]), unknown[read][:, 1:]
        result = np.zeros((len(columns), len(read), 3))
        for first in range(0, len(columns), BATCH):
            some = columns[first : first + BATCH]
            right = np.zeros((kept.sum(), len(some)))
            for column, (nodes, forces) in enumerate(some):
                at = unknown[nodes][:, 1:]
                np.add.at(right[:, column], at[at >= 0], np.asarray(forces)[at >= 0])
            result[first : first + BATCH, target >= 0] = factor.solve(right)[target[target >= 0]].T
        return result
