"""Round patches as the mean of the prior in the dense twin (one_model.py): the twin's contacts, each a place, a spread, a
force and a torsion, fitted to the picture; around them the field, whose roughness and whose worth beside the field
alone the evidence decides (docs/mathematics.md, section 4). For the paper's gel; SI, pictures in pixels.

`tools/evaluate --model --patches [SEED]` prints their errors beside those of the twin and of this build's solver, for the
twin's random loads and for balls in the middle, at the sides and in the corners.
"""

import dataclasses
import functools

import numpy as np

import influence
import one_model
import shapes
from chain import GF
from one_model import PITCH, SIDE

MOST = 4  # patches
SPREAD, SPREAD_DEVIATION = 0.3 * PITCH**2, 0.6 * PITCH**2  # prior of a spread; a ball's contact of radius a has a^2 / 5
NARROWEST, WIDEST = -0.15 * PITCH**2, 1.5 * PITCH**2
ROUGHNESS = (0.1, 0.2, 0.4, 0.8)  # of a patch, all alike before the picture
FAINTEST = 0.1  # a peak of less pressure than so much of the highest one's is no patch
OPTIMISM = 1.0  # the field's evidence is that of a prior that was fitted: so much less for each degree of freedom
HOPELESS = 2000.0  # squared deviations that patches leave more than the field, beyond which they are not looked at
STEPS, FARTHEST = 16, np.array([0.7, 0.7, 0.3])  # of a fit; one step [pitches, pitches, pitches^2]
UNIT = np.array([PITCH, PITCH, PITCH**2])  # of place and spread


@dataclasses.dataclass
class Fitted:
    place: np.ndarray  # K x 3: x, y [m] and spread [m^2], the variance of the pressure's places along any direction
    load: np.ndarray  # K x 4: force [N], torsion [N m]
    motion: np.ndarray  # 4, in deviations of its prior
    columns: np.ndarray  # 2M x 4K: displacements [px] by each load
    slopes: np.ndarray  # 2M x 3K: by each place and spread
    misfit: float  # squared deviations of the noise, priors included


class Influence:
    """Displacements that patches cause: a half-space's exactly, what the block adds by cubics between the points."""

    RING = np.array([[np.cos(a), np.sin(a)] for a in 2 * np.pi * np.arange(6) / 6])
    RING_SHARE = 0.7  # of the force; with its radius, the moments of a ball's pressure up to the fifth
    CUBICS = np.linalg.inv(np.vander(np.arange(4.0), 4, increasing=True))

    def __init__(self, model, thickness):
        self.markers, self.along = model.markers, one_model.axis_points(model.ring)
        small = 1e-6
        moved = [shapes.pixels(model.markers, np.tile(small * axis, (model.markers.shape[1], 1))) for axis in np.eye(3)]
        self.projection = np.array(moved).transpose(1, 2, 0) / small  # M x 2 x 3 [px/m]
        points = one_model.influence_of(thickness, model.points)
        count = len(self.along)
        self.rest = (points - self.half_space(model.points).reshape(points.shape[0], -1)).reshape(-1, count, count, 3)

    def half_space(self, points):
        """2M x P x 3 [px/N]"""
        moved = influence.half_space(self.markers, points)
        return np.einsum("mra,amfp->mrpf", self.projection, moved).reshape(2 * self.markers.shape[1], -1, 3)

    def of(self, x, y, spread):
        """2M x 4 [px/N, px/(N m)]"""
        radius = np.sqrt(2 / self.RING_SHARE * max(spread, 0))
        arm = np.sqrt(20 / 7 * max(spread, 0.05 * PITCH**2))  # where a ball's torsion acts
        at = np.vstack([[[0, 0]], radius * self.RING, arm * self.RING]) + [x, y]
        forces = np.zeros((13, 3, 4))
        forces[0, :, :3] = (1 - self.RING_SHARE) * np.eye(3)
        forces[1:7, :, :3] = self.RING_SHARE / 6 * np.eye(3)
        forces[7:, :2, 3] = np.stack([-self.RING[:, 1], self.RING[:, 0]], 1) / (6 * arm)
        exact = np.tensordot(self.half_space(at.T), forces, 2)
        grid = (at - self.along[0]) / PITCH
        low = np.clip(np.floor(grid[0]).astype(int) - 2, 0, len(self.along) - 6)
        window = np.zeros((6, 6, 3, 4))
        for place, force in zip(grid, forces):
            first = np.clip(np.floor(place).astype(int) - 1, low, low + 2)
            share = np.zeros((2, 6))
            for axis in range(2):
                powers = (place[axis] - first[axis]) ** np.arange(4)
                share[axis, first[axis] - low[axis] :][:4] = powers @ self.CUBICS
            window += np.multiply.outer(np.outer(share[1], share[0]), force)
        return exact + np.tensordot(self.rest[:, low[1] :, low[0] :][:, :6, :6], window, 3)


