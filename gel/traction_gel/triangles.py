"""Surfaces of triangles: what is wrong with them, and a gel's body from them (STL). Lengths in mm."""

import collections
import math

import gmsh
import numpy as np
import scipy.spatial

from .problem import Problem

SMOOTH_DEGREES = 40  # less between triangles: they are one face
SAMPLED = 300  # nodes of a face that are held against the bone
NEAR = 2e-3  # of the bone's largest extent: a gel this near to it is bonded


def read(path, key):
    """Returns corners (V x 3) and triangles (T x 3, in the file's order)."""
    gmsh.model.add(key)
    try:
        gmsh.merge(str(path))
        numbers, places, _ = gmsh.model.mesh.getNodes()
        triangles = gmsh.model.mesh.getElementsByType(2)[1].astype(int)
    except Exception as error:  # gmsh raises this class
        raise Problem(f"{key}: {path} cannot be read: {error}") from None
    finally:
        gmsh.model.remove()
    if not len(triangles):
        raise Problem(f"{key}: {path} has no triangles: is it an STL file?")
    index = np.zeros(int(numbers.max()) + 1, int)
    index[numbers.astype(int)] = np.arange(len(numbers))
    places = places.reshape(-1, 3)
    extent = np.ptp(places, axis=0).max()
    _, first, same = np.unique(np.round(places / extent, 7), axis=0, return_index=True, return_inverse=True)
    return places[first], same.ravel()[index[triangles]].reshape(-1, 3)


def oriented(corners, triangles):
    """Turns the triangles of a closed surface so that their normals point out of the body. Raises a Problem at a hole."""
    result = triangles.copy()
    beside = collections.defaultdict(list)
    for number, triangle in enumerate(triangles.tolist()):
        for one, two in zip(triangle, triangle[1:] + triangle[:1]):
            beside[min(one, two), max(one, two)].append(number)
    for (one, two), sharing in beside.items():
        if len(sharing) != 2:
            place = ", ".join(f"{value:.3g}" for value in (corners[one] + corners[two]) / 2)
            raise Problem(
                f"the gel's surface is not closed: {len(sharing)} faces meet at ({place}) mm, and not 2; one is face "
                f"{sharing[0]}"
            )
    shell = np.full(len(triangles), -1)
    for start in range(len(triangles)):
        if shell[start] >= 0:
            continue
        shell[start], waiting = start, [start]
        while waiting:
            number = waiting.pop()
            triangle = result[number].tolist()
            for one, two in zip(triangle, triangle[1:] + triangle[:1]):
                for other in beside[min(one, two), max(one, two)]:
                    if shell[other] >= 0:
                        continue
                    shell[other] = start
                    waiting.append(other)
                    there = result[other].tolist()
                    if (one, two) in zip(there, there[1:] + there[:1]):  # the same way round: turned
                        result[other] = result[other][::-1]
    a, b, c = corners[result].transpose(1, 0, 2)
    volumes = np.bincount(shell, (a * np.cross(b, c)).sum(1) / 6)
    outermost = abs(volumes).argmax()
    outward = (volumes > 0) == (np.arange(len(volumes)) == outermost)  # a cavity's volume counts as negative
    return np.where(outward[shell][:, None], result, result[:, ::-1])


def check(corners, triangles, key):
    """Raises a Problem for triangles that leave holes or pass through each other."""
    for number, triangle in enumerate(triangles.tolist()):
        if len(set(triangle)) < 3:
            raise Problem(f"{key}: face {number} has no area: heal the mesh in the CAD program")
    oriented(corners, triangles)
    pair = crossing(corners, triangles)
    if pair:
        place = ", ".join(f"{value:.3g}" for value in corners[triangles[pair[0]]].mean(0))
        raise Problem(f"{key}: faces {pair[0]} and {pair[1]} pass through each other near ({place}) mm: heal the mesh")


def crossing(corners, triangles):
    """Returns the numbers of two triangles of which one's edge passes through the other, or None."""
    middles = corners[triangles].mean(1)
    reach = np.linalg.norm(corners[triangles] - middles[:, None], axis=2).max(1)
    tree = scipy.spatial.cKDTree(middles)
    for some in np.array_split(np.arange(len(triangles)), len(triangles) // 256 + 1):
        near = tree.query_ball_point(middles[some], reach[some] + reach.max())
        one, other = np.repeat(some, list(map(len, near))), np.concatenate(near).astype(int)
        apart = np.linalg.norm(middles[one] - middles[other], axis=1) < reach[one] + reach[other]
        apart &= (triangles[one][:, :, None] != triangles[other][:, None]).all((1, 2))
        one, other = one[apart], other[apart]
        a, b, c = corners[triangles[other]].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        for side in range(3):
            start, end = corners[triangles[one, side]], corners[triangles[one, (side + 1) % 3]]
            before, after = (((point - a) * normal).sum(1) for point in (start, end))
            through = np.flatnonzero(before * after < 0)
            part = (before[through] / (before - after)[through])[:, None]
            point = start[through] + part * (end - start)[through]
            hit = through[_sides(point, a[through], b[through], c[through], normal[through]) > 0]
            if len(hit):
                return int(one[hit[0]]), int(other[hit[0]])
    return None


def _sides(point, a, b, c, normal):
    """Above 0 where a point of a triangle's plane is in it."""
    return np.min([(np.cross(q - p, point - p) * normal).sum(1) for p, q in ((a, b), (b, c), (c, a))], 0)


def volume(path):
    """Makes faces and volume of the file's triangles in the current model. Returns the volume's tag."""
    gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)  # gmsh 4.8 finds no middles of edges on such faces
    gmsh.merge(str(path))
    gmsh.model.mesh.removeDuplicateNodes()
    gmsh.model.mesh.classifySurfaces(math.radians(SMOOTH_DEGREES), True, True, math.pi)
    gmsh.model.mesh.createGeometry()
    loop = gmsh.model.geo.addSurfaceLoop([tag for _, tag in gmsh.model.getEntities(2)])
    tag = gmsh.model.geo.addVolume([loop])
    gmsh.model.geo.synchronize()
    return tag


def touching(faces, corners, triangles):
    """Returns those of the faces (tags) whose nodes lie on the triangles."""
    parts = corners[triangles]
    extent = np.ptp(corners, axis=0).max()
    found = set()
    for face in faces:
        places = gmsh.model.mesh.getNodes(2, face, includeBoundary=True)[1].reshape(-1, 3)
        if all(_distance(place, parts) < NEAR * extent for place in places[:: len(places) // SAMPLED + 1]):
            found.add(face)
    return found


def _distance(point, parts):
    """Of a point from the nearest of triangles (T x 3 x 3)."""
    a, b, c = parts.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside = _sides(point, a, b, c, normal) >= 0
    least = abs(((point - a) * normal).sum(1)[inside]).min(initial=np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        along = np.clip(((point - p) * (q - p)).sum(1) / ((q - p) ** 2).sum(1), 0, 1)
        least = min(least, np.linalg.norm(point - p - along[:, None] * (q - p), axis=1).min())
    return least
