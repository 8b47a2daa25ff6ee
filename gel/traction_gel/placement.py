"""Where nodes and markers are: grids that are wrapped on the touched surface, or on one below it. Lengths in mm."""

import collections
import math

import numpy as np
import scipy.optimize
import scipy.sparse

from . import geometry
from .problem import Problem

RAYS = 360  # azimuths in which the surface is walked; between them it is interpolated
SAMPLES = 4  # along each side of a node's area
SMALL = 0.02  # of the gel's extent: markers all nearer to the origin are in another unit
TRIES = 60  # to place a random marker
LOOKS = 4000  # points of the free surface, from which it is seen what they look at
BESIDE = 0.1  # of a triangle's edge, by which it may be inside a curved surface
BESIDE_ITSELF_MM = 1e-5
GAP_MM = 1  # between materials: farther apart, one is a step of the other's surface
LEAST_PERCENT = 99.8  # in contact: a hole of 0.15 % below the tip changes influences by 0.8 % of the peak, of 0.6 % by 5 %
AXIS = np.array([1.3e-5, 0.7e-5])  # x, y of the axis [mm]: beside a corner of the triangles that may lie at 0


class Surface:
    """The touched surface as triangles. A point is given by its distance from the point on the z axis, along the
    surface, and by the azimuth in which it lies."""

    def __init__(self, corners, triangles):
        """\\param triangles T x 3, in an order by which their normals point out of the gel"""
        self.corners, self.triangles = corners, triangles
        self.plane = corners[:, :2] - AXIS
        a, b, c = corners[triangles].transpose(1, 0, 2)
        normals = np.zeros_like(corners)
        for k in range(3):
            np.add.at(normals, triangles[:, k], np.cross(c - a, b - a))  # into the gel
        self.normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        self.top = self._top()
        self.beside = collections.defaultdict(list)
        for number, triangle in enumerate(triangles.tolist()):
            for one, two in zip(triangle, triangle[1:] + triangle[:1]):
                self.beside[min(one, two), max(one, two)].append(number)

    def _top(self):
        """Returns the triangle that the z axis crosses first."""
        a, b, c = self.plane[self.triangles].transpose(1, 0, 2)
        cross = lambda p, q: p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]  # noqa: E731
        weights = np.stack([cross(b, c), cross(c, a), cross(a, b)], 1)
        area = weights.sum(1, keepdims=True)
        weights = weights / np.where(area == 0, 1, area)
        hit = np.flatnonzero((area[:, 0] != 0) & (weights >= -1e-9).all(1))
        if not len(hit):
            raise Problem("the z axis does not cross the touched surface: move the gel, its middle belongs at x = y = 0")
        heights = (weights[hit] * self.corners[self.triangles[hit], 2]).sum(1)
        edge = np.ptp(self.plane[self.triangles[hit[heights.argmin()]]], axis=0).max()
        if abs(heights.min()) > 1e-2 + 0.05 * edge:  # as deep as a triangle may cut into a curved surface
            raise Problem(
                f"the touched surface crosses the z axis at {heights.min():.3g} mm: move the gel, it belongs at z = 0, "
                "with z into the gel and towards the camera"
            )
        return int(hit[heights.argmin()])

    def profile(self, azimuth, depth, reach):
        """Walks from the axis on the surface `depth` below the touched one, as far as `reach` or to the end. Returns
        distances (P) and, for each, the point and the normal into the gel (P x 6)."""
        across = np.array([-np.sin(azimuth), np.cos(azimuth)])
        side = self.plane @ across
        side[side == 0] = 1e-12
        forward = np.array([np.cos(azimuth), np.sin(azimuth)])

        def crossing(edge):
            one, two = edge
            part = side[one] / (side[one] - side[two])
            normal = (1 - part) * self.normals[one] + part * self.normals[two]
            return (1 - part) * self.corners[one] + part * self.corners[two], normal / np.linalg.norm(normal)

        def crossed(number):
            a, b, c = self.triangles[number].tolist()
            edges = [(min(e), max(e)) for e in ((a, b), (b, c), (c, a))]
            return [edge for edge in edges if (side[edge[0]] > 0) != (side[edge[1]] > 0)]

        ends = sorted(((crossing(edge), edge) for edge in crossed(self.top)), key=lambda end: (end[0][0][:2] - AXIS) @ forward)
        if len(ends) < 2:
            raise Problem("the touched surface cannot be walked from the z axis: is it smooth there?")
        ((back, inward), _), (first, edge) = ends
        part = -((back[:2] - AXIS) @ forward) / ((first[0] - back)[:2] @ forward)
        start, normal = back + part * (first[0] - back), (1 - part) * inward + part * first[1]
        found = [np.concatenate([start + depth * normal, normal])]
        found.append(np.concatenate([first[0] + depth * first[1], first[1]]))
        triangle, distances = self.top, [0.0, np.linalg.norm((found[1] - found[0])[:3])]
        while distances[-1] < reach:
            beyond = [number for number in self.beside[edge] if number != triangle]
            if not beyond:
                break
            triangle = beyond[0]
            edge = next(each for each in crossed(triangle) if each != edge)
            point, normal = crossing(edge)
            found.append(np.concatenate([point + depth * normal, normal]))
            distances.append(distances[-1] + np.linalg.norm((found[-1] - found[-2])[:3]))
        return np.array(distances), np.array(found)

    def wrap(self, plane, depth, name):
        """Puts points of a plane (P x 2: distance and azimuth about the origin) on the surface `depth` below the touched
        one. Returns points and normals into the gel, each P x 3. \\param name names a point by its number"""
        distance, turn = np.hypot(*plane.T), np.arctan2(plane[:, 1], plane[:, 0]) % (2 * np.pi) / (2 * np.pi) * RAYS
        ray, part = np.divmod(turn, 1)
        used = np.unique(np.concatenate([ray, ray + 1]).astype(int) % RAYS)
        rays = {k: self.profile(2 * np.pi * k / RAYS, depth, distance.max()) for k in used}
        found = np.zeros((len(plane), 6))
        for number, (at, k) in enumerate(zip(distance, ray.astype(int))):
            for (along, values), share in ((rays[k % RAYS], 1 - part[number]), (rays[(k + 1) % RAYS], part[number])):
                if at > along[-1] and share > 0:
                    raise Problem(
                        f"{name(number)} lies {at:.3g} mm from the axis along the surface, which ends there after "
                        f"{along[-1]:.3g} mm: smaller pitch_mm, or fewer columns and rows"
                    )
                found[number] += share * np.array([np.interp(at, along, column) for column in values.T])
        return found[:, :3], found[:, 3:] / np.linalg.norm(found[:, 3:], axis=1, keepdims=True)


