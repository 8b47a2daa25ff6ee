"""From a description of a fingertip to its influences: meshes get finer until the estimated error is small enough."""

import dataclasses

import numpy as np
import scipy.sparse
import scipy.spatial

from . import geometry, mechanics, placement
from .mesh import Body
from .problem import Problem

FINER = 0.75  # the elements' size from one mesh to the next
MOST_UNKNOWNS = 450_000  # 12 GB
UNKNOWNS = 15  # of a tetrahedron, 13.5 in the limit
PLAIN = 3  # decision 61: at most 2.7 on a block
SAMPLED = 8  # nodes whose influence is compared between meshes


@dataclasses.dataclass
class Fingertip:
    """The result. Lengths in mm; influence and its errors in m/N. A node's force is spread over points by weights; `size`
    is that of the mesh."""

    nodes: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    points: np.ndarray
    weights: scipy.sparse.spmatrix
    markers: np.ndarray
    influence: np.ndarray
    errors: np.ndarray
    thickness: float
    error_percent: float
    size: float
    corners: np.ndarray
    free: np.ndarray
    bonded: np.ndarray
    between: np.ndarray


def estimated_error(coarse, fine, plain):
    """Largest difference of a marker's displacement between two meshes, as a part of the load's largest displacement.
    The finer mesh errs by less; of the markers `plain`, whose forces the elements carry, by less than PLAIN times it."""
    off = np.linalg.norm(coarse - fine, axis=1) * np.where(plain, PLAIN, 1)[:, None]
    return (off.max(0) / np.linalg.norm(fine, axis=1).max(0)).max()


def compute(task, folder, say):
    """\\param task a checked input (files.read)
    \\param folder which the names of files count from
    \\param say is called with text for people, and whether it replaces the line before
    """
    with Body(task["shape"], folder, task.get("materials", [])) as body:
        box = body.box()
        pitch = min(table["pitch_mm"] for table in [task["nodes"], *task["layers"]] if "pitch_mm" in table)
        say("surface", False)
        corners, free, bonded, between = body.surface(max(pitch / 3, (box[1] - box[0]).max() / 150))
        asked = task["shape"].get("bonded_percent", placement.LEAST_PERCENT)
        placement.check_bonded(corners, free, body.sides, bonded, between, asked, say)
        surface = placement.Surface(corners, free)
        nodes, normals, areas, points, weights = placement.nodes(surface, task["nodes"])
        markers, inward, names = placement.markers(surface, task["layers"])
        placement.check_inside(markers, names, corners, free, bonded)
        placement.check_seen(markers, inward, names, task["camera"])
        # Side walls may be as near as they like: nothing touches them.
        touched = scipy.spatial.cKDTree(points).query(corners[free].mean(axis=1))[0] < pitch
        shallowest = geometry.distances(markers, corners[free[touched] if touched.any() else free]).min()
        gel, error, size = _refined(body, task, markers, points, weights, shallowest, say)
        errors = _errors(body, task, size / FINER**2, markers, points, weights, say)

    def progress(part):
        say(f"influence of {len(nodes)} nodes on {len(markers)} markers: {100 * part:.0f} %", True)

    influence = gel.influence(markers, points, weights, progress)
    return Fingertip(
        nodes,
        normals,
        areas,
        points,
        weights,
        markers,
        influence * 1e3 / task["material"]["youngs_modulus_pa"],
        errors * 1e3 / task["material"]["youngs_modulus_pa"],
        float(box[1, 2]),
        100 * error,
        size,
        corners,
        free,
        bonded,
        between,
    )


