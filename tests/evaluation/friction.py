"""The truth of contacts under shear and torque, by CalculiX (ccx): contact with Coulomb's friction on an elastic block.

A rigid ball is pressed into the block and then moved sideways until it slips. Half of the block is meshed (mirror plane
y = 0), all of it for a probe of TURNING; some of these are moved back part of the way. Small strain, face-to-face contact
with penalties. All nodes of the ball are held, so their reactions are the forces of contact. Lengths in mm, forces in N, stresses in MPa.
"""

import dataclasses
import pathlib

import numpy as np
from calculix import run

DATA = pathlib.Path(__file__).parent / "data"

YOUNG, POISSON = 0.18, 0.49
RADIUS, DEPTH = 40.0, 0.45  # of the ball; its motion inwards. Sideways: beyond where it slips
PENALTY, STICK = 5.0, 1.0  # [MPa/mm]


def sphere(x, y):
    return (x**2 + y**2) / (2 * RADIUS)


def bar(x, y):
    """A flat face of 8 x 3 mm, with edges of 4 mm radius."""
    return (np.maximum(abs(x) - 4, 0) ** 2 + np.maximum(abs(y) - 1.5, 0) ** 2) / 8


def punch(x, y):
    """A flat face of 6 mm diameter, with an edge of 2 mm radius."""
    return np.maximum(np.hypot(x, y) - 3, 0) ** 2 / 4


def roller(x, y):
    """A cylinder of 10 mm radius on its side, 6 mm long, with ends of 4 mm radius."""
    return y**2 / 20 + np.maximum(abs(x) - 3, 0) ** 2 / 8


REACH = 6.5  # from the middle, that may touch
# Way sideways [mm], turn [rad], both per friction; the part of them to which it goes back, if it does, and REACH.
# With half the mesh, punch and roller bear 1 and 2 % more load when all slips; the mean distance of their pressure
# from its centre, over the mean radius of its ellipse, is 0.765 instead of 0.751 and 0.70 instead of 0.715.
TURNING = {
    "twisted_ball": (sphere, 0.0, 0.3, None, REACH),
    "bar": (bar, 1.4, 0.3, None, REACH),
    "pulled_punch": (punch, 0.9, 0.0, None, 4.5),
    "punch": (punch, 0.9, 0.3, 0.8, 4.5),
    "roller": (roller, 0.9, 0.3, 0.8, 5.5),
}


def axes(mesh, reach=REACH):
    """Planes of the block: even steps under the ball, then wider ones."""
    fine = np.arange(0, reach + 1e-9, mesh)
    across = np.concatenate([fine, reach + np.array([1.5, 4, 8, 14, 23])])
    z = np.concatenate([np.arange(0, 2 + 1e-9, mesh), [3, 4.5, 6.5, 9, 13, 18, 25]])
    return np.concatenate([-across[:0:-1], across]), across, z


def bricks(x, y, z, first):
    """Nodes (n x 3) and bricks (8 corners each) of a box; numbers from `first`."""
    nodes = np.stack(np.meshgrid(x, y, z, indexing="ij"), -1).reshape(-1, 3)
    number = first + np.arange(len(nodes)).reshape(len(x), len(y), len(z))
    c = number[:-1, :-1, :-1], number[1:, :-1, :-1], number[1:, 1:, :-1], number[:-1, 1:, :-1]
    d = number[:-1, :-1, 1:], number[1:, :-1, 1:], number[1:, 1:, 1:], number[:-1, 1:, 1:]
    return nodes, number, np.stack([*c, *d], -1)


