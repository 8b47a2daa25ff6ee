"""The dense, slow twin of one statistical model for every contact: prior, noise, posterior, straight from the formulae
(docs/mathematics.md, section 4), in NumPy, for the paper's gel.

`tools/evaluate --model [SEED]` draws loads at random (shapes.py), gives their exact displacements with white noise to
the model and to this build's solver, and prints the errors of both. SI; pictures in pixels.
"""

import dataclasses
import functools
import sys

import numpy as np

import chain
import influence
import shapes
from report import SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "support"))
import seed  # noqa: E402

PITCH = 3e-3
SIDE = 24  # nodes
FLOOR = 0.01  # an atom that moves the markers by less than this variance, in n^2, is dropped
GATE = 1.0  # deviations of what noise leaves, beyond which what is left is looked at
SCALES = (2, 4, 8)  # half widths of the broad atoms, and their distances [pitches]


@dataclasses.dataclass
class Constants:
    surety: float = 4.0  # z: of what is evident
    detection: float = 5.5  # the same of the first atom: the false-alarm rate
    coupling: float = 0.5  # beta: of the prior between atoms of a level, in their distances
    turning: float = 0.1  # epsilon: spread of the directions of friction
    alike: float = 6e-3  # l: neighbours as far as the markers are deep pull alike [m]
    roughness: float = 0.4  # a contact's pressure varies by this share of itself at every scale; by all of it where the
    # picture hardly tells: beyond the nodes, along the sides, and at the broadest scales
    most: tuple = ((48, 48, 128), (96, 96, 192))  # atoms in each round; if what is left shows more


def axis_points(beyond):
    """Places of points along an axis, `beyond` so many outside the nodes at either end [m]."""
    return PITCH * (np.arange(-beyond, SIDE + beyond) - (SIDE - 1) / 2)


