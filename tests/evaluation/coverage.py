"""How often the stated intervals hold the truth. Called like the paper's experiments."""

import tomllib

import numpy as np

import chain
import truth
from chain import GF
from report import SOURCE

KNOWN = tomllib.loads((SOURCE / "config/gels/paper.toml").read_text())  # and how well: what the daemon states
AXES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
WEIGHT_GF = 200
OF_WEIGHTS = 0.005  # deviation of Young's modulus by weights
FRAMES = 10
HAND_MADE_MM = 0.1  # deviation of a marker's depth in a layer that was made by hand


class Mechanics:
    """Displacements of the random loads, and of the probe's press after them, under blocks that are not quite the gel
    file's."""

    def __init__(self):
        self.loads = truth.load(40, 0.49, "random")
        self.straight = truth.join(self.loads, truth.load(40, 0.49, "probe")).displacement
        self.by = [truth.load(40, 0.49, f"strayed_{name}").displacement for name in ("poisson", "thickness", "depth")]

    def draw(self, generator, scatter_mm=0.0):
        """A block of its own: a function from the load's number to displacements per newton. `scatter_mm`: deviation of a
        marker's depth."""
        by = KNOWN["uncertainty"]
        poisson, thickness = generator.standard_normal(2) * [by["poisson_ratio"], 1e-3 * by["thickness_mm"]]
        depth = np.repeat(1e-3 * by["layer_depth_mm"] * generator.standard_normal(2), 576)
        if scatter_mm > 0:
            depth += 1e-3 * scatter_mm * generator.standard_normal(len(depth))
        return lambda number: (
            self.straight[number]
            + poisson * self.by[0][number]
            + thickness * self.by[1][number]
            + depth[:, None] * self.by[2][number]
        )


def draw_camera(generator):
    """A gel file with the true camera."""
    camera, by = KNOWN["camera"], KNOWN["uncertainty"]
    return chain.gel_text(
        position=camera["position_mm"] + by["position_mm"] * generator.standard_normal(3),
        rotation=camera["rotation_rad"] + by["rotation_rad"] * generator.standard_normal(3),
        focal=camera["focal_px"] * (1 + by["focal_relative"] * generator.standard_normal()),
    )


def draw_motion(generator):
    """How a frame's picture strays, with its brightness."""
    by = KNOWN["picture_motion"]
    return [*generator.standard_normal(4) * [by["shift_px"], by["shift_px"], by["scale"], by["roll_rad"]], 1.0]


WEIGHED = f"""
[uncertainty]
youngs_modulus_relative = {OF_WEIGHTS}
[calibration]
camera = "evaluation"
date = "2026-11-20T08:10:00Z"
geometry = "2026-11-20T08:00:00Z"
stiffness = "2026-11-20T08:10:00Z"
hash = "{32 * '0'}"
"""


def random_loads(count, groups, seed, weighed=False, broken=0.0, scatter_mm=0.0):
    """Errors, frames x 6, and their stated deviations. The loads of a group share a camera, and which markers are broken:
    `broken` is their share. `scatter_mm`: deviation of a marker's depth, which the gel file states."""
    generator, mechanics = np.random.default_rng(seed), Mechanics()
    number_of, probe = len(mechanics.loads.displacement), len(mechanics.straight) - 1
    forces, moments = mechanics.loads.forces(), mechanics.loads.moments()
    gel = chain.gel_text() + (WEIGHED if weighed else "")
    if scatter_mm > 0:
        gel += f"[uncertainty]\nmarker_depth_mm = {scatter_mm}\n"
    errors, deviations = [], []
    for group in range(groups):
        camera, displacement, weights, stray, true = draw_camera(generator), [], [], [], []
        for index in range(group * count // groups, (group + 1) * count // groups):
            load, block = index % number_of, mechanics.draw(generator, scatter_mm)
            force = np.exp(generator.uniform(np.log(5), np.log(400))) * GF
            stiffness = 1 + KNOWN["uncertainty"]["youngs_modulus_relative"] * generator.standard_normal()
            displacement.append(np.repeat(force / stiffness * block(load)[None], FRAMES, axis=0))
            weights.append(WEIGHT_GF * GF / stiffness * block(probe))
            stray.append(np.tile(draw_motion(generator), (FRAMES, 1)))
            true.append(np.concatenate([force * forces[load], force * moments[load]]))
        found = chain.run(
            np.concatenate(displacement),
            gel=gel,
            twin_gel=camera,
            picture=np.concatenate(stray),
            zero_every=FRAMES,
            seed=group + 1,
            **drawn_without(broken, FRAMES * len(true), generator),
        )
        factor = np.ones(len(true))
        if weighed:  # as a weight would have it, put on once for each load's gel
            read = chain.run(np.array(weights), gel=gel, twin_gel=camera, given=0).resultant_N[:, 2]
            factor = WEIGHT_GF * GF / read * (1 + OF_WEIGHTS * generator.standard_normal(len(true)))
        factor = np.repeat(factor, FRAMES)[:, None]
        errors.append(factor * found.wrench - np.repeat(true, FRAMES, axis=0))
        deviations.append(factor * found.deviation)
    return np.concatenate(errors), np.concatenate(deviations)


def drawn_without(share, frames, generator):
    """Returns arguments of chain.run() for a gel of which this share of the dots is broken, also in the zero: displacements as
    they are, with the noise of tracking [px]."""
    if share == 0:
        return {}
    gone = np.tile(generator.random(2 * 576) < share, (frames, 1))
    return {"missing": gone, "solve": f"max_missing_fraction = {share + 0.1}", "given": 0.017}


def rows(report, errors, deviations, label):
    for axis, component in enumerate(AXES):
        width = 2 * 1.96 * np.median(deviations[:, axis]) / GF * (1 if axis < 3 else 1e3)
        share = (abs(errors[:, axis]) <= 1.96 * deviations[:, axis]).mean()
        report.row(
            f"truth inside the stated 95 % interval{label}, {component}",
            f"{100 * share:.1f} %, median width {width:.1f} {'gf' if axis < 3 else 'gf mm'}",
            "92 - 98 %",
            share,
        )


def coverage(report, quick):
    report.section(
        "What the stated uncertainty covers",
        """
        Random loads (place, radius 1.5 to 6 mm, up to 45 degrees from the normal, 5 to 400 gf), 10 frames each. For
        each load the gel's true stiffness, Poisson's ratio, thickness and depths of the layers, the camera's true pose
        and focal length and the picture's motion are drawn from the standard deviations that the gel file states; the
        daemon does not know them. Covered: the truth lies within 1.96 stated deviations. With weights: Young's modulus
        is what makes a press of 200 gf near the centre read right, to 0.5 %, with these hidden numbers. Broken dots are
        drawn at random for each camera.""",
    )
    for label, groups, how in (
        ("", 160, {"seed": 20053}),  # a load comes four times, with other forces, gels and cameras
        (", two fifths of the dots broken", 80, {"seed": 20057, "broken": 0.4}),
        (f", depths of the markers scattered by {HAND_MADE_MM} mm", 80, {"seed": 20059, "scatter_mm": HAND_MADE_MM}),
        (" with weights", 80, {"seed": 20055, "weighed": True}),
    ):
        rows(report, *random_loads(*((40, 10) if quick else (5 * groups, groups)), **how), label)
