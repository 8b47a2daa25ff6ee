"""A rigid rod pressed into the gel: contact, large deformations, neo-Hookean. An axisymmetric finite-element program of
our own, because the contact grows and the force is given; it shares nothing with tractiond. It agrees with Hertz's
solution at small forces, and with CalculiX where a pressure is prescribed (truth.probes).

The gel is a cylinder, bonded at z = thickness, of quadratic elements with eight nodes and 2 x 2 Gauss points. Springs
along the rod's normal at Gauss points of the surface keep the rod out of it; where it sticks, others along the rod hold
what touched it where it touched first. Newton's method solves for displacements and depth together at a given force.
Lengths in mm, forces in N, stresses in MPa.
"""

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from calculix import FACE, serendipity

YOUNG, POISSON = 0.18, 0.49
SHEAR, BULK = YOUNG / 2 / (1 + POISSON), YOUNG / 3 / (1 - 2 * POISSON)
PENALTY = 200 * YOUNG  # per mm: the rod sinks 0.02 mm into the surface under 4 E
ALONG = 0.2 * PENALTY
CORNERS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
PICK = [0, 0, 1, 1, 2], [0, 1, 0, 1, 2]  # what is not 0 of a tensor: rr, rz, zr, zz, and around the axis


def slopes(a, b):
    along_a = [s * (1 + t * b) * (2 * s * a + t * b) / 4 for s, t in CORNERS]
    along_b = [t * (1 + s * a) * (s * a + 2 * t * b) / 4 for s, t in CORNERS]
    return np.array(
        [
            along_a + [-a * (1 - b), (1 - b * b) / 2, -a * (1 + b), -(1 - b * b) / 2],
            along_b + [-(1 - a * a) / 2, -(1 + a) * b, (1 - a * a) / 2, -(1 - a) * b],
        ]
    )


def factorised(matrix):
    return scipy.sparse.linalg.splu(
        matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True}
    )


class Rod:
    """Of this radius; the edge of its end is rounded: by its radius, it is a hemisphere."""

    def __init__(self, radius, edge, sticks):
        self.radius, self.edge, self.sticks = radius, edge, sticks

    def gap(self, r, z):
        """Distance of points from the rod with its end at z = 0, the unit normal and the distance's second
        derivatives."""
        across, along = r - (self.radius - self.edge), z + self.edge
        rounded = (across > 0) & (along > 0)
        length = np.maximum(np.hypot(across, along), 1e-12)
        normal = np.where(rounded, np.stack([across, along]) / length, np.stack([across > along, across <= along]))
        tangent = np.stack([-normal[1], normal[0]])
        bent = np.where(rounded, tangent[:, None] * tangent[None] / length, 0)
        return np.where(rounded, length, np.maximum(across, along)) - self.edge, normal, bent