class Model:
    """Atoms of a block: forces on the nodes and on rings of points around them; hats of nodes, broader and broader; a
    plate on all nodes; lines along the sides, of the outermost nodes and of each ring. `shape`: points x atoms.
    `visible`: indices of the markers that the picture shows, or None for all."""

    def __init__(self, thickness, ring=2, noise_px=shapes.MARKER_NOISE_PX, scales=SCALES, visible=None):
        self.noise, self.ring = noise_px, ring
        along = axis_points(ring)
        x, y = (each.ravel() for each in np.meshgrid(along, along))
        self.points = np.stack([x, y])  # row after row
        limit = (SIDE - 1) / 2 * PITCH + ring * PITCH + 1e-6
        columns, places, level = [np.eye(len(x))], [self.points], [np.zeros(len(x), int)]
        spacing = [PITCH]
        for number, scale in enumerate(scales, 1):
            width = scale * PITCH
            count = 2 * int(np.floor(limit / width)) + 1
            centres = width * (np.arange(count) - count // 2)
            hats = np.maximum(1 - abs(along[:, None] - centres) / width, 0)
            hats[abs(along) > limit - ring * PITCH] = 0  # a broad contact is expected on the nodes alone
            hats /= hats.sum(0)
            columns.append(np.einsum("yj,xi->yxji", hats, hats).reshape(len(x), -1))
            cx, cy = np.meshgrid(centres, centres)
            places.append(np.stack([cx.ravel(), cy.ravel()]))
            level.append(np.full(count**2, number))
            spacing.append(width)
        even = (abs(self.points) < limit - ring * PITCH).all(0)  # a plate on all nodes
        columns.append((even / even.sum())[:, None])
        places.append(np.zeros((2, 1)))
        level.append([len(scales) + 1])
        spacing.append(SIDE * PITCH)
        for row in [k for out in range(ring + 1) for k in (ring - out, ring + SIDE - 1 + out)]:
            for one, centre in zip(hats.T, centres):  # of the broadest level
                line = np.outer(np.eye(len(along))[row], one)
                columns.append(np.stack([line.ravel(), line.T.ravel()], 1))
                places.append(np.array([[centre, along[row]], [along[row], centre]]))
                level.append([len(scales) + 2] * 2)
        spacing.append(width)
        self.outside = ~even
        inner = np.clip(np.arange(len(along)), ring, ring + SIDE - 1)
        self.nearest = (inner[:, None] * len(along) + inner).ravel()  # node of each point
        self.shape, self.place, self.level = np.hstack(columns), np.hstack(places), np.concatenate(level)
        self.spacing = np.array(spacing)
        self.atoms = self.shape.shape[1]
        self.markers = influence.of(thickness).markers
        self.visible = np.arange(self.markers.shape[1]) if visible is None else visible
        rows = (2 * self.visible[:, None] + np.arange(2)).ravel()
        self.H = influence_of(thickness, self.points)[rows] @ np.kron(self.shape, np.eye(3))
        self.P = picture_motion(self.markers)[rows]
        white = self.P * shapes.MOTION / noise_px
        u, e, _ = np.linalg.svd(white, full_matrices=False)
        self.half_weight = np.eye(len(u)) - (u * (1 - 1 / np.sqrt(1 + e**2))) @ u.T
        seen = self.half_weight @ self.H
        squares, left = np.linalg.eigh(seen @ seen.T)
        used = squares > 1e-12 * squares[-1]
        self.s, self.U = np.sqrt(squares[used]), left[:, used]
        self.V = (self.U.T @ seen).T / self.s  # 3 atoms x modes
        self.gram = self.H.T @ self.H
        self.size = np.square(self.H).sum(0).reshape(-1, 3).sum(1) / 3
        self.wrench = wrench_of(self.points) @ np.kron(self.shape, np.eye(3))
        self.power = np.square(self.V).reshape(self.atoms, 3, -1).sum(1)

    @functools.cache
    def coupled(self, beta):
        near = np.zeros((self.atoms, self.atoms))
        for level, spacing in enumerate(self.spacing):
            at = np.flatnonzero(self.level == level)
            near[np.ix_(at, at)] = np.exp(-self.distance2[np.ix_(at, at)] / (2 * (beta * spacing) ** 2))
        return near

    @functools.cache
    def spread(self, reach):
        """Weights of the points around each, which are the first atoms."""
        count = self.points.shape[1]
        near = np.exp(-self.distance2[:count, :count] / (2 * reach**2))
        return near / near.sum(1, keepdims=True)

    @functools.cached_property
    def distance2(self):
        return np.square(self.place[:, :, None] - self.place[:, None]).sum(0)

    @functools.cache
    def alike(self, reach, broad):
        """`broad`: of broad atoms within half of their distance, but not less than `reach`."""
        least = self.spacing[self.level] / 2 if broad else np.zeros(self.atoms)
        return np.exp(-self.distance2 / (2 * np.maximum(reach, least)[:, None] ** 2))


def influence_of(thickness, points):
    """Pixels per newton at each point, by the project's own mechanics: 2M x 3P."""
    path = chain.BUILD / "evaluation-state" / f"points_{thickness}_{points.shape[1]}_{abs(points).max():.5f}.npy"
    if path.exists():
        return np.load(path)
    rows = [(3 * i + a, *at, *np.eye(3)[a]) for i, at in enumerate(points.T) for a in range(3)]
    moved = chain.mechanics(chain.gel_text(thickness), rows)
    markers = influence.of(thickness).markers
    small = 1e-3
    result = np.array([shapes.pixels(markers, small * one).ravel() / small for one in moved]).T
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, result)
    return result


def picture_motion(markers, camera=shapes.CAMERA):
    rest = camera[0] * np.stack([markers[0], -markers[1]], 1) / (camera[1] - markers[2])[:, None]
    ones = np.ones(len(rest))
    columns = [np.outer(ones, [1, 0]), np.outer(ones, [0, 1]), rest, np.stack([-rest[:, 1], rest[:, 0]], 1)]
    return np.array(columns).reshape(4, -1).T


def wrench_of(points):
    """Force and moment about the origin of unit forces at points of the surface: 6 x 3P."""
    x, y = points
    one, none = np.ones_like(x), np.zeros_like(x)
    rows = [
        [one, none, none],
        [none, one, none],
        [none, none, one],
        [none, none, y],
        [none, none, -x],
        [-y, x, none],
    ]
    return np.array(rows).transpose(0, 2, 1).reshape(6, -1)


