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
FINER = 0.8  # the tetrahedra that are cut into bricks, than those of the result


def available():
    """Raises a Problem if CalculiX is not installed."""
    if not shutil.which("ccx"):
        raise Problem("--check needs CalculiX, and there is no program ccx: install calculix-ccx")


def check(task, result, folder, say):
    """Says how far CalculiX's displacements of the markers are from the result's, for forces on a few nodes. Raises a Problem
    if they are farther than the error that is asked for."""
    count = result.weights.shape[0]
    chosen = np.sort(np.random.default_rng(SEED).choice(count, min(NODES, count), replace=False))
    points = result.weights[chosen].indices
    near = result.markers[scipy.spatial.cKDTree(result.markers).query(result.nodes[chosen], 8)[1].ravel()]
    with Body(task["shape"], folder, task.get("materials", [])) as body:
        bricks = body.bricks(FINER * result.size, np.concatenate([result.points[points], near]))
        loaded, read = bricks.weights(result.points[points]), bricks.weights(result.markers)
    say(f"CalculiX: {sum(map(len, bricks.parts))} bricks", False)
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
    own = result.influence[:, :, chosen].transpose(2, 3, 0, 1)
    off = np.linalg.norm(own - moved, axis=3) / np.linalg.norm(moved, axis=3).max(2, keepdims=True)
    for node, each in zip(chosen, off):
        row, column = divmod(int(node), task["nodes"]["columns"])
        mean, largest = 100 * np.sqrt((each**2).mean()), 100 * each.max()
        say(
            f"CalculiX, forces on the node in row {row}, column {column}: displacements differ by {mean:.2f} % of the peak, "
            f"largest {largest:.2f} %",
            False,
        )
    if 100 * off.max() > task["error_percent"]:
        raise Problem(
            f"CalculiX differs by {100 * off.max():.2f} % of the peak, and error_percent asks for "
            f"{task['error_percent']:g}; nothing was written"
        )