@functools.cache
def influence_of(model, thickness):
    return Influence(model, thickness)


def peaks(model, forces):
    """Places of the pressure's local maxima, the highest first; of a lone one the centre of all forces. 2 x K."""
    force = np.linalg.norm(model.shape @ forces, axis=1)
    height = model.spread(PITCH) @ force
    count = int(np.sqrt(len(height)))
    grid, found = height.reshape(count, count), []
    for point in np.argsort(-height):
        row, column = divmod(point, count)
        around = grid[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        if height[point] >= FAINTEST * height.max() and height[point] >= around.max():
            found.append(point)
    if len(found) == 1:
        return (model.points @ force / force.sum())[:, None]
    return model.points[:, found]


def fit(model, patch, d, places):
    """Gauss-Newton steps from `places`, damped where one leaves more; loads and motion are linear."""
    n2, motion, count = model.noise**2, model.P * shapes.MOTION, places.shape[1]
    at = np.column_stack([places.T, np.full(count, SPREAD)])
    spread_weight = (PITCH**2 / SPREAD_DEVIATION) ** 2

    def linear(at):
        columns = np.hstack([patch.of(*one) for one in at])
        B = np.hstack([columns, motion])
        A = B.T @ B / n2
        A[-4:, -4:] += np.eye(4)
        x = np.linalg.solve(A, B.T @ d / n2)
        left = d - B @ x
        prior = np.square((at[:, 2] - SPREAD) / SPREAD_DEVIATION).sum()
        return Fitted(at, x[:-4].reshape(-1, 4), x[-4:], columns, np.zeros(0), left @ left / n2 + x[-4:] @ x[-4:] + prior)

    def slopes(now):
        result = []
        for k, one in enumerate(now.place):
            here = now.columns[:, 4 * k : 4 * k + 4] @ now.load[k]
            for axis in np.diag(0.02 * UNIT):
                result.append((patch.of(*(one + axis)) @ now.load[k] - here) / axis.sum())
        return np.array(result).T

    now, damping = linear(at), 0.0
    for _ in range(STEPS):
        B = np.hstack([now.columns, motion, slopes(now) * np.tile(UNIT, count)])
        left = d - B[:, : 4 * count + 4] @ np.concatenate([now.load.ravel(), now.motion])
        A, right = B.T @ B / n2, B.T @ left / n2
        m = slice(4 * count, 4 * count + 4)
        A[m, m] += np.eye(4)
        right[m] -= now.motion
        spreads = 4 * count + 4 + 3 * np.arange(count) + 2
        A[spreads, spreads] += spread_weight
        right[spreads] -= spread_weight * (now.place[:, 2] - SPREAD) / PITCH**2
        moved = np.arange(4 * count + 4, len(A))
        A[moved, moved] *= 1 + damping
        step = np.clip(np.linalg.solve(A, right)[moved].reshape(-1, 3), -FARTHEST, FARTHEST) * UNIT
        outermost = patch.along[-1]
        low, high = [-outermost, -outermost, NARROWEST], [outermost, outermost, WIDEST]
        new = linear(np.clip(now.place + step, low, high))
        gain = now.misfit - new.misfit
        if gain >= -0.02:
            now, damping = new, damping / 10 if damping > 0.1 else 0.0
            if gain < 0.02:
                break
        else:
            damping = max(10 * damping, 0.1)
            if damping > 1e4:
                break
    return dataclasses.replace(now, slopes=slopes(now))


def wrench_of(fitted):
    """The wrench, and the 6 x 7K matrix of its slopes by loads, then places and spreads."""
    by_load, by_place = [], []
    for (x, y, _), (fx, fy, fz, _) in zip(fitted.place, fitted.load):
        by_load.append(np.column_stack([one_model.wrench_of(np.array([[x], [y]])), np.eye(6)[5]]))
        by_place.append(np.array([[0, 0, 0, 0, -fz, fy], [0, 0, 0, fz, 0, -fx], np.zeros(6)]).T)
    by_load = np.hstack(by_load)
    return by_load @ fitted.load.ravel(), np.hstack([by_load, *by_place])


def pressure_of(model, fitted):
    """Forces of the points as the patches have them, P x 3."""
    result = np.zeros((model.points.shape[1], 3))
    for (x, y, spread), load in zip(fitted.place, fitted.load):
        width2 = max(spread, 0.02 * PITCH**2) + 0.08 * PITCH**2
        share = np.exp(-np.square(model.points - [[x], [y]]).sum(0) / (2 * width2))
        result += np.outer(share / share.sum(), load[:3])
    return result


def evident_around(model, left, extra, constants):
    """The twin's rounds on what patches leave, with the patches free to follow: prior variance and directions."""
    first = seen = one_model.start(model, model.U.T @ (model.half_weight @ left), model.noise**2)
    gamma, budget = np.zeros(model.atoms), constants.most[0]
    for number, most in enumerate(budget):
        last = number == len(budget) - 1
        atoms, chosen = one_model.select(model, one_model.strengths(model, seen, constants), most)
        if len(atoms) == 0:
            return gamma, np.tile(np.eye(3), (model.atoms, 1, 1))
        omega = one_model.directions(model, seen, constants, last)
        if not last:
            fitted = one_model.fit(model, left, atoms, chosen, omega, extra)
            seen = one_model.seen_of(model, first, atoms, chosen, fitted)
    gamma[atoms] = chosen
    return gamma, omega


def around(model, d, fitted, constants):
    """The field around the patches for each roughness: log evidence, wrench, covariance."""
    n2 = model.noise**2
    force = np.linalg.norm(fitted.load[:, :3], axis=1, keepdims=True)
    free = np.concatenate([(3 * force * [1, 1, 1, PITCH]).ravel(), np.tile(UNIT * [1, 1, 0.25], len(force))])
    extra = np.hstack([fitted.columns, fitted.slopes]) * free
    left = d - fitted.columns @ fitted.load.ravel()
    gamma, omega = evident_around(model, left - model.P * shapes.MOTION @ fitted.motion, extra, constants)
    along = fitted.load[:, :3].T @ fitted.load[:, :3]
    patch_omega = (1 - constants.turning) * 3 * along / np.trace(along) + constants.turning * np.eye(3)
    mean = np.zeros((model.atoms, 3))
    mean[: model.points.shape[1]] = pressure_of(model, fitted)
    rough = np.square(one_model.beneath(model, mean, continues=False)) / 3
    wrench, slope = wrench_of(fitted)
    result = []
    for roughness in ROUGHNESS:
        whole = gamma + roughness**2 * rough
        atoms = np.argsort(-whole * model.size)[: constants.most[0][-1]]
        atoms = atoms[(whole * model.size)[atoms] > one_model.FLOOR * n2]
        share = (gamma / np.maximum(whole, 1e-300))[:, None, None]
        mixed = share * omega + (1 - share) * patch_omega
        scale, inverse, x, _, evidence = one_model.equations(model, left, atoms, whole[atoms], mixed, extra)
        to = model.wrench[:, (3 * atoms[:, None] + np.arange(3)).ravel()] @ scale
        to = np.hstack([to, slope * free, np.zeros((6, 4))])
        result.append((evidence - np.log(len(ROUGHNESS)), wrench + to @ x, n2 * to @ inverse @ to.T))
    return result


def solve(thickness, model, d, constants=one_model.Constants()):
    """The twin's posterior, or the mean over it and the patches' by their evidence."""
    alone = one_model.solve(model, d, constants)
    if len(alone.atoms) == 0:
        return alone
    places = peaks(model, alone.forces)
    if places.shape[1] > MOST:
        return alone
    fitted = fit(model, influence_of(model, thickness), d, places)
    if fitted.place[:, 2].max() >= WIDEST:  # more than a patch
        return alone
    if not fitted.misfit - alone.residual / model.noise**2 < HOPELESS:
        return alone
    found = [(alone.evidence - OPTIMISM * alone.degrees, alone.wrench, alone.covariance)]
    anywhere = 2 * places.shape[1] * np.log(SIDE)  # a patch may be at any pitch of the face
    found += [(evidence - anywhere, *rest) for evidence, *rest in around(model, d, fitted, constants)]
    worth = np.array([evidence for evidence, *_ in found])
    share = np.exp(worth - worth.max())
    share /= share.sum()
    wrench = sum(part * one for part, (_, one, _) in zip(share, found))
    covariance = sum(
        part * (one + np.outer(at - wrench, at - wrench)) for part, (_, at, one) in zip(share, found)
    )
    return dataclasses.replace(alone, wrench=wrench, covariance=covariance)


def balls(generator, count=6):
    """Balls of 2 to 5 mm wholly within the nodes, in the middle, within a pitch of a side, of a corner."""
    result = []
    for zone in ("inside", "rim", "corner"):
        for force in (20, 100, 400):
            found = []
            while len(found) < count:
                one = shapes.single("ball", generator, force=force * GF, mixture=generator.choice(["press", "friction"]))
                reach = np.ptp(one.points, axis=1).max() / 2
                if not 2e-3 < reach < 5e-3:
                    continue
                at = (one.points * one.pressure).sum(1)
                inner, outer = 0.6 * at, np.sign(at) * (shapes.OUTERMOST - reach - generator.uniform(0, PITCH))
                near = {"inside": inner, "rim": [outer[0], inner[1]], "corner": outer}[zone]
                points = one.points + (near - at)[:, None]
                found.append(dataclasses.replace(one, points=points, family=f"{zone}, {force} gf", zone=zone))
            result += found
    return result


def say_balls(thickness, seed_number, together={}, frames=4):
    """Prints errors of balls, and returns what read() says of them."""
    loads = balls(np.random.default_rng([seed_number, thickness, 2]))
    unit = [
        np.tensordot(
            shapes.by_patterns(load), shapes.displacements(thickness, load.points, shapes.patterns(load)), 1
        )
        for load in loads
    ]
    results = one_model.read(thickness, seed_number, np.repeat(unit, frames, axis=0), others(thickness), together)
    families = np.array([load.family for load in loads])
    truth = np.array([load.resultant for load in loads])[:, None]
    for family in dict.fromkeys(families):
        at = families == family
        for label, (wrench, covariance) in results.items():
            error = (wrench.reshape(len(loads), frames, 6) - truth)[at]
            deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2).reshape(len(loads), frames, 6)[at])
            off = np.sqrt(np.square(error[:, :, :3]).sum(2).mean()) / GF
            width = 2 * 1.96 * np.median(deviation[:, :, 2]) / GF
            print(
                f"{thickness} mm, balls, {family:14} {label:20}: rms error {off:5.2f} gf; covered "
                f"{100 * (abs(error) <= 1.96 * deviation).mean():3.0f} %; median width of the interval of Fz {width:4.1f} gf",
                flush=True,
            )
    return results


def others(thickness):
    return {"around patches": lambda model, d: solve(thickness, model, d)}


def main(seed_number, loads=4):
    print(f"seed {seed_number}; limits as in --only shapes; exact displacements with {shapes.MARKER_NOISE_PX} px of noise")
    for thickness in (15, 40):
        one_model.say(*one_model.compare(thickness, seed_number, loads, others=others(thickness)))
        say_balls(thickness, seed_number)


if __name__ == "__main__":
    one_model.run(main)
