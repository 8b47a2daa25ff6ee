"""The shipped hemispherical fingertip in CalculiX (ccx), by bricks that share nothing with traction-gel.

A shell of gel over a rigid bone: a hemisphere whose tip is the origin, on a cylinder along z. Quadratic bricks with
reduced integration; the surface is six faces of a cube drawn on a ball, of which five halves are the hemisphere, and
rings of the cylinder behind it. Lengths in mm, forces in N, stresses in MPa, for calculix.Stiffness.
"""

import pathlib
import tomllib

import numpy as np

import calculix

HERE = pathlib.Path(__file__).resolve()
KEPT = HERE.parent / "data" / "fingertip.npz"
DESCRIPTION = tomllib.loads((HERE.parents[2] / "gel" / "fingertip.toml").read_text())

# What is kept: random patches, then pairs, then some nodes' areas.
RANDOM, MOST_POLAR, RADII = 80, 60, (1, 3)  # number, degrees from the pole, mm
PAIRS_MM, PAIRS_EACH = [3, 4, 5, 6, 8], 4
NODES = 3  # along each side of the grid
BONE_MM = 0.1  # of the bone's place, for derivatives twice as much

RADIUS, BONE, LENGTH = 10.0, 6.0, 8.0  # of gel and bone, of the cylinder
MARKERS = 8.0  # radius of the surface that they are on
# Direction of a face's middle and of its two sides: the tip first, then four halves around it.
FACES = [((0, 0, -1), (1, 0, 0), (0, 1, 0))] + [
    (middle, (0, 0, 1), tuple(np.cross((0, 0, 1), middle))) for middle in ((1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0))
]
FACES = np.array(FACES, float)


def on_face(face, a, b):
    """Unit vectors at angles of a and b quarter turns [-0.5, 0.5] on a face."""
    middle, one, two = FACES[face]
    at = middle + np.tan(np.pi / 2 * np.asarray(a))[..., None] * one + np.tan(np.pi / 2 * np.asarray(b))[..., None] * two
    return at / np.linalg.norm(at, axis=-1, keepdims=True)


def faces_of(directions):
    """The face of each direction (P x 3), and a, b of on_face()."""
    along = directions @ FACES[:, 0].T
    face = along.argmax(1)
    depth = along[np.arange(len(face)), face]
    a, b = (np.arctan(np.einsum("pk,pk->p", directions, FACES[face, side]) / depth) * 2 / np.pi for side in (1, 2))
    return face, a, b


