"""Loads nobody has tuned with: how far off, how honest, how sharp. Called like the paper's experiments; shapes.py draws
the loads, limits.py measures what the smallest and the closest are."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

import chain
import coverage
import influence
import limits
import shapes
from chain import GF
from report import rms
from resultants import OUT_OF_RANGE, UNEXPLAINED, beside_meshes

ALL_KNOWN = """[uncertainty]
youngs_modulus_relative = 0
focal_relative = 0
position_mm = [0, 0, 0]
rotation_rad = [0, 0, 0]
poisson_ratio = 0
thickness_mm = 0
layer_depth_mm = 0
"""
ZONES = ["inside", "rim", "corner", "beyond", "palm"]
PALM_LIMIT = {15: 0.06, 25: 0.06, 40: 0.03}
OF_A_CAMERA = 20  # loads that share one
OF_A_ZERO = 20  # loads; a zero takes as long as ten frames


class Drawn:
    """Loads of a block, what they do to its markers, and the least error that is possible."""

    def __init__(self, thickness, families, generator):
        self.thickness = thickness
        self.loads = [shapes.draw(family, generator) for family in families]
        markers = influence.of(thickness).markers
        moved, bounds = [], []
        for load in self.loads:
            answers = shapes.displacements(thickness, load.points, shapes.patterns(load))
            moved.append(np.tensordot(shapes.by_patterns(load), answers, 1))
            bounds.append(shapes.bound(load, markers, answers))
        self.displacement, self.bound = np.array(moved), np.array(bounds)
        self.size = np.array([load.size for load in self.loads])
        self.wrench = np.array([load.resultant for load in self.loads])
        self.zone = np.array([load.zone for load in self.loads])
        self.family = np.array([load.family for load in self.loads])

    def limit(self):
        """What an error is held against [N], by the load's zone."""
        inside = np.maximum.reduce([np.full(len(self.size), GF), 0.015 * self.size, 2 * self.bound])
        beyond = np.maximum(3 * GF, 0.03 * self.size)
        palm = PALM_LIMIT[self.thickness] * self.size
        return np.select([self.zone == "palm", self.zone == "beyond"], [palm, beyond], inside)


class Measured:
    """What the chain made of loads, a few frames each: error and stated deviation, loads x frames x 6."""

    def __init__(self, found, wrench, frames):
        self.found, self.frames = found, frames
        shape = (len(wrench), frames, 6)
        self.error = found.wrench.reshape(shape) - wrench[:, None]
        self.deviation = found.deviation.reshape(shape)
        self.covered = abs(self.error) <= 1.96 * self.deviation
        self.off = rms(np.linalg.norm(self.error[:, :, :3], axis=2), 1)


def known(drawn, frames, seed):
    """The block is what the gel file says."""
    gel = chain.gel_text(drawn.thickness) + ALL_KNOWN
    unit = np.repeat(drawn.displacement, frames, axis=0)
    return Measured(chain.run(unit, gel=gel, zero_every=OF_A_ZERO * frames, seed=seed), drawn.wrench, frames)


def stray_of(drawn, number, generator):
    """What a block of slightly other mechanics, as uncertain as the gel file says, adds to a load's displacements."""
    by, load = coverage.KNOWN["uncertainty"], shapes.thinned(drawn.loads[number])
    poisson, thickness = generator.standard_normal(2) * [by["poisson_ratio"], 1e-3 * by["thickness_mm"]]
    deeper = np.zeros((3, 1152))
    deeper[2] = np.repeat(1e-3 * by["layer_depth_mm"] * generator.standard_normal(2), 576)
    straight = influence.of(drawn.thickness)
    moved = straight.displacement(*load, scatter=deeper) - straight.displacement(*load)
    for name, amount in (("poisson", poisson), ("thickness", thickness)):
        moved += amount * influence.of(drawn.thickness, name).displacement(*load)
    return moved


def strayed(drawn, frames, seed):
    """Each load on a gel, before a camera, in a picture that are drawn from what the gel file states."""
    generator = np.random.default_rng(seed)
    by = coverage.KNOWN["uncertainty"]["youngs_modulus_relative"]
    stiffness = 1 + by * generator.standard_normal(len(drawn.size))
    unit = [moved + stray_of(drawn, i, generator) for i, moved in enumerate(drawn.displacement)]
    unit = np.array(unit) / stiffness[:, None, None]
    parts = []
    for first in range(0, len(unit), OF_A_CAMERA):
        some = unit[first : first + OF_A_CAMERA]
        motion = np.repeat([coverage.draw_motion(generator) for _ in some], frames, axis=0)
        camera = coverage.draw_camera(generator).replace("thickness_mm = 40", f"thickness_mm = {drawn.thickness}")
        parts.append(
            chain.run(
                np.repeat(some, frames, axis=0),
                gel=chain.gel_text(drawn.thickness),
                twin_gel=camera,
                picture=motion,
                zero_every=OF_A_ZERO * frames,
                seed=seed + first + 1,
            )
        )
    found = chain.Found({name: np.concatenate([part[name] for part in parts]) for name in parts[0]})
    return Measured(found, drawn.wrench, frames)


