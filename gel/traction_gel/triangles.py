"""Surfaces of triangles: what is wrong with them, and a gel's body from them (STL). Lengths in mm."""

import collections
import math
import pathlib
import re

import gmsh
import numpy as np
import scipy.spatial

from . import geometry
from .problem import Problem

SMOOTH_DEGREES = 40  # less between triangles: they are one face
SAMPLED = 300  # nodes of a face that are held against the bone
NEAR = 2e-3  # of the bone's largest extent: a gel this near to it is bonded


def read(path, key):
    """Returns corners (V x 3) and triangles (T x 3, in the file's order) of an STL file, binary or text."""
    try:
        data = pathlib.Path(path).read_bytes()
    except OSError as error:
        raise Problem(f"{key}: {path} cannot be read: {error.strerror}") from None
    count = int.from_bytes(data[80:84], "little")
    if count and len(data) >= 84 + 50 * count:  # a text would state more than any file has
        places = np.frombuffer(data, [("normal", "<f4", 3), ("corners", "<f4", 9), ("more", "<u2")], count, 84)["corners"]
    else:
        try:
            places = np.array(re.findall(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", data, re.I), float)
        except ValueError:
            places = np.full(1, np.nan)
    if not places.size or places.size % 9 or not np.isfinite(places).all():
        raise Problem(f"{key}: {path} has no triangles, or is cut short: is it an STL file? Export it again")
    places = places.reshape(-1, 3).astype(float)
    extent = np.ptp(places, axis=0).max() or 1
    _, first, same = np.unique(np.round(places / extent, 7), axis=0, return_index=True, return_inverse=True)
    return places[first], same.reshape(-1, 3)


def _shells(corners, triangles):
    """Turns the triangles of each closed surface like its first. Returns them, the number of each one's surface, and what
    each surface encloses, negative where its normals point inwards. Raises a Problem at a hole."""
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
        shell[start], waiting = shell.max() + 1, [start]
        while waiting:
            number = waiting.pop()
            triangle = result[number].tolist()
            for one, two in zip(triangle, triangle[1:] + triangle[:1]):
                for other in beside[min(one, two), max(one, two)]:
                    if shell[other] >= 0:
                        continue
                    shell[other] = shell[start]
                    waiting.append(other)
                    there = result[other].tolist()
                    if (one, two) in zip(there, there[1:] + there[:1]):  # the same way round: turned
                        result[other] = result[other][::-1]
    a, b, c = corners[result].transpose(1, 0, 2)
    return result, shell, np.bincount(shell, (a * np.cross(b, c)).sum(1) / 6)


def oriented(corners, triangles):
    """Turns the triangles of a closed surface so that their normals point out of the body. Raises a Problem at a hole."""
    result, shell, volumes = _shells(corners, triangles)
    outermost = abs(volumes).argmax()
    outward = (volumes > 0) == (np.arange(len(volumes)) == outermost)  # a cavity's volume counts as negative
    return np.where(outward[shell][:, None], result, result[:, ::-1])


def check(corners, triangles, key):
    """Raises a Problem for triangles that leave holes or pass through each other."""
    for number, triangle in enumerate(triangles.tolist()):
        if len(set(triangle)) < 3:
            raise Problem(f"{key}: face {number} has no area: heal the mesh in the CAD program")
    turned, shell, volumes = _shells(corners, triangles)
    pair = crossing(corners, triangles)
    if pair:
        place = ", ".join(f"{value:.3g}" for value in corners[triangles[pair[0]]].mean(0))
        raise Problem(f"{key}: faces {pair[0]} and {pair[1]} pass through each other near ({place}) mm: heal the mesh")
    if len(volumes) == 1:
        return
    outer, *others = abs(volumes).argsort()[::-1]
    kinds = []
    for number in (outer, *others):
        part, inside = shell == number, geometry.turns(corners[triangles[shell == number][0, :1]], corners, turned[shell == outer])
        if (turned[part] != triangles[part]).any():
            kinds.append("triangles turned both ways")
        elif number == outer:
            kinds.append("the gel")
        elif volumes[number] * volumes[outer] > 0:
            kinds.append("another body")
        else:
            kinds.append("a cavity" if abs(inside[0]) > 0.5 else "a cavity outside the gel")
    if set(kinds) != {"the gel", "a cavity"}:
        places = (extent_and_place(corners[triangles[shell == number]].reshape(-1, 3)) for number in (outer, *others))
        raise Problem(
            f"{key} has {len(kinds)} closed surfaces: {'; '.join(map(', '.join, zip(kinds, places)))}. Export the gel alone, joined "
            "to one solid; the normals of a cavity point into it, all others out of the gel"
        )


def extent_and_place(points):
    """Describes where points (P x 3) are."""
    low, high = points.min(0), points.max(0)
    size, middle = ([f"{value:.3g}" for value in np.round(each, 3) + 0.0] for each in (high - low, (low + high) / 2))
    return f"{' x '.join(size)} mm about ({', '.join(middle)})"


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
            hit = through[geometry.sides(point, a[through], b[through], c[through], normal[through]) > 0]
            if len(hit):
                return int(one[hit[0]]), int(other[hit[0]])
    return None


def discrete(corners, triangles):
    """Makes a face of triangles in the current model, which gmsh does not mesh anew. Returns its tag."""
    face = gmsh.model.addDiscreteEntity(2)
    first = int(max(gmsh.model.mesh.getNodes()[0], default=0)) + 1
    gmsh.model.mesh.addNodes(2, face, np.arange(first, first + len(corners)), corners.ravel())
    gmsh.model.mesh.addElementsByType(face, 2, [], (triangles + first).ravel())
    return face


def volume(corners, triangles):
    """Makes faces and volume of triangles in the current model. Returns the volume's tag."""
    gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)  # gmsh 4.8 finds no middles of edges on such faces
    discrete(corners, triangles)
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
        if all(geometry.distance(place, parts) < NEAR * extent for place in places[:: len(places) // SAMPLED + 1]):
            found.add(face)
    return found
