"""Loads drawn at random from families of shapes: forces at points of the surface, half a millimetre to 1.5 apart.

draw(family, generator) gives a Load; displacements() says what it does to the markers, by CalculiX's influence of each
point. Normal, shear and torsion come in any mixture. A load is the sum of its points: its resultant is known
exactly, and nothing is smaller than the markers, 6 mm deep, can tell. SI.
"""

import dataclasses

import numpy as np

import chain
import influence
from chain import GF

OUTERMOST = 34.5e-3  # nodes, from the centre
PITCH = 3e-3
MOST_POINTS = 600  # half a millimetre apart; larger shapes have them 1 mm apart, palms 1.5: no marker can tell
PRESSURE_LIMIT = 2 * chain.YOUNG  # mean, over the shape: beyond it the gel is not linear
INSIDE = ["ball", "disc", "ring", "bar", "ell", "star", "rough", "several"]
BEYOND = [f"{family} beyond" for family in INSIDE if family != "several"]
PALMS = ["palm", "whole face"]
FAMILIES = INSIDE + BEYOND + PALMS


@dataclasses.dataclass
class Load:
    """`parts`: of each contact the range of its points. `pressure`: its share of the contact's force, sums to 1."""

    family: str
    text: str
    points: np.ndarray  # 2 x P [m]
    forces: np.ndarray  # 3 x P [N]
    pressure: np.ndarray  # P
    parts: list
    zone: str = ""  # inside, rim, corner, beyond, palm

    @property
    def resultant(self):
        """Force and moment about the origin [N, N m]."""
        (x, y), (fx, fy, fz) = self.points, self.forces
        return np.concatenate([self.forces.sum(1), [(y * fz).sum(), -(x * fz).sum(), (x * fy - y * fx).sum()]])

    @property
    def size(self):
        """What is put on: the sum of the points' forces, each by its length [N]."""
        return np.linalg.norm(self.forces, axis=0).sum()

    def scaled(self, factor):
        return dataclasses.replace(self, forces=factor * self.forces)


# Shapes about the origin: pressure at points (x, y) [mm], 0 outside; with the shape's own numbers and a reach [mm].


def ball(generator):
    radius = generator.uniform(1, 6)
    return lambda x, y: np.sqrt(np.maximum(1 - (x * x + y * y) / radius**2, 0)), radius, f"radius {radius:.1f}"


def disc(generator):
    radius, edge = generator.uniform(2, 12), generator.choice([0.0, 0.0, 1.0, -0.4])

    def pressure(x, y):
        height = 1 - (x * x + y * y) / radius**2
        return np.where(height > 0, np.maximum(height, 0.02) ** edge, 0)

    return pressure, radius, f"radius {radius:.1f}" + (f", pressure by the power {edge:.1f}" if edge else "")


def ring(generator):
    outer, width = generator.uniform(4, 12), generator.uniform(1, 3)

    def pressure(x, y):
        r = np.hypot(x, y)
        return ((r <= outer) & (r >= outer - width)).astype(float)

    return pressure, outer, f"radius {outer:.1f}, {width:.1f} wide"


def bar(generator):
    length, width = generator.uniform(6, 40), generator.uniform(1, 5)
    return turned(generator, [(0, 0, length, width)]), 0.5 * np.hypot(length, width), f"{length:.0f} x {width:.1f}"


def ell(generator):
    one, other, width = generator.uniform(8, 20), generator.uniform(8, 20), generator.uniform(2, 5)
    shift = np.array([one, other]) / 4
    legs = [
        (one / 2 - shift[0], -shift[1], one, width),
        (-shift[0], other / 2 - shift[1], width, other),
    ]
    reach = 0.85 * np.hypot(one, other)
    return turned(generator, legs), reach, f"legs {one:.0f} and {other:.0f}, {width:.1f} wide"


def turned(generator, boxes):
    """Even pressure on boxes (centre, size), turned by any angle."""
    angle = generator.uniform(0, 2 * np.pi)

    def pressure(x, y):
        along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
        return np.any([(abs(along - u) <= w / 2) & (abs(across - v) <= h / 2) for u, v, w, h in boxes], axis=0) * 1.0

    return pressure