def grid(table):
    """x, y of a grid's points: index row * columns + column, column along +x, row along +y."""
    columns, rows, pitch = table["columns"], table["rows"], table["pitch_mm"]
    x, y = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    return pitch * np.column_stack([x.ravel(), y.ravel()]) + np.asarray(table.get("centre_mm", (0, 0)), float)


def nodes(surface, table):
    """Places the force nodes. Returns positions, normals, areas, and the points and weights (N x P) of their areas."""

    def name(number):
        return f"nodes: row {number // table['columns']}, column {number % table['columns']}"

    centres, pitch = grid(table), table["pitch_mm"]
    part = pitch * ((np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5)
    inside = np.stack(np.meshgrid(part, part), -1).reshape(-1, 2)
    corner = pitch / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    each = np.concatenate([[[0, 0]], inside, corner])
    spread = (centres[:, None] + each).reshape(-1, 2)
    points, inward = surface.wrap(spread, 0.0, lambda number: f"{name(number // len(each))} (its area)")
    points = points.reshape(len(centres), len(each), 3)
    positions, samples, corners = points[:, 0], points[:, 1:-4], points[:, -4:]
    areas = np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1) / 2
    weights = scipy.sparse.kron(scipy.sparse.eye(len(centres)), np.full((1, len(inside)), 1 / len(inside)), "csr")
    return positions, inward[:: len(each)], areas, samples.reshape(-1, 3), weights


