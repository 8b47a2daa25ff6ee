"""Markers of the paper's sensor, and loads as forces at points of its surface. SI."""

import numpy as np


def markers():
    """3 x 1152, in the order of the project: blue at 6 mm, then red at 8 mm, row * 24 + column."""
    across = 3e-3 * (np.arange(24) - 11.5)
    layers = []
    for depth, shift in ((6e-3, 0.0), (8e-3, 1.5e-3)):
        y, x = np.meshgrid(across + shift, across + shift, indexing="ij")
        layers.append(np.stack([x.ravel(), y.ravel(), np.full(x.size, depth)]))
    return np.concatenate(layers, axis=1)


def nodes():
    """2 x 576."""
    across = 3e-3 * (np.arange(24) - 11.5)
    y, x = np.meshgrid(across, across, indexing="ij")
    return np.stack([x.ravel(), y.ravel()])


def patch(shape, centre, radius, force):
    """Forces at the points of a round patch (2 x P, 3 x P) that add up to `force`: `hertz`, as under a pressed ball,
    proportional to sqrt(1 - r^2 / radius^2), or `disc`, even. Gauss points in r^2 resp. sqrt(1 - r^2 / radius^2)."""
    if radius == 0:
        return np.reshape(centre, (2, 1)).astype(float), np.reshape(force, (3, 1)).astype(float)
    rings = max(8, int(np.ceil(radius / 0.4e-3)))
    t, w = np.polynomial.legendre.leggauss(rings)
    t, w = (t + 1) / 2, w / 2
    if shape == "hertz":  # with c = sqrt(1 - r^2/a^2): share of the force in dc is 3 c^2 dc
        radii, shares = radius * np.sqrt(1 - t**2), 3 * t**2 * w
    else:
        radii, shares = radius * np.sqrt(t), w
    count = 4 * rings
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    points = np.stack([np.outer(radii, np.cos(angle)), np.outer(radii, np.sin(angle))]).reshape(2, -1)
    share = np.repeat(shares / count, count)
    return points + np.reshape(centre, (2, 1)), np.outer(force, share / share.sum())