def star(generator):
    rays, outer, waist = generator.integers(3, 7), generator.uniform(5, 12), generator.uniform(0.25, 0.6)
    turn = generator.uniform(0, 2 * np.pi)

    def pressure(x, y):
        phase = ((np.arctan2(y, x) - turn) * rays / np.pi) % 2
        return (np.hypot(x, y) <= outer * (waist + (1 - waist) * abs(phase - 1))).astype(float)

    return pressure, outer, f"{rays} rays to {outer:.1f}"


def rough(generator, least=4, most=12):
    """Islands of a random landscape that is some millimetres to and fro, under an ellipse."""
    a, b = np.sort(generator.uniform(least, most, 2))[::-1]
    length = generator.uniform(1, 4) * most / 12
    waves = generator.normal(0, 1 / length, (2, 60))
    phases, angle = generator.uniform(0, 2 * np.pi, 60), generator.uniform(0, 2 * np.pi)
    sea = generator.uniform(-1, 0.5)

    def pressure(x, y):
        along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
        height = np.cos(np.tensordot(x, waves[0], 0) + np.tensordot(y, waves[1], 0) + phases).sum(-1) / np.sqrt(30)
        return np.maximum(height - sea, 0) * ((along / a) ** 2 + (across / b) ** 2 < 1)

    return pressure, a, f"{2 * a:.0f} x {2 * b:.0f}, islands of {length:.1f}"


def palm(generator):
    return rough(generator, 25, 33)


def whole_face(generator):
    """The nodes' square, pressed more here than there."""
    slope, bulge = generator.normal(0, 0.3, 2), generator.uniform(-0.5, 1)
    half = 1e3 * OUTERMOST

    def pressure(x, y):
        inside = (abs(x) <= half) & (abs(y) <= half)
        height = 1 + (slope[0] * x + slope[1] * y) / half + bulge * np.cos(x / 22) * np.cos(y / 22)
        return inside * np.maximum(height, 0)

    return pressure, half * np.sqrt(2), f"bulge {bulge:.1f}"


SHAPES = {
    "ball": ball,
    "disc": disc,
    "ring": ring,
    "bar": bar,
    "ell": ell,
    "star": star,
    "rough": rough,
    "palm": palm,
    "whole face": whole_face,
}


def sampled(shape, generator):
    """Points about the origin [m], their shares of the force, the area [m^2] and what it is."""
    while True:
        pressure, reach, text = SHAPES[shape](generator)
        for spacing in (1.5,) if shape in PALMS else (0.5, 1.0):
            count = int(np.ceil(reach / spacing)) + 1
            axis = spacing * np.arange(-count, count + 1)
            x, y = np.meshgrid(*(axis + generator.uniform(-0.5, 0.5) * spacing for _ in range(2)))
            value = pressure(x, y).ravel()
            used = value > 0
            if used.sum() <= MOST_POINTS:
                break
        points = 1e-3 * np.stack([x.ravel()[used], y.ravel()[used]])
        if used.sum() >= 8 and np.ptp(points, axis=1).max() <= 2 * OUTERMOST:
            return points, value[used] / value[used].sum(), used.sum() * (1e-3 * spacing) ** 2, text


def tractions(points, pressure, generator, mixture=None):
    """Unit forces (their lengths add up to 1) of a mixture of normal, shear and torsion, in parts of the pressure."""
    mixture = mixture or generator.choice(["press", "friction", "shear", "any"], p=[0.3, 0.4, 0.1, 0.2])
    turn, twist = generator.uniform(0, 2 * np.pi), 0.0
    if mixture == "press":
        normal, shear = 1.0, 0.0
    elif mixture == "friction":  # up to 45 degrees, half of them turning
        normal, shear = 1.0, generator.uniform(0, 1)
        twist = generator.choice([0, 1]) * generator.uniform(-0.7, 0.7)
    elif mixture == "shear":
        normal, shear = 0.0, 1.0
    else:  # pulls, slides and turns as well
        normal, shear, twist = generator.normal(0, 1, 3)
    centre = (points * pressure).sum(1, keepdims=True)
    arm = points - centre
    mean_arm = (pressure * np.hypot(*arm)).sum()
    forces = np.stack(
        [
            pressure * (shear * np.cos(turn) - twist * arm[1] / mean_arm),
            pressure * (shear * np.sin(turn) + twist * arm[0] / mean_arm),
            pressure * normal,
        ]
    )
    return forces / np.linalg.norm(forces, axis=0).sum(), mixture + (", turning" if twist else "")