def markers(surface, layers):
    """Places the markers of all layers. Returns positions, normals (NaN for those of a list), and their names."""
    positions, inward, names = [], [], []
    for number, layer in enumerate(layers):

        def name(marker, number=number, layer=layer):
            row, column = divmod(marker, layer["columns"])
            return f"layers[{number}]: marker in row {row}, column {column}"

        count = layer["columns"] * layer["rows"]
        if "positions_mm" in layer:
            found = np.array(layer["positions_mm"], float)
            reach, extent = abs(found).max(), np.ptp(surface.corners, axis=0).max()
            if reach < SMALL * extent:
                raise Problem(
                    f"layers[{number}].positions_mm reach {reach:.3g} mm from the origin, and the gel is {extent:.3g} mm large: "
                    "they seem to be in metres; write millimetres"
                )
            if layer.get("any_order", False):
                found = found[arranged(found[:, :2], layer["columns"], layer["rows"])]
            normals = np.full((count, 3), np.nan)
        elif layer.get("least_mm"):
            found, normals = dots(surface, layer, f"layers[{number}]")
        else:
            plane = grid(layer)
            scatter = np.random.default_rng(number).normal(0, layer.get("scatter_mm", 0.0), plane.shape)
            found, normals = surface.wrap(plane + scatter, layer["depth_mm"], name)
        positions.append(found)
        inward.append(normals)
        names += [name(marker) for marker in range(count)]
    return np.concatenate(positions), np.concatenate(inward), names


def dots(surface, layer, name):
    """Draws markers at random on the surface that a layer is on, where its grid would be, at least `least_mm` apart, and puts
    them into the order of that grid. Returns positions and normals."""
    count, least = layer["columns"] * layer["rows"], layer["least_mm"]
    half = layer["pitch_mm"] / 2 * np.array([layer["columns"], layer["rows"]])
    plane = np.random.default_rng(layer.get("seed", 0)).uniform(-half, half, (TRIES * count, 2)) + layer.get("centre_mm", (0, 0))
    points, inward = surface.wrap(plane, layer["depth_mm"], lambda number: f"{name}: a random marker")
    taken = []
    for number, point in enumerate(points):
        if ((points[taken] - point) ** 2).sum(1).min(initial=np.inf) >= least**2:
            taken.append(number)
            if len(taken) == count:
                break
    else:
        raise Problem(
            f"{name}: {len(taken)} of {count} random markers have room at least {least:g} mm apart: a smaller least_mm (two "
            "thirds of pitch_mm have), or a larger pitch_mm"
        )
    taken = np.array(taken)[arranged(plane[taken], layer["columns"], layer["rows"])]
    return points[taken], inward[taken]


def arranged(plane, columns, rows):
    """Returns the order in which points (P x 2) are a grid whose neighbours are near each other: each goes to one place of a
    grid as large as they are, so that the squares of the ways have the least sum."""
    low, high = plane.min(0), plane.max(0)
    x, y = ((np.arange(size) + 0.5) / size for size in (columns, rows))
    places = low + (high - low) * np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    return scipy.optimize.linear_sum_assignment(((places[:, None] - plane) ** 2).sum(2))[1]


def check_inside(points, names, corners, free, bonded):
    """Raises a Problem for the first marker that is not in the gel."""
    inside = abs(geometry.turns(points, corners, np.concatenate([free, bonded]))) > 0.5
    for number in np.flatnonzero(~inside):
        to_free, to_bonded = (
            np.linalg.norm(corners[np.unique(faces)] - points[number], axis=1).min() for faces in (free, bonded)
        )
        where = "inside the bone, or behind the base" if to_bonded < to_free else "outside the gel"
        place = ", ".join(f"{value:.3g}" for value in points[number])
        raise Problem(f"{names[number]} at ({place}) mm is {where}")