@dataclasses.dataclass
class Posterior:
    wrench: np.ndarray  # 6
    covariance: np.ndarray  # 6 x 6
    forces: np.ndarray  # of all atoms, 3A
    atoms: np.ndarray  # that are used
    residual: float  # squared [px^2]
    again: bool  # whether more atoms were asked
    evidence: float = 0.0  # log, of the prior that was fitted
    degrees: float = 0.0  # of freedom that the forces took


@dataclasses.dataclass
class Seen:
    """Of every atom: mean force (A x 3), what is known of it in units of its prior, its noise's variance."""

    mean: np.ndarray
    known: np.ndarray
    noise: np.ndarray

    def evident(self, surety):
        return np.maximum(0, np.square(self.mean).sum(1) - surety**2 * self.noise / 3)


def start(model, amplitudes, noise2):
    """Every atom alike: the evidence says how much is usual."""
    taus = np.exp(np.arange(np.log(1e-5), np.log(3), 0.25))
    variance = np.square(model.s[:, None] * taus) + noise2
    evidence = -0.5 * (np.log(variance) + np.square(amplitudes)[:, None] / variance).sum(0)
    tau = taus[np.argmax(evidence)]
    g = (model.s * tau) ** 2 / ((model.s * tau) ** 2 + noise2)
    mean = (model.V * (g / model.s)) @ amplitudes
    return Seen(mean.reshape(-1, 3), model.power @ g, noise2 * model.power @ (g / model.s) ** 2)


def strengths(model, seen, constants):
    """Variance of a component of each atom's force."""
    near = model.coupled(constants.coupling)
    return near @ seen.evident(constants.surety) / np.maximum(near @ seen.known, 1e-300)


def directions(model, seen, constants, last):
    """3 x 3 of each atom, its trace 3: neighbours pull alike."""
    evident = seen.evident(constants.surety)
    used = evident > 0
    share = evident[used] / np.square(seen.mean[used]).sum(1)
    outer = share[:, None, None] * seen.mean[used][:, :, None] * seen.mean[used][:, None]
    together = np.tensordot(model.alike(constants.alike, last)[:, used], outer, 1) + 1e-300 * np.eye(3)
    together /= np.trace(together, axis1=1, axis2=2)[:, None, None]
    return (1 - constants.turning) * 3 * together + constants.turning * np.eye(3)


def select(model, gamma, most):
    """The strongest atoms and their variances: one enters at nothing."""
    value = gamma * model.size
    order = np.argsort(-value)
    first = order[:most]
    rest = value[order[most]] if most < len(order) else 0.0
    left = value[first] - rest
    first = first[left > FLOOR * model.noise**2]
    return first, (value[first] - rest) / model.size[first]


def beneath(model, mean, continues=True):
    """Force of each atom if its peak were the (harmonic) mean of the pressure beneath it: what is broader than the
    contact gets nothing. If it continues, a contact goes on beyond the nodes as it is at the nearest of them."""
    force, result = np.linalg.norm(model.shape @ mean, axis=1), np.zeros(model.atoms)
    plate = model.level == len(SCALES) + 1
    for reach, at in ((PITCH, ~plate), (SIDE * PITCH / 8, plate)):
        pressure = model.spread(reach) @ force
        if continues:
            pressure = np.where(model.outside, np.maximum(pressure, pressure[model.nearest]), pressure)
        pressure += 1e-6 * pressure.max() + 1e-12
        result[at] = 1 / (model.shape[:, at].T @ (1 / pressure)) / model.shape[:, at].max(0)
    return result


def roughen(model, atoms, gamma, mean, most, constants):
    """Adds the contact's roughness and chooses anew."""
    share = np.where(model.level < len(SCALES), constants.roughness, 1.0)
    share[: len(model.outside)][model.outside] = 1.0
    whole = np.square(share * beneath(model, mean)) / 3
    whole[atoms] += gamma
    first = np.argsort(-whole * model.size)[:most]
    first = first[(whole * model.size)[first] > FLOOR * model.noise**2]
    return first, whole[first]


