"""Holds the influence against CalculiX, on bricks that are no part of the mesh that computed it."""

import pathlib
import shutil
import tempfile

import numpy as np
import scipy.spatial

from . import calculix
from .mesh import Body
from .problem import Problem

SEED, NODES = 20061, 3  # which nodes are loaded
FIRST = 0.8  # size of the first tetrahedra that are cut into bricks, of those of the result
FINER = 0.75  # their size from one mesh to the next
SURE = 1 / 3  # of the error that is asked for: what the last two meshes of bricks may differ by
GROWTH = 1.7  # of the number of bricks, from one mesh to the next
MOST_BRICKS = 60_000  # 12 GB


def available():
    """Raises a Problem if CalculiX is not installed."""
    if not shutil.which("ccx"):
        raise Problem("--check needs CalculiX, and there is no program ccx: install calculix-ccx")


def check(task, result, folder, say):
    """Says how far CalculiX's displacements of the markers are from the result's, for forces on a few nodes, on bricks that
    get smaller until their own displacements stay. Raises a Problem if they are farther than the error that is asked for."""
    count = result.weights.shape[0]
    chosen = np.sort(np.random.default_rng(SEED).choice(count, min(NODES, count), replace=False))
    asked, size, before = task["error_percent"], FIRST * result.size, None
    while True:
        moved, bricks = _by_calculix(task, result, chosen, size, folder)
        change = np.inf if before is None else 100 * _difference(before, moved).max()
        shown = "" if before is None else f", displacements differ from those of the larger bricks by {change:.2f} % of the peak"
        say(f"CalculiX: {bricks} bricks{shown}", False)
        if change <= SURE * asked:
            break
        if GROWTH * bricks > MOST_BRICKS:
            seen = f"has {bricks} bricks" if before is None else f"still changes displacements by {change:.2f} % of the peak"
            raise Problem(
                f"CalculiX cannot tell: its mesh {seen}, and a finer one would need too much memory: raise error_percent; "
                "nothing was written"
            )
        before, size = moved, FINER * size
    off = _difference(result.influence[:, :, chosen].transpose(2, 3, 0, 1), moved)
    for node, each in zip(chosen, off):
        row, column = divmod(int(node), task["nodes"]["columns"])
        mean, largest = 100 * np.sqrt((each**2).mean()), 100 * each.max()
        say(
            f"CalculiX, forces on the node in row {row}, column {column}: displacements differ by {mean:.2f} % of the peak, "
            f"largest {largest:.2f} %",
            False,
        )
    if 100 * off.max() > asked:
        raise Problem(
            f"CalculiX differs by {100 * off.max():.2f} % of the peak, and error_percent asks for {asked:g}; nothing was written"
        )


def _difference(one, other):
    """Of displacements (nodes x axes x markers x 3), as a part of each load's largest: nodes x axes x markers."""
    return np.linalg.norm(one - other, axis=3) / np.linalg.norm(other, axis=3).max(2, keepdims=True)


def _by_calculix(task, result, chosen, size, folder):
    """Displacements of the markers [m/N] under forces on the chosen nodes, nodes x axes x markers x 3, by bricks from
    tetrahedra of this size; and the number of bricks."""
    points = result.weights[chosen].indices
    near = result.markers[scipy.spatial.cKDTree(result.markers).query(result.nodes[chosen], 8)[1].ravel()]
    with Body(task["shape"], folder, task.get("materials", [])) as body:
        bricks = body.bricks(size, np.concatenate([result.points[points], near]))
        loaded, read = bricks.weights(result.points[points]), bricks.weights(result.markers)
    shares = result.weights[chosen][:, points] @ loaded
    rows = (shares[[row]] for row in range(len(chosen)))
    columns = [(row.indices + 1, np.outer(row.data, axis)) for row in rows for axis in np.eye(3)]
    tables = [task["material"], *task.get("materials", [])]
    elastic = [f"{1e-6 * table['youngs_modulus_pa']:.9g},{table['poisson_ratio']:.9g}" for table in tables]
    parts = [(part + 1, ["*ELASTIC", numbers]) for part, numbers in zip(bricks.parts, elastic)]
    used = np.unique(read.indices)
    with tempfile.TemporaryDirectory(prefix="traction-gel-") as name:
        try:
            stiffness = calculix.Stiffness(pathlib.Path(name), calculix.deck(bricks.positions, parts, bricks.bonded))
        except RuntimeError as error:
            raise Problem(str(error)) from None
        found = stiffness.solve(columns, used + 1)
    moved = 1e-3 * np.stack([read[:, used] @ one for one in found]).reshape(len(chosen), 3, -1, 3)
    return moved, sum(map(len, bricks.parts))