def _refined(body, task, markers, points, weights, shallowest, say):
    """Returns the gel on the coarsest mesh whose estimated error is small enough, that error, and the mesh's size.

    \\param shallowest depth of a marker below the touched surface
    """
    fine = np.concatenate([points, markers])
    depth = scipy.spatial.cKDTree(points).query(markers)[0]
    size, before = max(depth.min(), 0.2 * np.median(depth)), None
    sampled = np.unique(np.linspace(0, weights.shape[0] - 1, SAMPLED).astype(int))
    few = markers[_nearest(markers, points, weights[sampled])]
    least = min(size, shallowest * np.cbrt(task["error_percent"]))  # the error falls with the size's cube
    _check_count(body.expected(least, fine, 20 * MOST_UNKNOWNS / UNKNOWNS), least, shallowest)
    while True:
        mesh = body.elements(size, fine)
        _check_count(mesh.nbcvs(), size, shallowest)  # thin parts need smaller elements than asked for
        gel = mechanics.Gel(mesh, materials(task))
        now = gel.influence(few, points, weights[sampled]).reshape(len(few), 3, -1)
        error = np.inf if before is None else estimated_error(before, now, gel.left_to_elements(few))
        shown = "" if before is None else f", estimated error {100 * error:.2f} % of the peak"
        say(f"mesh of {size:.2f} mm: {gel.unknowns} unknowns{shown}", False)
        if 100 * error <= task["error_percent"]:
            return gel, error, size
        if gel.unknowns / FINER**3 > MOST_UNKNOWNS:
            raise Problem(
                f"the estimated error is {100 * error:.2f} %, and error_percent asks for {task['error_percent']:g}: a finer "
                "mesh would need too much memory. Raise error_percent, or place markers deeper"
            )
        before, size = now, size * FINER


def _check_count(elements, size, shallowest):
    """Raises a Problem for more elements than memory has room for, expected or made."""
    if UNKNOWNS * elements > 2 * MOST_UNKNOWNS:
        raise Problem(
            f"a marker is {shallowest:.3g} mm below the touched surface, which asks for elements of {size:.3g} mm: at least "
            f"{elements:.0f} of them, and there is memory for {2 * MOST_UNKNOWNS // UNKNOWNS}. Place markers deeper, raise "
            "error_percent, and leave out parts much thinner than that. Are all lengths in millimetres?"
        )


def materials(task, more=()):
    """Young's modulus, as a multiple of the core's, and Poisson's ratio of each material, the core first.

    \\param more parts by which the moduli of [[materials]] are greater than stated
    """
    tables = [task["material"], *task.get("materials", [])]
    whole = task["material"]["youngs_modulus_pa"]
    more = [0, *more] if len(more) else [0] * len(tables)
    return [(table["youngs_modulus_pa"] / whole * (1 + part), table["poisson_ratio"]) for table, part in zip(tables, more)]


def _errors(body, task, size, markers, points, weights, say):
    """Returns the changes of the influence by a standard deviation of the bone's place along each axis and of each
    further material's modulus, K x M x 3 x N x 3, on a mesh of this size: a difference need not be as precise as what it
    is added to."""
    stated = task.get("deviations", {})
    count = len(task.get("materials", []))
    moved = [(step, np.zeros(count)) for step in np.diag(stated.get("bone_mm", [0, 0, 0])) if step.any()]
    moved += [(np.zeros(3), part) for part in np.diag(stated.get("youngs_modulus_relative", [0] * count)) if part.any()]
    mesh = body.elements(size, np.concatenate([points, markers])) if moved else None
    fields = []
    for number, (step, part) in enumerate([(np.zeros(3), np.zeros(count)), *moved] if moved else []):
        say(f"influence of what is not known: {100 * number / (len(moved) + 1):.0f} %", True)
        gel = mechanics.Gel(body.with_bone_at(mesh, step), materials(task, part))
        fields.append(gel.influence(markers, points, weights))
    return np.array([field - fields[0] for field in fields[1:]])


def _nearest(markers, points, weights):
    """Numbers of the markers nearest to each node, 8 of each."""
    centres = weights @ points
    order = np.argsort(np.linalg.norm(markers[None] - centres[:, None], axis=2), axis=1)
    return np.unique(order[:, :8])