def block(report, quick, thickness):
    """All random loads of a block: drawn, measured as the gel file says, measured with strays."""
    count, frames = (3, 2) if quick else (63, 4)
    families = count * shapes.INSIDE + max(1, count // 2) * shapes.BEYOND + max(2, 2 * count // 3) * shapes.PALMS
    drawn = Drawn(thickness, families, np.random.default_rng([report.seed, thickness]))
    seed = (report.seed + thickness) % 2**20
    return drawn, known(drawn, frames, seed), strayed(drawn, frames, seed)


def unseen(report, quick):
    report.section(
        "Loads nobody has tuned with",
        """
        Shapes, places, forces and mixtures of normal, shear and torsion drawn at random: balls, discs (even,
        domed, hollowed), rings, bars, L, stars, rough patches, two to four of them at once, 3 to 750 gf (at
        most a mean pressure of 2 E); the same with up to half of the force beyond the outermost nodes; palms
        and the whole face, 100 to 1,500 gf. Single frames, error: length of the resultant's, root mean square
        over a load's frames. CR: the Cramer-Rao bound of that length for one who knows the contacts' shapes.
        Truth: CalculiX's influence of surface points (decision 0014). Coverage as in the section on what the
        stated uncertainty covers, with all hidden numbers drawn anew for each load; rim: within a pitch of the
        outermost nodes. Nothing of the solver has been set by these loads: they are another set in each run,
        and what is MISSED is what the solver does not do yet. No figure depends on how busy the machine is.""",
    )
    thicknesses = (15, 40) if quick else influence.THICKNESSES
    with ThreadPoolExecutor(2) as pool:
        blocks = list(pool.map(lambda h: block(report, quick, h), thicknesses))
    truth_row(report, thicknesses)
    for drawn, straight, _ in blocks:
        accuracy(report, drawn, straight)
    honesty(report, blocks)
    families(report, blocks)
    worst(report, blocks)
    limits.limits(report, quick, thicknesses)


def truth_row(report, thicknesses):
    import truth  # the stored loads

    for thickness in thicknesses:
        places = truth.load(thickness, 0.49, "places")
        kept = influence.of(thickness)
        off = []
        for contacts, stored in zip(places.contacts, places.displacement):
            ours = kept.displacement(*truth.quadrature(contacts))
            off.append(np.linalg.norm(ours - stored, axis=1).max() / np.linalg.norm(stored, axis=1).max())
        report.row(
            f"truth of {thickness} mm against the stored loads of a mesh not so fine, {len(off)} loads",
            beside_meshes(max(off), thickness, 0.49),
        )


def accuracy(report, drawn, measured):
    thickness, ratio = drawn.thickness, measured.off / drawn.limit()
    field = np.isin(drawn.zone, ["inside", "rim", "corner"])
    for label, value, limit in (
        ("95th percentile", np.quantile(ratio[field], 0.95), 1.2),
        ("worst", ratio[field].max(), 3),
    ):
        report.row(
            f"{thickness} mm, {field.sum()} loads wholly inside: error / max(1 gf, 1.5 %, 2 CR), {label}",
            f"{value:.2f}",
            f"<= {limit}",
            value,
        )
    over = np.median((measured.off / drawn.bound)[field])
    report.row("    median; median of the error over CR", f"{np.median(ratio[field]):.2f}; {over:.2f}")
    beyond, palm = drawn.zone == "beyond", drawn.zone == "palm"
    value = np.quantile(ratio[beyond], 0.95)
    report.row(
        f"{thickness} mm, {beyond.sum()} loads partly beyond the nodes: error / max(3 gf, 3 %), 95th percentile",
        f"{value:.2f}, worst {measured.off[beyond].max() / GF:.0f} gf",
        "<= 1",
        value,
    )
    relative = measured.off[palm] / drawn.size[palm]
    value = np.quantile(relative, 0.95)
    report.row(
        f"{thickness} mm, {palm.sum()} palms and whole faces: error, 95th percentile",
        f"{100 * value:.1f} %, median {100 * np.median(relative):.1f} %",
        f"<= {100 * PALM_LIMIT[thickness]:.0f} %",
        value,
    )
    flags = measured.found["flags"].ravel().astype(int)
    report.row(
        "    frames flagged unexplained; out of range; none found",
        "; ".join(
            f"{100 * share:.1f} %"
            for share in (
                (flags & UNEXPLAINED > 0).mean(),
                (flags & OUT_OF_RANGE > 0).mean(),
                (measured.found["method"] <= 1).mean(),
            )
        ),
    )


def honesty(report, blocks):
    """Coverage with the strays drawn; all blocks together, a line for each block."""
    zones = np.concatenate([drawn.zone for drawn, _, _ in blocks])
    covered = np.concatenate([measured.covered for _, _, measured in blocks])
    lines = []
    for zone in ZONES:
        for drawn, _, measured in blocks:
            chosen = drawn.zone == zone
            if chosen.any():
                share = [f"{100 * one:.0f} %" for one in measured.covered[chosen].mean((0, 1))]
                lines.append((f"{drawn.thickness} mm, {zone}", str(chosen.sum()), *share))
    report.table(["covered", "loads", *coverage.AXES], lines)
    for label, chosen, target in (
        ("inside", ["inside"], "93 - 97 %"),
        ("rim and corners", ["rim", "corner"], "92 - 98 %"),
        ("partly beyond", ["beyond"], ""),
        ("palms", ["palm"], ">= 92 %"),
    ):
        share = covered[np.isin(zones, chosen)].mean((0, 1))
        report.row(
            f"truth inside the stated 95 % interval, {label}: least and most of the six components",
            f"{100 * share.min():.1f} to {100 * share.max():.1f} %",
            target,
            share,
        )
    family = np.concatenate([drawn.family for drawn, _, _ in blocks])
    shares = {one: covered[family == one].mean() for one in shapes.FAMILIES}
    least = min(shares, key=shares.get)
    report.row(f"    worst family, all components: {least}", f"{100 * shares[least]:.1f} %", ">= 90 %", shares[least])


def families(report, blocks):
    lines = []
    for family in shapes.FAMILIES:
        cells = []
        for drawn, straight, with_strays in blocks:
            chosen = drawn.family == family
            ratio = (straight.off / drawn.limit())[chosen]
            share = 100 * with_strays.covered[chosen].mean()
            cells.append(f"{np.median(ratio):.2f}, {np.quantile(ratio, 0.95):.2f}, {share:.0f} %")
        lines.append((family, *cells))
    heads = [f"{drawn.thickness} mm" for drawn, _, _ in blocks]
    report.table(["error/limit: median, 95th percentile; covered", *heads], lines)


def worst(report, blocks):
    """The ten loads that are farthest beyond their limits."""
    listed = []
    for drawn, measured, _ in blocks:
        ratio = measured.off / drawn.limit()
        listed += [(ratio[i], drawn, measured, i) for i in np.argsort(-ratio)[:10]]
    listed = sorted(listed, key=lambda one: -one[0])[:10]
    lines = []
    for number, (ratio, drawn, measured, i) in enumerate(listed, 1):
        mean = (drawn.wrench[i] + measured.error[i].mean(0))[:3] / GF
        stated = 1.96 * measured.deviation[i, 0, :3] / GF
        lines.append(
            (
                f"{number}",
                f"{drawn.thickness} mm, {drawn.loads[i].text}",
                ", ".join(f"{one:.0f}" for one in drawn.wrench[i, :3] / GF),
                ", ".join(f"{one:.0f} ± {by:.0f}" for one, by in zip(mean, stated)),
                f"{measured.off[i] / GF:.1f}",
                f"{ratio:.1f}",
            )
        )
    report.table(["worst", "load", "true [gf]", "measured, ± stated [gf]", "off [gf]", "off / limit"], lines)

    def draw(panels):
        for number, (axes, (ratio, drawn, measured, i)) in enumerate(zip(panels.ravel(), listed), 1):
            load = drawn.loads[i]
            force = measured.found["force_N"].reshape(-1, measured.frames, 576, 3)[i, 0]
            length = np.linalg.norm(force, axis=1)
            x, y = 1e3 * limits.NODES
            axes.scatter(*1e3 * load.points, c=load.pressure, s=1, cmap="Greys", vmin=0)
            axes.scatter(x, y, s=60 * length / max(length.max(), 1e-9), facecolors="none", edgecolors="C3", lw=0.6)
            axes.set(xlim=(-50, 50), ylim=(-50, 50), aspect="equal")
            title = f"{number}: {drawn.thickness} mm, {load.family}\n{load.size / GF:.0f} gf, {ratio:.1f} x the limit"
            axes.set_title(title, fontsize=8)

    report.picture(
        "worst_shapes",
        draw,
        "The ten worst: where it touches (grey), and the node forces found in one frame (circles, by their size).",
        panels=(2, 5),
    )