def check_bonded(corners, free, sides, bonded, between, least_percent, say):
    """Says how much of the gel's surface is bonded. Raises a Problem if much of what looks at the bone, or less than GAP_MM away
    at another material, is not in contact with it.

    \\param sides the material of each free triangle, and the bone's triangles (Body.sides)
    \\param least_percent that must be bonded of what looks at the bone
    """
    material, bone = sides

    def area(faces):
        a, b, c = corners[faces].transpose(1, 0, 2)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    sums = np.cumsum(area(free))
    each = sums[-1] / LOOKS
    chosen = np.searchsorted(sums, (np.arange(LOOKS) + 0.5) * each)
    a, b, c = corners[free[chosen]].transpose(1, 0, 2)
    start, way = (a + b + c) / 3, np.cross(b - a, c - a)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    to_bone, _ = geometry.first_hits(start, way, corners, bone, -BESIDE * np.sqrt(area(bone)))  # chords of curved surfaces
    look = np.flatnonzero((len(between) > 0) | (to_bone < np.inf))
    gel, to_gel, hit = np.concatenate([free, bonded]), np.full(LOOKS, np.inf), np.full(LOOKS, -1)
    to_gel[look], hit[look] = geometry.first_hits(start[look], way[look], corners, gel, np.full(len(gel), BESIDE_ITSELF_MM))
    apart = (hit >= 0) & (hit < len(free)) & (to_gel < GAP_MM)
    apart[apart] = material[hit[apart]] != material[chosen[apart]]
    for far, gap, touching, what, whom, least_share, count in (
        (to_bone, to_bone < to_gel, bonded, "of the gel are bonded", "the bone", least_percent, 1),
        (to_gel, apart, between, "of materials are in contact", "another one", LEAST_PERCENT, 2),
    ):
        touch, open_mm2 = area(touching).sum(), gap.sum() * each / count
        if not touch and not open_mm2:
            continue
        share = 100 * touch / (touch + open_mm2)
        found = f"{touch:.4g} mm² {what}, {share:.1f} % of what looks at {whom}"
        if gap.any():
            widest = np.flatnonzero(gap)[far[gap].argmax()]
            place = ", ".join(f"{value:.3g}" for value in start[widest])
            found += f"; gaps are up to {max(far[widest], 0):.3g} mm wide, there at ({place}) mm"
        say(found, False)
        if share < least_share:
            raise Problem(
                f"{found}. Let the gel and what it sticks to overlap in the CAD program: what is in both belongs to the bone, or to "
                f"the later material; or, if a gap to the bone is meant, write shape.bonded_percent = {math.floor(share)}"
            )


def check_seen(points, inward, names, camera):
    """Raises a Problem for the first marker that the camera cannot see: beyond its picture, or on a surface that turns
    away from it. The bone is taken as transparent. What curved surfaces hide, the daemon finds when it reads the gel file."""
    eye = np.array(camera["position_mm"], float)
    depth = eye[2] - points[:, 2]
    if camera.get("rotation_rad", [0, 0, 0]) == [0, 0, 0] and "surfaces" not in camera:
        u = camera["principal_px"][0] + camera["focal_px"] * (points[:, 0] - eye[0]) / depth
        v = camera["principal_px"][1] - camera["focal_px"] * (points[:, 1] - eye[1]) / depth
        beyond = (u < 0) | (v < 0) | (u > camera["width_px"] - 1) | (v > camera["height_px"] - 1) | (depth <= 0)
        for number in np.flatnonzero(beyond):
            raise Problem(
                f"{names[number]} is at ({u[number]:.0f}, {v[number]:.0f}) px, beyond the camera's picture: move the "
                "camera away, take a shorter lens, or fewer markers"
            )
    away = ((eye - points) * inward).sum(1) < 0
    for number in np.flatnonzero(away):
        raise Problem(f"{names[number]} is on a surface that the camera cannot see: smaller pitch_mm, or fewer markers")
