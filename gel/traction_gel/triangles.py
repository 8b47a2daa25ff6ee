"""Surfaces of triangles: what is wrong with them, and a gel's body from them (STL). Lengths in mm."""

import collections
import math

import gmsh
import numpy as np

from .problem import Problem

SMOOTH_DEGREES = 40  # less between triangles: they are one face
SAMPLED = 300  # nodes of a face that are held against the bone
NEAR = 2e-3  # of the bone's largest extent: a gel this near to it is bonded


def nodes():
    """Of gmsh's current mesh: the places of its nodes (P x 3), and for each number of a node its row there."""
    numbers, places, _ = gmsh.model.mesh.getNodes()
    rows = np.zeros(int(numbers.max()) + 1, int)
    rows[numbers.astype(int)] = np.arange(len(numbers))
    return places.reshape(-1, 3), rows


def read(path, key):
    """Returns corners (V x 3) and triangles (T x 3, in the file's order)."""
    gmsh.model.add(key)
    try:
        gmsh.merge(str(path))
        triangles = gmsh.model.mesh.getElementsByType(2)[1].astype(int)
        places, rows = nodes() if len(triangles) else (None, None)
    except Exception as error:  # gmsh raises this class
        raise Problem(f"{key}: {path} cannot be read: {error}") from None
    finally:
        gmsh.model.remove()
    if not len(triangles):
        raise Problem(f"{key}: {path} has no triangles: is it an STL file?")
    extent = np.ptp(places, axis=0).max()
    _, first, same = np.unique(np.round(places / extent, 7), axis=0, return_index=True, return_inverse=True)
    return places[first], same.ravel()[rows[triangles]].reshape(-1, 3)


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
    """Raises a Problem for triangles without an area, or that leave holes."""
    for number, triangle in enumerate(triangles.tolist()):
        if len(set(triangle)) < 3:
            raise Problem(f"{key}: face {number} has no area: heal the mesh in the CAD program")
    oriented(corners, triangles)


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