class Gel:
    """A cylinder between the planes z, of rings between the radii r; the first z is the touched surface."""

    def __init__(self, r, z):
        self.r, self.z = np.asarray(r, float), np.asarray(z, float)
        halves = [np.sort(np.concatenate([axis, (axis[1:] + axis[:-1]) / 2])) for axis in (self.r, self.z)]
        i, j = np.meshgrid(*[np.arange(len(axis)) for axis in halves], indexing="ij")
        exists = (i % 2 + j % 2) <= 1
        self.number = np.where(exists, np.cumsum(exists).reshape(exists.shape) - 1, -1)
        places = np.stack([halves[0][i[exists]], halves[1][j[exists]]])
        self.count = 2 * places.shape[1]
        fixed = np.zeros((places.shape[1], 2), bool)
        fixed[places[0] == 0, 0] = True
        fixed[places[1] == self.z[-1]] = True
        self.free = np.flatnonzero(~fixed.ravel())
        i, j = (axis.ravel() for axis in np.meshgrid(*[np.arange(len(a) - 1) for a in (self.r, self.z)], indexing="ij"))
        cells = np.stack([self.number[2 * i + s, 2 * j + t] for s, t in FACE], 1)
        self.dofs = np.stack([2 * cells, 2 * cells + 1], 2).reshape(len(cells), 16)
        wide, high = np.diff(self.r)[i], np.diff(self.z)[j]
        gradients, weights = [], []
        for a, b in np.array(CORNERS) / np.sqrt(3):
            radius = places[0][cells] @ serendipity(a, b)
            along_a, along_b = slopes(a, b)
            gradient = np.zeros((len(cells), 5, 16))
            gradient[:, 0, 0::2] = gradient[:, 2, 1::2] = 2 / wide[:, None] * along_a
            gradient[:, 1, 0::2] = gradient[:, 3, 1::2] = 2 / high[:, None] * along_b
            gradient[:, 4, 0::2] = serendipity(a, b) / radius[:, None]
            gradients.append(gradient)
            weights.append(2 * np.pi * radius * wide * high / 4)
        self.gradients, self.weights = np.array(gradients), np.array(weights)
        x, w = np.polynomial.legendre.leggauss(3)
        rings = np.arange(len(self.r) - 1)
        self.surface = np.repeat(np.stack([self.number[2 * rings + s, 0] for s in (0, 1, 2)], 1), 3, 0)
        self.at_surface = np.tile(np.stack([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2], 1), (len(rings), 1))
        self.surface_r = (places[0][self.surface] * self.at_surface).sum(1)
        self.area = np.pi * self.surface_r * np.repeat(np.diff(self.r), 3) * np.tile(w, len(rings))

    def _matrix(self, dofs, blocks):
        size = dofs.shape[1]
        rows, columns = np.repeat(dofs, size, 1).ravel(), np.tile(dofs, (1, size)).ravel()
        return scipy.sparse.csc_matrix((blocks.ravel(), (rows, columns)), 2 * (self.count,))

    def inner(self, moved):
        """The gel's forces and stiffness; None where it would be turned inside out."""
        gradient = np.einsum("gekd,ed->gek", self.gradients, moved[self.dofs])
        stretch = np.zeros(gradient.shape[:2] + (3, 3))
        stretch[..., PICK[0], PICK[1]] = gradient + [1, 0, 0, 1, 1]
        volume = np.linalg.det(stretch)
        if volume.min() <= 0.05:
            return None
        turned = np.swapaxes(np.linalg.inv(stretch), -1, -2)
        squares = (stretch * stretch).sum((-1, -2))
        shear = SHEAR * volume ** (-2 / 3)
        f, t = stretch[..., PICK[0], PICK[1]], turned[..., PICK[0], PICK[1]]
        cross = np.array([[turned[..., i, l] * turned[..., k, j] for k, l in zip(*PICK)] for i, j in zip(*PICK)])
        cross = np.moveaxis(cross, (0, 1), (-2, -1))

        def outer(a, b):
            return a[..., :, None] * b[..., None, :]

        def wide(a):
            return a[..., None, None]

        stress = shear[..., None] * (f - squares[..., None] / 3 * t) + (BULK * (volume - 1) * volume)[..., None] * t
        stiffness = wide(shear) * (
            np.eye(5)
            - 2 / 3 * (outer(t, f) + outer(f, t))
            + wide(2 * squares / 9) * outer(t, t)
            + wide(squares / 3) * cross
        )
        stiffness += wide(BULK * volume) * (wide(2 * volume - 1) * outer(t, t) - wide(volume - 1) * cross)
        forces = np.einsum("ge,gekd,gek->ed", self.weights, self.gradients, stress)
        blocks = sum(
            b.transpose(0, 2, 1) @ (w[:, None, None] * s @ b)
            for b, w, s in zip(self.gradients, self.weights, stiffness)
        )
        return np.bincount(self.dofs.ravel(), forces.ravel(), self.count), self._matrix(self.dofs, blocks)

    def contact(self, moved, rod, depth, anchors):
        """The rod's forces and stiffness, their derivative by its depth; its force and the derivative; the contact:
        which points of the surface touch, and where all are beside the rod."""
        place = (moved.reshape(-1, 2)[self.surface] * self.at_surface[:, :, None]).sum(1)
        place += np.stack([self.surface_r, np.full(len(place), -depth)], 1)
        gap, normal, bent = rod.gap(*place.T)
        touching = np.flatnonzero(gap < 0)
        gap, normal, bent, area = gap[touching], normal[:, touching], bent[:, :, touching], self.area[touching]
        force = PENALTY * area * gap * normal
        stiffness = PENALTY * area * (normal[:, None] * normal[None] + gap * bent)
        if rod.sticks:
            tangent = np.stack([-normal[1], normal[0]])
            held = ~np.isnan(anchors[touching, 0])
            off = np.where(held, ((place - anchors)[touching].T * tangent).sum(0), 0)
            force = force + ALONG * area * off * tangent
            stiffness = stiffness + ALONG * area * held * tangent[:, None] * tangent[None]
        nodes, share = self.surface[touching], self.at_surface[touching]
        dofs = np.stack([2 * nodes, 2 * nodes + 1], 2).reshape(-1, 6)
        spread = np.einsum("pn,cd->pncd", share, np.eye(2)).reshape(-1, 6, 2)

        def at_nodes(values):
            return np.bincount(dofs.ravel(), np.einsum("pdc,cp->pd", spread, values).ravel(), self.count)

        matrix = self._matrix(dofs, np.einsum("pdc,cep,pfe->pdf", spread, stiffness, spread))
        by_depth = -at_nodes(stiffness[:, 1])
        return at_nodes(force), matrix, by_depth, -force[1].sum(), stiffness[1, 1].sum(), (touching, place)

    def press(self, rod, forces):
        """A list of displacements (nodes x 2), depth and radius of the contact at these ascending forces, as far as an
        equilibrium is found."""
        free, result, targets = self.free, [], list(forces)
        anchors = np.full((len(self.surface_r), 2), np.nan)
        moved, depth, force, step, before = np.zeros(self.count), 0.0, 0.0, 0.02, None
        while force <= 0.01 * forces[0] and depth < 0.2:  # where few points touch, the depth is given
            depth += 0.01
            for _ in range(30):
                forces_in, stiffness = self.inner(moved)
                forces_on, contact_stiffness, _, force, _, _ = self.contact(moved, rod, depth, anchors)
                left = (forces_in + forces_on)[free]
                if abs(left).max() < 1e-9:
                    break
                moved[free] -= factorised((stiffness + contact_stiffness)[free][:, free]).solve(left)
        while targets and step > 2e-3:
            goal = min(targets[0], force + step)
            solved = self._solve(rod, goal, (moved, depth, force), before, anchors)
            if solved is None:
                step, before = step / 2, None
                continue
            before = moved, depth, force
            moved, depth, (touching, place), iterations = solved
            force = goal
            step = min(0.25, step * (1.5 if iterations <= 6 else 1))
            first = np.isnan(anchors[touching, 0])
            anchors[touching[first]] = place[touching[first]]
            anchors[np.setdiff1d(np.arange(len(anchors)), touching)] = np.nan
            if force == targets[0]:
                result.append((moved.reshape(-1, 2).copy(), depth, place[touching, 0].max()))
                targets.pop(0)
        return result

    def _solve(self, rod, goal, now, before, anchors):
        """Displacements and depth at a force near the last one, contact and number of iterations, or None."""
        free, (moved, depth, force) = self.free, now
        moved = moved.copy()
        if before is not None:
            share = min(1, (goal - force) / (force - before[2]))
            moved, depth = moved + share * (moved - before[0]), depth + share * (depth - before[1])
        for iteration in range(16):
            inner = self.inner(moved)
            if inner is None:
                return None
            forces, stiffness, by_depth, pressed, force_by_depth, contact = self.contact(moved, rod, depth, anchors)
            if len(contact[0]) == 0:  # the rod has lost the gel
                return None
            left = (inner[0] + forces)[free]
            if max(abs(left).max(), abs(pressed - goal)) < 1e-7 * goal:
                return moved, depth, contact, iteration
            factors = factorised((inner[1] + stiffness)[free][:, free])
            a, b = factors.solve(-left), factors.solve(-by_depth[free])
            deeper = (goal - pressed - by_depth[free] @ a) / (force_by_depth + by_depth[free] @ b)
            change = a + b * deeper
            kept = min(1, 0.3 * rod.radius / abs(change).max())
            moved[free] += kept * change
            depth += kept * deeper
        return None

    def pressed_surface(self, radius):
        """Nodal forces of 1 N as Hertz's pressure on a fixed circle."""
        x, w = np.polynomial.legendre.leggauss(24)
        angle = (x + 1) * np.pi / 4
        share = np.cos(angle) ** 2 * np.sin(angle) * w
        result = np.zeros(self.count)
        for r, part in zip(radius * np.sin(angle), share / share.sum()):
            ring = np.searchsorted(self.r, r, side="right") - 1
            q = 2 * (r - self.r[ring]) / (self.r[ring + 1] - self.r[ring]) - 1
            for k, weight in enumerate((q * (q - 1) / 2, 1 - q * q, q * (q + 1) / 2)):
                result[2 * self.number[2 * ring + k, 0] + 1] += part * weight
        return result

    def linear(self, radius):
        """Displacements under pressed_surface() at small strain."""
        moved = np.zeros(self.count)
        _, stiffness = self.inner(moved)
        moved[self.free] = factorised(stiffness[self.free][:, self.free]).solve(self.pressed_surface(radius)[self.free])
        return moved.reshape(-1, 2)

    def under_pressure(self, radius, force):
        """Displacements under so many pressed_surface(), whose directions stay; None without equilibrium."""
        load, moved = self.pressed_surface(radius), np.zeros(self.count)
        for goal in np.linspace(0, force, 41)[1:]:
            for _ in range(20):
                inner = self.inner(moved)
                if inner is None:
                    return None
                left = (inner[0] - goal * load)[self.free]
                if abs(left).max() < 1e-8 * goal:
                    break
                moved[self.free] -= factorised(inner[1][self.free][:, self.free]).solve(left)
            else:
                return None
        return moved.reshape(-1, 2)

    def read(self, moved, r, z):
        """Displacements along r and z at points, 2 x ...; beyond the last ring as at its side."""
        r = np.minimum(r, self.r[-1])
        i = np.clip(np.searchsorted(self.r, r, side="right") - 1, 0, len(self.r) - 2)
        j = np.clip(np.searchsorted(self.z, z, side="right") - 1, 0, len(self.z) - 2)
        weights = serendipity(
            2 * (r - self.r[i]) / np.diff(self.r)[i] - 1, 2 * (z - self.z[j]) / np.diff(self.z)[j] - 1
        )
        nodes = np.array([self.number[2 * i + s, 2 * j + t] for s, t in FACE])
        return np.einsum("n...,n...c->c...", weights, moved[nodes])


def graded(first, last, step, growth):
    planes = [first]
    while planes[-1] + 1.5 * step < last:
        planes.append(planes[-1] + step)
        step *= growth
    return [*planes, last]


def gel(step, reach, radius=50.0):
    """40 mm thick; rings of this width below the rod, and layers as high."""
    r = np.concatenate([np.linspace(0, reach, round(reach / step) + 1)[:-1], graded(reach, radius, 1.15 * step, 1.15)])
    below = [4.4, 4.8, 5.2, 5.6, 6, 6.5, 7, 7.5, *graded(8, 40, 0.8, 1.25)[:-1], 38.6, 39.4, 40]
    return Gel(r, np.concatenate([np.linspace(0, 4, round(4 / step) + 1), below]))
