"""Friction of contacts that slide, by what pictures show of their motion. Part of the section of slip.py.

A contact is pulled through the moments of friction.py until all of it slips, and slides on: as its probe moves, about the
point that does not move, or straight. Its tractions go with it: friction does not depend on where it is, nor on speed.
"""

import numpy as np

import chain
import friction
import shapes
import slip_sequences
import truth
from report import rms
from slip_sequences import RATE, THICKNESS
from unseen import ALL_KNOWN

PULLED, SLID = 30, 36  # frames
SPEED = 2e-3, 10e-3  # of the probe's middle [m/s]
SLIDES = 3  # traction::SlipModel
SLIPPING = 3  # touch::SlipState


def moments(name):
    """From little shear until all slips: friction, places about the probe, forces; and the point about which it turns
    [m], if it does."""
    (path,) = truth.DATA.glob(f"{name}_*.npz") if name in friction.TURNING else [truth.DATA / f"{name}.npz"]
    if name in friction.TURNING:
        found = list(friction.moments(path, about_probe=True))
        way, turn = friction.TURNING[name][1:3]
        about = np.array([0, 1e-3 * way / turn]) if turn else None
    else:
        found = [(ball.friction, ball.points + ball.centre[:, None], ball.forces) for ball in friction.balls(path)]
        about = None
    last = np.flatnonzero(friction.slipping(found))[0]
    return [one for one in found[: last + 1] if np.hypot(*one[2][:2].sum(1)) > 0.02 * one[0] * one[2][2].sum()], about


class Slide:
    def __init__(self, name, generator):
        self.name = name
        self.moments, self.about = moments(name)
        self.coefficient = self.moments[0][0]
        used = np.array([friction.loaded(*one) for one in self.moments])
        self.friction = used[-1] * self.coefficient  # that it shows: with its slopes it ploughs
        at = np.linspace(0, len(used) - 1, PULLED)
        self.used = np.interp(at, np.arange(len(used)), used / used[-1])  # in each frame until it slides
        self.speed, self.normal_N = generator.uniform(*SPEED), generator.uniform(2, 6)
        self.turn, self.place = generator.uniform(0, 2 * np.pi), generator.uniform(-0.012, 0.012, (2, 1))
        self.size = generator.uniform(1, 1.3)

    def displacement(self):
        """Of each frame."""
        pulled = np.array([self._shown(points, forces) for _, points, forces in self.moments])
        at = np.linspace(0, len(pulled) - 1, PULLED)
        shown = [np.tensordot(np.interp(np.arange(len(pulled)), *self._between(one)), pulled, 1) for one in at]
        _, points, forces = self.moments[-1]
        for way in self.speed / self.size / RATE * np.arange(1, SLID + 1):
            if self.about is None:
                shown.append(self._shown(points + [[way], [0]], forces))
                continue
            rotation = shapes.turn(way / np.linalg.norm(self.about))
            away = points - self.about[:, None]
            turned_forces = np.vstack([rotation @ forces[:2], forces[2:]])
            shown.append(self._shown(self.about[:, None] + rotation @ away, turned_forces))
        return np.array(shown)

    def _between(self, at):
        """Weight 1 of the moment at this place among them, falling to 0 at its neighbours."""
        low = np.floor(at)
        return [low - 1, low, low + 1, low + 2], [0, low + 1 - at, at - low, 0]

    def _shown(self, points, forces):
        return shapes.placed(THICKNESS, points, forces, self.normal_N, self.turn, self.size, self.place)


def slides(report, quick, generator, names):
    drawn = [Slide(name, generator) for name in names for _ in range(1 if quick else 6)]
    found = chain.run(
        np.concatenate([one.displacement() for one in drawn]),
        gel=chain.gel_text(THICKNESS) + ALL_KNOWN,
        zero_every=PULLED + SLID,
        seed=report.seed % 2**20,
        as_daemon=True,
    )
    judged = slip_sequences.judged(slip_sequences.observations(found, len(drawn) * [PULLED + SLID]))
    alarms = {one.name: [] for one in drawn}
    early, way, off, covered, given, slipping = 0, [], [], [], [], []
    for one, by in zip(drawn, judged):
        slid = by[:, 9] == SLIDES
        early += slid[:PULLED].any()
        alarms[one.name].append((slip_sequences.alarm(by)[:PULLED] & (one.used < 0.7)).any())
        first = np.flatnonzero(slid[PULLED:])
        way.append(1e3 * one.speed * (first[0] + 1) / RATE if len(first) else np.inf)
        state, mu, low, high = by[PULLED + first][:, [0, 4, 5, 6]].T
        off += list(mu / one.friction - 1)
        covered += list((low <= one.friction) & (one.friction <= high))
        given += list((low <= one.coefficient) & (one.coefficient <= high))
        slipping += list(state == SLIPPING)
    off, way = np.array(off), np.array(way)
    report.row(
        "slides that are seen; way until then, median, largest",
        f"{np.isfinite(way).sum()} of {len(way)}; {np.median(way):.1f}, {way.max():.1f} mm",
        ">= 95 %",
        np.isfinite(way).mean(),
    )
    report.row("contacts that are pulled and taken for sliding before all slips", f"{early} of {len(drawn)}", "0", early)
    report.row(
        "slides: friction off, mean and rms; covered by its interval (CalculiX's coefficient); frames called slipping",
        f"{100 * off.mean():+.0f} %, {100 * rms(off):.0f} %; {100 * np.mean(covered):.0f} % "
        f"({100 * np.mean(given):.0f} %); {100 * np.mean(slipping):.0f} %",
        ">= 93 %",
        np.mean(covered),
    )
    told = ", ".join(f"{name.replace('_', ' ')} {sum(each)} of {len(each)}" for name, each in alarms.items())
    report.row("alarm while less than 70 % of the friction is used", told)