class Finger:
    """Bricks of the gel; as calculix.Mesh, without mirror planes."""

    def __init__(self, across, depths, bone=(0, 0, 0)):
        """\\param across bricks along a quarter turn, even \\param depths of the planes between them, 0 to 4 mm
        \\param bone how far the bone sits beside its place
        """
        self.across, self.depths = across, np.asarray(depths, float)
        # The surface's corners and middles of edges: directions from the ball's middle, and (cos, sin, part of LENGTH).
        keys, flat, cells = {}, [], []

        def number(place):
            key = tuple(np.round(place, 9) + 0.0)
            if key not in keys:
                keys[key] = len(flat)
                flat.append(key)
            return keys[key]

        def patch(places):
            """Adds the cells of a lattice of halves, I x J x 3. Returns the eight nodes of each."""
            numbers = [
                [-1 if i % 2 and j % 2 else number(place) for j, place in enumerate(row)] for i, row in enumerate(places)
            ]
            sides = range(0, len(numbers) - 2, 2), range(0, len(numbers[0]) - 2, 2)
            added = [[[numbers[i + s][j + t] for s, t in calculix.FACE] for j in sides[1]] for i in sides[0]]
            cells.extend(cell for row in added for cell in row)
            return np.array(added)

        step = np.linspace(-0.5, 0.5, 2 * across + 1)
        self.lattice = []
        for face in range(5):
            a = step if face == 0 else step[: across + 1]
            self.lattice.append(patch(on_face(face, *np.meshgrid(a, step, indexing="ij"))))
        for face in range(1, 5):
            ring = on_face(face, np.zeros_like(step), step)
            patch([[(x, y, part) for x, y, _ in ring] for part in np.linspace(0, 1, 2 * (across // 3) + 1)])
        flat = np.array(flat)
        planes = np.sort(np.concatenate([self.depths, (self.depths[1:] + self.depths[:-1]) / 2]))
        corner = np.zeros(len(flat), bool)
        corner[np.array(cells)[:, :4]] = True
        exists = (np.arange(len(planes)) % 2 == 0) | corner[:, None]
        self.number = np.where(exists, np.cumsum(exists).reshape(exists.shape), 0)
        who, level = np.nonzero(exists)
        x, y, z = flat[who].T
        outward = np.column_stack([x, y, np.minimum(z, 0)])
        depth = planes[level]
        part = np.maximum(depth - (RADIUS - MARKERS), 0) / (MARKERS - BONE)  # markers stay where they are
        axis = np.column_stack([0 * z, 0 * z, RADIUS + LENGTH * np.maximum(z, 0)])
        self.positions = axis + (RADIUS - depth)[:, None] * outward + np.outer(part, bone)
        self.base = level == len(planes) - 1
        self.surface = self.number[:, 0][self.number[:, 0] > 0]
        self.bricks = []
        for cell in cells:
            for k in range(0, len(planes) - 2, 2):
                top, bottom = [self.number[cell, k], self.number[cell, k + 2]]
                between = self.number[cell[:4], k + 1]
                self.bricks.append(np.concatenate([top[:4], bottom[:4], top[4:], bottom[4:], between]))

    def on_plane(self, axis):
        return []

    def deck(self, material):
        return calculix.deck(self.positions, [(self.bricks, material)], self.base)

    def weights(self, directions, depth):
        """Nodes and shape functions at directions (P x 3) from the ball's middle, on a plane between bricks: 8 x P each."""
        plane = 2 * int(np.flatnonzero(np.isclose(self.depths, depth))[0])
        face, a, b = faces_of(directions)
        nodes, shape = np.empty((8, len(face)), int), np.empty((8, len(face)))
        for which in range(5):
            here = face == which
            lattice = self.lattice[which]
            at = [(part[here] + 0.5) * self.across for part in (a, b)]
            cell = [np.clip(each.astype(int), 0, size - 1) for each, size in zip(at, lattice.shape)]
            nodes[:, here] = self.number[lattice[cell[0], cell[1]], plane].T
            shape[:, here] = calculix.serendipity(*(2 * (each - first) - 1 for each, first in zip(at, cell)))
        return nodes, shape


def wrapped(plane, radius=RADIUS):
    """Directions from the ball's middle of points of a flat sheet (P x 2 [mm]) that is wrapped on a ball about the tip."""
    distance = np.hypot(*np.transpose(plane))
    angle, turn = distance / radius, np.arctan2(plane[:, 1], plane[:, 0])
    return np.column_stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), -np.cos(angle)])


def patch(direction, radius, rings=10):
    """A round contact's pressure as under a ball, about a direction: directions (P x 3), shares (P)."""
    t, w = np.polynomial.legendre.leggauss(rings)
    t, w = (t + 1) / 2, w / 2
    turns = 2 * np.pi * (np.arange(4 * rings) + 0.5) / (4 * rings)
    angle = np.repeat(radius * np.sqrt(1 - t**2) / RADIUS, len(turns))
    share = np.repeat(3 * t**2 * w / len(turns), len(turns))
    turn = np.tile(turns, rings)
    one = np.cross(direction, [0, 1.0, 0] if abs(direction[1]) < 0.7 else [1.0, 0, 0])
    one /= np.linalg.norm(one)
    around = np.cos(turn)[:, None] * one + np.sin(turn)[:, None] * np.cross(direction, one)
    return np.cos(angle)[:, None] * direction + np.sin(angle)[:, None] * around, share / share.sum()


def moved(mesh, patches, markers, folder, poisson=0.49):
    """Displacements [m/N] of markers (directions, M x 3) under forces along x, y, z on patches: patches x 3 x M x 3. For
    E = 0.18 MPa."""
    stiffness = calculix.Stiffness(mesh, poisson, folder)
    columns = []
    for directions, share in patches:
        nodes, shape = mesh.weights(directions, 0)
        load = np.zeros(len(mesh.positions) + 1)
        np.add.at(load, nodes, shape * share)
        used = np.flatnonzero(load)
        columns += [(used, np.outer(load[used], axis)) for axis in np.eye(3)]
    nodes, shape = mesh.weights(markers, RADIUS - MARKERS)
    read, at = np.unique(nodes, return_inverse=True)
    found = stiffness.solve((0, 0), columns, read)
    found = np.einsum("km,lkmc->lmc", shape, found[:, at.reshape(nodes.shape)])
    return 1e-3 * found.reshape(len(patches), 3, len(markers), 3)


def fine():
    return Finger(30, [0, 0.35, 0.7, 1.05, 1.5, 2, 2.5, 3, 3.5, 4])


def coarse(bone=(0, 0, 0)):
    """Bricks twice as large; errs by 2 % of the peak at most."""
    return Finger(14, [0, 0.6, 1.3, 2, 3, 4], bone)


def grid(table):
    """As in traction-gel: x, y of a flat grid's points [mm]."""
    axes = [table["pitch_mm"] * (np.arange(table[side]) - (table[side] - 1) / 2) for side in ("columns", "rows")]
    return np.stack(np.meshgrid(*axes), -1).reshape(-1, 2)


def marker_directions():
    return wrapped(grid(DESCRIPTION["layers"][0]), MARKERS)


def sampled_nodes():
    """Numbers of the nodes whose areas are among the loads."""
    columns, rows = DESCRIPTION["nodes"]["columns"], DESCRIPTION["nodes"]["rows"]
    along, across = (np.linspace(1, size - 2, NODES).round().astype(int) for size in (rows, columns))
    return (along[:, None] * columns + across).ravel()


def node_areas():
    """As patch(), of sampled_nodes(): the points on which traction-gel spreads a node's force."""
    table = DESCRIPTION["nodes"]
    part = table["pitch_mm"] * ((np.arange(4) + 0.5) / 4 - 0.5)
    inside = np.stack(np.meshgrid(part, part), -1).reshape(-1, 2)
    return [(wrapped(centre + inside), np.full(16, 1 / 16)) for centre in grid(table)[sampled_nodes()]]


def catalogue():
    """Directions and radii [mm] of the round patches."""
    generator = np.random.default_rng(20061)
    height, turn = generator.uniform(np.cos(np.radians(MOST_POLAR)), 1, RANDOM), generator.uniform(0, 2 * np.pi, RANDOM)
    flat = np.sqrt(1 - height**2)
    found = list(np.column_stack([flat * np.cos(turn), flat * np.sin(turn), -height]))
    for distance in PAIRS_MM:
        for _ in range(PAIRS_EACH):
            middle, turn = wrapped(generator.uniform(-4, 4, (1, 2)))[0], generator.uniform(0, 2 * np.pi)
            aside = np.cross(middle, [np.cos(turn), np.sin(turn), 0])
            aside /= np.linalg.norm(aside)
            half = distance / 2 / RADIUS
            found += [np.cos(half) * middle + side * np.sin(half) * aside for side in (-1, 1)]
    radii = np.concatenate([generator.uniform(*RADII, RANDOM), np.full(len(found) - RANDOM, 1.5)])
    return np.array(found), radii


def packed(fields, steps):
    """Whole numbers of so many steps each way, and the steps' sizes, one for each load."""
    scale = abs(fields).max((-2, -1), keepdims=True) / steps
    return np.round(fields / scale).astype(np.int8 if steps < 128 else np.int16), scale.astype(np.float32)


def unpacked(file, name):
    return file[name] * file[f"{name}_scale"].astype(float)


def mesh_difference():
    with np.load(KEPT) as file:
        return float(file["mesh_difference"])


def main(folder):
    """Computes and keeps. By the bone's place: differences on the coarse mesh, of the random patches."""
    places, radii = catalogue()
    patches, markers = [patch(*one) for one in zip(places, radii)], marker_directions()
    true = moved(fine(), patches + node_areas(), markers, folder / "fingertip_fine")
    straight = moved(coarse(), patches, markers, folder / "fingertip_coarse")
    off = np.linalg.norm(straight - true[: len(patches)], axis=3).max(2) / np.linalg.norm(true, axis=3).max(2)[: len(patches)]
    print(f"fingertip: {len(true)} places; the two meshes differ by at most {100 * off.max():.2f} % of the peak", flush=True)
    by_bone = []
    for axis in np.eye(3):
        other = moved(coarse(2 * BONE_MM * axis), patches[:RANDOM], markers, folder / "fingertip_bone")
        by_bone.append((other - straight[:RANDOM]) / (2 * BONE_MM))
    arrays = {}
    for name, fields, steps in (("moved", true, 32767), ("by_bone", np.stack(by_bone, 1), 127)):
        arrays[name], arrays[f"{name}_scale"] = packed(fields, steps)
    np.savez_compressed(KEPT, directions=places, radii=radii, mesh_difference=off.max(), **arrays)