def deck(mesh, friction, surface=sphere, way=1.4, turn=None, back=None, reach=REACH):
    """Lines, and places and numbers of the probe's nodes that may touch. \\param turn None: half of all is meshed"""
    x, y, z = axes(mesh, reach)
    if turn is not None:
        y = x
    nodes, number, cells = bricks(x, y, z, 1)
    near = x[abs(x) <= 8.6]
    ball, ball_number, ball_cells = bricks(near, y[abs(y) <= 8.6], np.array([-2.0, 0.0]), len(nodes) + 1)
    ball[:, 2] -= surface(ball[:, 0], ball[:, 1])
    everything = np.vstack([nodes, ball])
    lines = ["*NODE, NSET=ALL"] + [f"{n},{p[0]:.9g},{p[1]:.9g},{p[2]:.9g}" for n, p in enumerate(everything, 1)]
    count = 0
    for name, part in (("GEL", cells), ("BALL", ball_cells)):
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}")
        for corners in part.reshape(-1, 8):
            count += 1
            lines.append(f"{count}," + ",".join(map(str, corners)))
    gel_elements = 1 + np.arange(cells[..., 0].size).reshape(cells.shape[:3])
    ball_elements = gel_elements.size + 1 + np.arange(ball_cells[..., 0].size).reshape(ball_cells.shape[:3])
    middle_x, middle_y = (x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2
    under = gel_elements[np.ix_(abs(middle_x) < reach, abs(middle_y) < reach, [0])].ravel()
    base = number[:, :, -1].ravel()
    mirror = number[:, 0, :-1].ravel() if turn is None else []
    lines += ["*SURFACE, NAME=TOUCHED, TYPE=ELEMENT"] + [f"{e},S1" for e in under]
    lines += ["*SURFACE, NAME=PROBE, TYPE=ELEMENT"] + [f"{e},S2" for e in ball_elements[:, :, -1].ravel()]
    lines += ["*NSET, NSET=HELD", *[f"{n}," for n in ball_number.ravel()], "*NSET, NSET=BASE", *[f"{n}," for n in base]]
    if turn is None:
        lines += ["*NSET, NSET=MIRROR", *[f"{n}," for n in mirror]]
    lines += ["*NSET, NSET=BELOW", *[f"{n}," for n in ball_number[:, :, -1].ravel()]]
    lines += ["*MATERIAL, NAME=RUBBER", "*ELASTIC", f"{YOUNG},{POISSON}", "*MATERIAL, NAME=STEEL", "*ELASTIC", "1.0,0.3"]
    lines += ["*SOLID SECTION, ELSET=GEL, MATERIAL=RUBBER", "*SOLID SECTION, ELSET=BALL, MATERIAL=STEEL"]
    lines += ["*SURFACE INTERACTION, NAME=RUB", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{PENALTY},"]
    lines += ["*FRICTION", f"{friction},{STICK}"]
    lines += ["*CONTACT PAIR, INTERACTION=RUB, TYPE=SURFACE TO SURFACE", "TOUCHED,PROBE"]
    lines += ["*BOUNDARY", "BASE,1,3", "HELD,1,3"] + (["MIRROR,2,2"] if turn is None else [])
    for step, share in enumerate([0.0, friction] + ([] if back is None else [back * friction])):
        lines += ["*STEP, INC=400", "*STATIC", "0.04,1.0,1e-4,0.07" if step else "0.2,1.0"]
        lines += ["*BOUNDARY", f"HELD,3,3,{DEPTH}"]
        if turn is None:
            lines += [f"HELD,1,1,{way * share}", "HELD,2,2,0.0"]
        else:
            for n, (px, py, _) in zip(ball_number.ravel(), ball):
                lines += [f"{n},1,1,{share * (way - turn * py):.9g}", f"{n},2,2,{share * turn * px:.9g}"]
        lines += ["*NODE PRINT, NSET=BELOW", "RF", "*END STEP"]
    return lines, ball[ball_number[:, :, -1].ravel() - len(nodes) - 1], ball_number[:, :, -1].ravel()


def forces(path, numbers):
    """Times and, of each, the forces on the ball's nodes: nodes x 3. The other half is not in them."""
    times, found = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if line.lstrip().startswith("forces"):
            times.append(float(words[-1]))
            found.append({})
        elif len(words) == 4 and found:
            found[-1][int(words[0])] = [float(word) for word in words[1:]]
    return np.array(times), np.array([[one[n] for n in numbers] for one in found])


@dataclasses.dataclass
class Ball:
    """A ball's contact at one moment, about its centre."""

    time: float
    friction: float
    total: np.ndarray  # 3 [N]
    stick: float  # radius of the area that sticks, over the contact's
    radius: float
    centre: np.ndarray  # of the pressure [m]
    points: np.ndarray  # 2 x P [m]
    forces: np.ndarray  # 3 x P [N]

    @property
    def share(self):
        """Of the shear at which all slips."""
        return self.total[0] / self.friction / self.total[2]


def loaded(friction, points, forces):
    """Part of the friction that is used, over all nodes."""
    return np.linalg.norm(forces[:2], axis=0).sum() / friction / forces[2].sum()


def moments(path, about_probe=False):
    """Each moment of the file of a probe of TURNING: friction, places about the centre of pressure or the probe's,
    forces."""
    found = np.load(path)
    for force in found["force"].astype(float):
        pressed = force[:, 2] > 0.002 * force[:, 2].max()
        place = found["position"][:, :2]
        if not about_probe:
            place = place - force[:, 2] @ place / force[:, 2].sum()
        yield float(found["friction"]), 1e-3 * place[pressed].T, force[pressed].T


def slipping(which):
    """Whether all slips in each of the moments of one probe: the part of the friction that is used differs from 1 by the
    probe's slopes and the contact's penalties."""
    used = np.array([loaded(*one) for one in which])
    return used > 0.98 * used.max()


def widths(axis):
    steps = np.diff(axis) / 2
    return np.append(steps, 0) + np.append(0, steps)


def balls(path):
    """Each moment of the file of a ball."""
    found = np.load(path)
    friction, place = float(found["friction"]), found["position"]
    area = 2 * np.outer(*(widths(np.unique(place[:, axis])) for axis in (0, 1))).ravel()
    normal = np.c_[place[:, :2] / RADIUS, np.ones(len(place))]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for time, half in zip(found["time"], found["force"].astype(float)):
        force = 2 * half
        press = (force * normal).sum(1)
        slides = np.linalg.norm(force - press[:, None] * normal, axis=1) > 0.97 * friction * np.maximum(press, 1e-12)
        touches = press > 0.002 * press.max()
        away = place[:, :2] - [(press * place[:, 0]).sum() / press.sum(), 0]
        radius = np.sqrt(2.5 * (press * (away**2).sum(1)).sum() / press.sum())
        stick = np.sqrt(area[touches & ~slides].sum() / np.pi) / radius
        points, forces = np.r_[away, away * [1, -1]], np.r_[half, half * [1, -1, 1]]  # the other half mirrors it
        used = np.tile(touches, 2)
        centre = 1e-3 * (place[:, :2] - away)[0]
        yield Ball(time, friction, force.sum(0), stick, 1e-3 * radius, centre, 1e-3 * points[used].T, forces[used].T)


def main(folder):
    """Computes the files of the evaluation."""
    for mesh, friction, probe in (
        (0.65, 0.3, "ball"),
        (0.5, 0.5, "ball"),
        (0.65, 0.8, "ball"),
        (0.8, 0.5, "twisted_ball"),
        (1.0, 0.5, "bar"),
        (1.0, 0.3, "punch"),
        (1.0, 0.5, "pulled_punch"),
        (1.0, 0.8, "roller"),
    ):
        name = f"{probe}_{mesh}_{friction}"
        lines, place, numbers = deck(mesh, friction, *TURNING.get(probe, ()))
        run(folder, name, lines, threads=1, may_end_early=True)
        times, force = forces(folder / f"{name}.dat", numbers)
        np.savez_compressed(DATA / f"{name}.npz", friction=friction, time=times, position=place, force=force.astype("f4"))
