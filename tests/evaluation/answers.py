"""Fields by the model of an earlier frame: how many, how honest, and how far from the full solves of the same frames.
Called like the paper's experiments; shapes.py draws the loads."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import chain
import influence
import shapes
from chain import GF
from unseen import ALL_KNOWN, OF_A_ZERO, Measured

THICKNESSES = (15, 40)
MOST_SHIFT = 100 / 60  # mm in a frame: 100 mm/s at 60 frames/s
# What happens between the model's frame and the one that is answered, in the order of a load's frames. The first one of
# a load follows the last one of the load before.
CHANGES = ("all is another load", "held", "stronger or weaker", "moved", "another contact comes", "it leaves")
STAYS = (1, 2, 3)  # the numbers of those that a model is to bear


class Series:
    """Random loads, and what becomes of each: frames in the order of CHANGES."""

    def __init__(self, thickness, families, generator):
        self.displacement, self.wrench, self.size, self.family = [], [], [], []
        for family in families:
            load = shapes.draw(family, generator)
            other = shapes.single(generator.choice(["ball", "disc", "bar"]), generator)
            stronger = load.scaled(np.exp(generator.uniform(-0.3, 0.3)))
            moved = shifted(stronger, generator)
            together = shapes.together([moved, other])
            for each in (load, load, stronger, moved, together, moved):
                self.displacement.append(shapes.displacements(thickness, each.points, each.forces))
                self.wrench.append(each.resultant)
                self.size.append(each.size)
                self.family.append(family)
        self.displacement, self.wrench = np.array(self.displacement), np.array(self.wrench)
        self.size, self.family = np.array(self.size), np.array(self.family)
        self.change = np.tile(np.arange(len(CHANGES)), len(families))


def shifted(load, generator):
    """The same a frame later, as far as MOST_SHIFT any way that leaves it on the block."""
    while True:
        length, angle = 1e-3 * generator.uniform(0, MOST_SHIFT), generator.uniform(0, 2 * np.pi)
        points = load.points + length * np.array([[np.cos(angle)], [np.sin(angle)]])
        if abs(points).max() <= influence.HALF_WIDTH - 2e-3:
            return dataclasses.replace(load, points=points)


class Compared:
    """Answers by the model of the frame before beside full solves of the same frames, of all series."""

    def __init__(self, parts):
        self.change, self.family, self.size = (
            np.concatenate([getattr(series, name) for series, _ in parts]) for name in ("change", "family", "size")
        )
        found = chain.Found({name: np.concatenate([one[name] for _, one in parts]) for name in parts[0][1]})
        wrench = np.concatenate([series.wrench for series, _ in parts])
        self.answered = found["answered"][:, 0] > 0
        answers = chain.Found(
            {name.removeprefix("answer_"): value for name, value in found.items() if name.startswith("answer_")}
        )
        self.full, self.answer = Measured(found, wrench, 1), Measured(answers, wrench, 1)
        # Where a zero has just been taken there is no model.
        self.had_model = np.arange(len(wrench)) % (OF_A_ZERO * len(CHANGES)) > 0
        self.limit = np.maximum(GF, 0.015 * self.size)
        self.far = (abs(self.answer.error - self.full.error) / np.maximum(self.full.deviation, 1e-12))[:, 0]
        self.is_same_count = (found["contact_count"] == answers["contact_count"])[:, 0]

    def line(self, chosen):
        """Of some frames: how many, the share that is answered, and of these the figures of both."""
        chosen = chosen & self.had_model
        kept = chosen & self.answered
        cells = [f"{chosen.sum()}", f"{100 * kept.sum() / chosen.sum():.1f} %"]
        if kept.sum() < 10:
            return [*cells, *("–" * 4)]
        both = (self.answer, self.full)
        off = [np.quantile((one.off / self.limit)[kept], 0.95) for one in both]
        return [
            *cells,
            ", ".join(f"{100 * one.covered[kept].mean():.1f}" for one in both) + " %",
            ", ".join(f"{one:.2f}" for one in off),
            ", ".join(f"{one:.2f}" for one in np.quantile(self.far[kept], [0.5, 0.95])),
            f"{100 * self.is_same_count[kept].mean():.0f} %",
        ]


HEADS = ["frames", "answered", "covered", "error / limit", "far from the full solve", "as many contacts"]


def answers(report, quick):
    report.section(
        "Fields by the model of an earlier frame",
        f"""
        The loads of the section before, drawn anew, on blocks of {" and ".join(map(str, THICKNESSES))} mm that are what
        the gel file says. Each frame is answered by the model of the frame before, if the picture does not contradict
        it, and solved in full: both figures are of the frames that are answered, first the answers', then the full
        solves'. Between two frames a load is held, scaled by up to a third, or moves by up to
        {MOST_SHIFT:.1f} mm (100 mm/s at 60 frames/s); another contact comes or leaves; or all is another load.
        Covered: the truth lies in the stated 95 % interval, all six components. Error / limit: 95th percentile of the
        error of the force over the larger of 1 gf and 1.5 % of the load. Far: distance of the two in deviations that the full
        solve states, median and 95th percentile of all components.""",
    )
    with ThreadPoolExecutor(2) as pool:
        seen = Compared(list(pool.map(lambda thickness: series(report, quick, thickness), THICKNESSES)))
    report.table(
        ["since the model's frame", *HEADS],
        [(text, *seen.line(seen.change == number)) for number, text in enumerate(CHANGES)],
    )
    stays = np.isin(seen.change, STAYS)
    report.table(
        ["held, scaled or moved", *HEADS], [(one, *seen.line(stays & (seen.family == one))) for one in shapes.FAMILIES]
    )
    rows(report, seen, stays)


def series(report, quick, thickness):
    generator = np.random.default_rng([report.seed, thickness, 3])
    drawn = Series(thickness, (1 if quick else 40) * shapes.FAMILIES, generator)
    found = chain.run(
        drawn.displacement,
        gel=chain.gel_text(thickness) + ALL_KNOWN,
        zero_every=OF_A_ZERO * len(CHANGES),
        seed=(report.seed + thickness) % 2**20,
        answer=True,
    )
    return drawn, found


def rows(report, seen, stays):
    round_ones = stays & np.isin(seen.family, ["ball", "disc", "ball beyond", "disc beyond"]) & seen.had_model
    others = stays & ~round_ones & seen.had_model
    for label, chosen, least in (("balls and discs", round_ones, 0.95), ("all others", others, 0.8)):
        share = seen.answered[chosen].mean()
        report.row(
            f"answered by the model of the frame before: {label}, held, scaled or moved",
            f"{100 * share:.1f} %",
            f">= {100 * least:.0f} %",
            share,
        )
    for label, chosen in (("held, scaled or moved", stays), ("a contact comes, leaves, or all changes", ~stays)):
        kept = chosen & seen.answered & seen.had_model
        share = seen.answer.covered[kept].mean()
        report.row(
            f"truth inside the stated 95 % interval of answers: {label}",
            f"{100 * share:.1f} %; full solves {100 * seen.full.covered[kept].mean():.1f} %",
            "92 - 98 %",
            share,
        )