def place_inside(points, generator):
    """Anywhere, all of it between the outermost nodes."""
    low, high = points.min(1), points.max(1)
    at = [generator.uniform(-OUTERMOST - low[a], max(-OUTERMOST - low[a], OUTERMOST - high[a])) for a in range(2)]
    return points + np.reshape(at, (2, 1))


def place_beyond(points, pressure, generator):
    """So that up to half of the force acts beyond the outermost nodes of one side; the other way anywhere, corners as
    well. At least 3 mm of the block are left free."""
    moved = place_inside(points, generator)
    axis, side = generator.integers(2), generator.choice([-1, 1])
    along = side * points[axis]
    rows, row_of = np.unique(-along.round(6), return_inverse=True)  # the outermost first; points of one go beyond together
    beyond = np.searchsorted(np.cumsum(np.bincount(row_of, pressure)), generator.uniform(0.05, 0.5), side="right")
    shift = min(OUTERMOST + 2e-6 + rows[max(beyond, 1) - 1], influence.HALF_WIDTH - 3e-3 - along.max())
    moved[axis] = side * (along + shift)
    return moved


def zone(points):
    """Where a load within the nodes is: within a pitch of the outermost nodes at one side, at two, or farther in."""
    near = (abs(points) > OUTERMOST - PITCH).any(1).sum()
    return ["inside", "rim", "corner"][near]


def magnitude(area, generator, least=3, most=750):
    """[N], evenly on a logarithmic scale, so that the mean pressure stays where a gel is linear."""
    most = min(most, PRESSURE_LIMIT * area / GF)
    return GF * np.exp(generator.uniform(np.log(least), np.log(max(most, least))))


def single(shape, generator, beyond=False, force=None, mixture=None):
    """One contact. `force`: its size [N]."""
    points, pressure, area, text = sampled(shape, generator)
    points = place_beyond(points, pressure, generator) if beyond else place_inside(points, generator)
    unit, how = tractions(points, pressure, generator, mixture or ("friction" if shape in PALMS else None))
    if force is None:
        force = magnitude(area, generator, *((100, 1500) if shape in PALMS else ()))
    share = pressure[(abs(points) > OUTERMOST).any(0)].sum()
    at = 1e3 * (points * pressure).sum(1)
    text = f"{shape}, {text} mm, at ({at[0]:.0f}, {at[1]:.0f}) mm, {force / GF:.0f} gf, {how}"
    if beyond:
        text += f", {100 * share:.0f} % beyond"
    where = "palm" if shape in PALMS else "beyond" if share > 0 else zone(points)
    family = f"{shape} beyond" if beyond else shape
    return Load(family, text, points, force * unit, pressure, [slice(0, points.shape[1])], where)


def together(contacts):
    """Contacts as one load."""
    ends = np.cumsum([0] + [one.points.shape[1] for one in contacts])
    points = np.hstack([one.points for one in contacts])
    return Load(
        "several",
        " + ".join(one.text for one in contacts),
        points,
        np.hstack([one.forces for one in contacts]),
        np.concatenate([one.pressure for one in contacts]),
        [slice(a, b) for a, b in zip(ends, ends[1:])],
        zone(points),
    )


def several(generator):
    """Two to four contacts that do not overlap."""
    wanted, contacts = generator.integers(2, 5), []
    for _ in range(100):
        one = single(generator.choice(["ball", "disc", "ring", "bar", "star"]), generator)
        gap = [np.hypot(*(one.points[:, :, None] - two.points[:, None])).min() for two in contacts]
        if min(gap, default=1) > 2e-3:
            contacts.append(one)
        if len(contacts) == wanted:
            break
    return together(contacts)


def draw(family, generator):
    """A Load of the family (FAMILIES). The same generator state gives the same load."""
    if family == "several":
        return several(generator)
    beyond = family.endswith(" beyond")
    return single(family.removesuffix(" beyond"), generator, beyond)