def equations(model, d, atoms, gamma, omega, extra):
    """Of unknowns with unit prior (the chosen atoms', those of the columns `extra` [px], the motion's): the atoms' roots S,
    A^-1, the unknowns, the squared residual, the log evidence."""
    n2, k = model.noise**2, 3 * len(atoms)
    unknown = (3 * atoms[:, None] + np.arange(3)).ravel()
    scale = np.zeros((k, k))
    for i, root in enumerate(np.linalg.cholesky(gamma[:, None, None] * omega[atoms]) if k else ()):
        scale[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = root
    # With the picture's motion: x = (forces / root, motion / its deviation), unit prior.
    B = np.hstack([model.H[:, unknown] @ scale, extra, model.P * shapes.MOTION])
    A = B.T @ B + n2 * np.eye(B.shape[1])
    inverse = np.linalg.inv(A)
    x = inverse @ (B.T @ d)
    left = d - B @ x
    evidence = -0.5 * (left @ left / n2 + x @ x + np.linalg.slogdet(A / n2)[1])
    return scale, inverse, x, left @ left, evidence


@dataclasses.dataclass
class Fit:
    """Posterior of chosen atoms: their forces, covariance, the noise's part of it; squared residual; log evidence."""

    found: np.ndarray
    sigma: np.ndarray
    noise: np.ndarray
    residual: float
    evidence: float


def fit(model, d, atoms, gamma, omega, extra=None):
    n2, k = model.noise**2, 3 * len(atoms)
    extra = np.zeros((len(d), 0)) if extra is None else extra
    scale, inverse, x, residual, evidence = equations(model, d, atoms, gamma, omega, extra)
    sigma = n2 * scale @ inverse[:k, :k] @ scale.T
    noise = n2 * scale @ (inverse - n2 * inverse @ inverse)[:k, :k] @ scale.T
    return Fit(scale @ x[:k], sigma, noise, residual, evidence)


def seen_of(model, first, atoms, gamma, fitted):
    """Atoms without a force stay what the picture would tell of them (`first`): else the others' prior has no end."""
    seen = Seen(np.zeros((model.atoms, 3)), first.known.copy(), np.zeros(model.atoms))
    seen.mean[atoms] = fitted.found.reshape(-1, 3)
    seen.known[atoms] = 3 - np.diag(fitted.sigma).reshape(-1, 3).sum(1) / gamma
    seen.noise[atoms] = np.diag(fitted.noise).reshape(-1, 3).sum(1)
    return seen


def solve(model, d, constants=Constants()):
    n2 = model.noise**2
    amplitudes = model.U.T @ (model.half_weight @ d)
    first = seen = start(model, amplitudes, n2)
    for budget, rounds in enumerate(constants.most):
        for number, most in enumerate(rounds):
            last = number == len(rounds) - 1
            atoms, gamma = select(model, strengths(model, seen, constants), most)
            if len(atoms) == 0 or not (budget > 0 or first.evident(constants.detection).any()):
                return Posterior(np.zeros(6), np.zeros((6, 6)), 0 * seen.mean, atoms, d @ d, budget > 0)
            smooth, mean = (atoms, gamma), seen.mean
            for _ in range(2 if last else 1):  # roughness shows what the next one is a share of
                omega = directions(model, dataclasses.replace(seen, mean=mean), constants, last)
                if last:
                    atoms, gamma = roughen(model, *smooth, mean, most, constants)
                fitted = fit(model, d, atoms, gamma, omega)
                mean = np.zeros((model.atoms, 3))
                mean[atoms] = fitted.found.reshape(-1, 3)
            seen = seen_of(model, first, atoms, gamma, fitted)
        forces, degrees = seen.mean.copy(), seen.known[atoms].sum()
        expected = n2 * (len(d) - degrees + GATE * np.sqrt(2 * len(d)))
        if rounds is constants.most[-1] or fitted.residual < expected:
            break
        # What is left is looked at as if nothing had been found: does it show more?
        rest = start(model, amplitudes - model.s * (model.V.T @ forces.ravel()), n2)
        if not rest.evident(constants.surety).any():
            break
        new = np.setdiff1d(np.arange(model.atoms), atoms)
        for to, of in ((seen.mean, rest.mean), (seen.known, rest.known), (seen.noise, rest.noise)):
            to[new] = of[new]
        first = rest
    to = model.wrench[:, (3 * atoms[:, None] + np.arange(3)).ravel()]
    wrench, covariance = to @ fitted.found, to @ fitted.sigma @ to.T
    return Posterior(wrench, covariance, forces, atoms, fitted.residual, budget > 0, fitted.evidence, degrees)


def read(thickness, seed_number, moved, others={}, together={}):
    """What this build's solver, the model, `others` (functions of the model and a picture) and `together` (of all
    pictures) make of the markers' displacements, one frame each: wrenches and covariances."""
    import unseen

    gel = chain.gel_text(thickness) + unseen.ALL_KNOWN
    found = chain.run(moved, gel=gel, given=shapes.MARKER_NOISE_PX, seed=seed_number % 2**20)
    model, generator = Model(thickness), np.random.default_rng([seed_number, thickness, 1])
    seen = np.array([shapes.pixels(model.markers, one).ravel() for one in moved])
    seen += model.noise * np.array([generator.standard_normal(len(one)) for one in seen])
    covariance = found["noise_covariance"] + found["systematic_covariance"]
    results = {"this build's solver": (np.hstack([found.resultant_N, found.moment_Nm]), covariance.reshape(-1, 6, 6))}
    for label, solver in {"one model": solve, **others}.items():
        found = [solver(model, one) for one in seen]
        results[label] = np.array([one.wrench for one in found]), np.array([one.covariance for one in found])
    for label, solver in together.items():
        results[label] = solver(seen)
    return results


def compare(thickness, seed_number, loads, frames=2, others={}, together={}):
    """Random loads, and what read() makes of them in single frames."""
    import unseen

    families = loads * shapes.INSIDE + loads * shapes.BEYOND + 2 * loads * shapes.PALMS
    drawn = unseen.Drawn(thickness, families, np.random.default_rng([seed_number, thickness]))
    return drawn, read(thickness, seed_number, np.repeat(drawn.displacement, frames, axis=0), others, together)


ZONES = {"inside": ["inside", "rim", "corner"], "beyond": ["beyond"], "palms": ["palm"]}


def say(drawn, found):
    for label, (wrench, covariance) in found.items():
        frames = len(wrench) // len(drawn.size)
        error = wrench.reshape(-1, frames, 6) - drawn.wrench[:, None]
        deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0)).reshape(error.shape)
        off = np.sqrt(np.mean(np.square(error[:, :, :3]).sum(2), 1)) / drawn.limit()
        covered = abs(error) <= 1.96 * deviation
        for zone, kinds in ZONES.items():
            at = np.isin(drawn.zone, kinds)
            shares = " ".join(f"{100 * share:3.0f}" for share in covered[at].mean((0, 1)))
            middle, high = np.quantile(off[at], (0.5, 0.95))
            width = 2 * 1.96 * np.median(deviation[at], axis=(0, 1)) / chain.GF
            print(
                f"{drawn.thickness} mm, {zone:6}, {at.sum():3} loads, {label:20}: error / limit "
                f"{middle:.2f}, 95th percentile {high:5.2f}; covered {shares} %; median width of the interval, "
                f"Fx, Fz: {width[0]:.1f}, {width[2]:.1f} gf",
                flush=True,
            )
        family = {one: covered[drawn.family == one].mean() for one in shapes.FAMILIES}
        least = min(family, key=family.get)
        print(
            f"{drawn.thickness} mm, {label}: covered, all loads and components: {100 * covered.mean():.1f} %; "
            f"worst family: {least}, {100 * family[least]:.0f} %",
            flush=True,
        )


def main(seed_number, loads=4):
    noise = f"exact displacements with {shapes.MARKER_NOISE_PX} px of noise"
    print(f"seed {seed_number}; limits as in --only shapes; {noise}")
    print("noise of frames alone: nothing is systematic; covered: Fx Fy Fz Mx My Mz")
    for thickness in (15, 40):
        say(*compare(thickness, seed_number, loads))


def run(experiment):
    """Calls experiment(seed) with the seed of the command line, or a fresh one."""
    if not all(argument.isdecimal() for argument in sys.argv[1:]) or len(sys.argv) > 2:
        print(f"evaluate: --model takes one seed, a whole number, not '{' '.join(sys.argv[1:])}'", file=sys.stderr)
        sys.exit(64)
    experiment(int(sys.argv[1]) if len(sys.argv) > 1 else seed.fresh())


if __name__ == "__main__":
    run(main)
