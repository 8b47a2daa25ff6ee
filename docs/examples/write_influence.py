#!/usr/bin/env python3
"""Writes the influence file of a gently domed gel, as an example of docs/influence-file.md.

usage: write_influence.py body.npz [--radius METRES] [--youngs-modulus PASCALS] [--poisson-ratio RATIO]

The surface is a cap of the given radius (0: flat) whose lowest point is the origin. Its Green's functions are those of
the half-space (Cerruti, Boussinesq) below the plane that touches the cap at the node: good while the radius is large
against the markers' depth. The places are the paper's: 24 x 24 nodes, and two layers of 24 x 24 markers 6 and 8 mm
below the surface. For a body of another shape, put the displacements of a finite-element program in their place.
"""

import argparse

import numpy as np


def grid(shift=0.0, count=24, pitch=3e-3):
    """x, y of a square grid, (count^2, 2): index row * columns + column, column along +x, row along +y [m]."""
    along = pitch * (np.arange(count) - 0.5 * (count - 1)) + shift
    x, y = np.meshgrid(along, along)
    return np.column_stack([x.ravel(), y.ravel()])


def on_cap(xy, radius):
    """Points of the surface and its normals into the body, each (count, 3)."""
    squares = (xy**2).sum(axis=1)
    if radius == 0:
        return np.column_stack([xy, 0 * squares]), np.tile([0.0, 0.0, 1.0], (len(xy), 1))
    z = radius - np.sqrt(radius**2 - squares)
    points = np.column_stack([xy, z])
    return points, ([0, 0, radius] - points) / radius


def frames(normals):
    """Right-handed axes (count, 3, 3) whose rows are two tangents and the normal."""
    first = np.cross([0.0, 1.0, 0.0], normals)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=1)


def half_space(offsets, youngs_modulus, poisson_ratio):
    """Displacement per newton, (..., 3, 3): last axis the force; `offsets` (..., 3) from the force, z into the body."""
    x, y, z = np.moveaxis(offsets, -1, 0)
    r = np.linalg.norm(offsets, axis=-1)
    s, kappa = r + z, 1 - 2 * poisson_ratio
    u = np.empty(offsets.shape + (3,))
    u[..., 0, 0] = 1 + (x / r)**2 + kappa * (r / s - (x / s)**2)
    u[..., 1, 1] = 1 + (y / r)**2 + kappa * (r / s - (y / s)**2)
    u[..., 0, 1] = u[..., 1, 0] = x * y * (1 / r**2 - kappa / s**2)
    u[..., 2, 0], u[..., 2, 1] = x * (z / r**2 + kappa / s), y * (z / r**2 + kappa / s)
    u[..., 0, 2], u[..., 1, 2] = x * (z / r**2 - kappa / s), y * (z / r**2 - kappa / s)
    u[..., 2, 2] = (z / r)**2 + 1 + kappa
    return u * ((1 + poisson_ratio) / (2 * np.pi * youngs_modulus) / r)[..., None, None]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("--radius", type=float, default=0.3, help="of the cap [m]; 0: flat")
    parser.add_argument("--youngs-modulus", type=float, default=0.18e6, help="[Pa]")
    parser.add_argument("--poisson-ratio", type=float, default=0.49)
    options = parser.parse_args()

    nodes, normals = on_cap(grid(), options.radius)
    layers = [(on_cap(grid(shift), options.radius), depth) for shift, depth in ((0.0, 6e-3), (1.5e-3, 8e-3))]
    markers = np.concatenate([points + depth * inward for (points, inward), depth in layers])

    influence = np.empty((len(markers), 3, len(nodes), 3))
    for n, axes in enumerate(frames(normals)):
        local = half_space((markers - nodes[n]) @ axes.T, options.youngs_modulus, options.poisson_ratio)
        influence[:, :, n, :] = axes.T @ local @ axes

    np.savez(options.file, format="traction-influence/1", units="SI", youngs_modulus=options.youngs_modulus,
             influence=influence, node_positions=nodes, node_normals=normals,
             node_areas=(3e-3)**2 / normals[:, 2], marker_positions=markers)


if __name__ == "__main__":
    main()