def displacements(thickness, points, forces):
    """Of the markers, 1152 x 3 [m], under forces (3 x P, N; or several such) at points of the surface (2 x P, m), by
    CalculiX; E = 0.18 MPa, Poisson's ratio 0.49. `thickness`: 15, 25 or 40 mm."""
    return influence.of(thickness).displacement(points, forces)


def turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def placed(thickness, points, forces, normal_N, angle, size, place):
    """displacements() of a contact about the origin that is so many times as large, turned, moved (2 x 1, m) and pressed."""
    rotation, forces = turn(angle), forces * normal_N / forces[2].sum()
    forces[:2] = rotation @ forces[:2]
    return displacements(thickness, size * rotation @ points + place, forces)


def patterns(load):
    """Unit forces of each contact by its own pressure, along x, y and z, and turning where it turns: K x 3 x P."""
    result = []
    for part in load.parts:
        pressure, points = load.pressure[part], load.points[:, part]
        columns = [np.outer(axis, pressure) for axis in np.eye(3)]
        arm = points - (points * pressure).sum(1, keepdims=True)
        turning = (arm[0] * load.forces[1, part] - arm[1] * load.forces[0, part]).sum()
        if abs(turning) > 1e-6 * load.size * np.hypot(*arm).max():
            columns.append(np.stack([-pressure * arm[1], pressure * arm[0], 0 * pressure]) / np.hypot(*arm).max())
        for column in columns:
            result.append(np.zeros_like(load.forces))
            result[-1][:, part] = column
    return np.array(result)


def by_patterns(load):
    """Its forces as a sum of patterns(): K amounts."""
    columns = patterns(load).reshape(-1, load.forces.size)
    return np.linalg.lstsq(columns.T, load.forces.ravel(), rcond=None)[0]


CAMERA = (960.0, 157e-3)  # the paper's pinhole: focal length [px], distance of its centre from the touched surface [m]
MARKER_NOISE_PX = 0.0165  # of a coordinate, in a picture
MOTION = np.array([0.02, 0.02, 1e-4, 1e-4])  # of the picture: deviations of shift u, v [px], scale, roll [rad]


def thinned(load):
    """Points and forces with a point for every 3 mm, where its forces are: for small differences of displacements."""
    cells = np.unique(np.round(load.points / 3e-3), axis=1, return_inverse=True)[1]
    weight = np.linalg.norm(load.forces, axis=0)
    points = np.stack([np.bincount(cells, weight * axis) / np.bincount(cells, weight) for axis in load.points])
    return points, np.stack([np.bincount(cells, axis) for axis in load.forces])


def pixels(markers, displacement):
    """How far markers (3 x M, m) move in the picture, ... x M x 2 [px]: as sensor/projection.cpp for a pinhole."""

    def seen(at):
        return CAMERA[0] * np.stack([at[..., 0], -at[..., 1]], -1) / (CAMERA[1] - at[..., 2:])

    return seen(markers.T + displacement) - seen(markers.T)


def bound(load, markers, answers):
    """Cramer-Rao bound of the resultant force's error, root mean square of its length [N], in a single picture, for one
    who knows the shape: contacts by their own pressures (patterns(), whose displacements are `answers`, K x M x 3), how
    strong they are unknown, and the picture's motion, known as well as the gel file says."""
    small = 1e-3  # the projection bends a little: its slope at rest
    columns = pixels(markers, small * answers) / small
    rest = CAMERA[0] * np.stack([markers[0], -markers[1]], 1) / (CAMERA[1] - markers[2])[:, None]
    ones = np.ones(len(rest))
    motion = [np.outer(ones, [1, 0]), np.outer(ones, [0, 1]), rest, np.stack([-rest[:, 1], rest[:, 0]], 1)]
    columns = np.concatenate([columns, motion]).reshape(len(answers) + 4, -1)
    information = columns @ columns.T / MARKER_NOISE_PX**2
    information[-4:, -4:] += np.diag(MOTION**-2)
    covariance = np.linalg.inv(information)[:-4, :-4]
    sums = patterns(load).sum(2)
    return np.sqrt(np.einsum("ki,kl,li->", sums, covariance, sums))
