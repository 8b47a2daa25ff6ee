"""Points, rays and triangles. Nothing here needs gmsh."""

import numpy as np
import scipy.spatial


def turns(points, corners, triangles):
    """How often a closed surface goes around each point: 1 inside, 0 outside (the sum of solid angles)."""
    total = np.zeros(len(points))
    for number, point in enumerate(points):
        a, b, c = (corners[triangles] - point).transpose(1, 0, 2)
        la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
        below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        total[number] = np.arctan2((a * np.cross(b, c)).sum(1), below).sum() / (2 * np.pi)
    return total


def first_hits(starts, directions, corners, triangles, least):
    """Returns how far each ray goes to the first triangle, and its number: infinity and -1 where there is none.

    \\param least smallest distance that counts, of each triangle
    """
    middles = corners[triangles].mean(1)
    reach = np.linalg.norm(corners[triangles] - middles[:, None], axis=2).max(1)
    reached, hit = np.full(len(starts), np.inf), np.full(len(starts), -1)
    for ray, (start, way) in enumerate(zip(starts, directions)):
        offset = middles - start
        near = np.flatnonzero((offset**2).sum(1) - (offset @ way) ** 2 < 1.001 * reach**2)
        a, b, c = corners[triangles[near]].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        slope = normal @ way
        far = ((a - start) * normal).sum(1) / np.where(slope == 0, np.nan, slope)
        met = (far > least[near]) & (sides(start + far[:, None] * way, a, b, c, normal) >= 0)
        if met.any():
            reached[ray], hit[ray] = far[met].min(), near[met][far[met].argmin()]
    return reached, hit


def distances(points, parts):
    """Of points (P x 3) from the nearest of triangles (T x 3 x 3) of about one size."""
    near = scipy.spatial.cKDTree(parts.mean(1)).query(points, min(20, len(parts)))[1]
    return np.array([distance(point, parts[each]) for point, each in zip(points, near)])


def distance(point, parts):
    """Of a point from the nearest of triangles (T x 3 x 3)."""
    a, b, c = parts.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside = sides(point, a, b, c, normal) >= 0
    least = abs(((point - a) * normal).sum(1)[inside]).min(initial=np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        along = np.clip(((point - p) * (q - p)).sum(1) / ((q - p) ** 2).sum(1), 0, 1)
        least = min(least, np.linalg.norm(point - p - along[:, None] * (q - p), axis=1).min())
    return least


def sides(point, a, b, c, normal):
    """Above 0 where a point of a triangle's plane is in it."""
    return np.min([(np.cross(q - p, point - p) * normal).sum(1) for p, q in ((a, b), (b, c), (c, a))], 0)
