"""Sums over the whole face: how far they are off, and what disturbs them. Called like the paper's experiments."""

from concurrent.futures import ThreadPoolExecutor
from statistics import NormalDist

import numpy as np

import chain
import loads
import truth
from chain import GF
from report import rms
from truth import probe

UNEXPLAINED, OUT_OF_RANGE = 1 << 5, 1 << 6  # of the field's flags


def monochrome(report, quick):
    report.section(
        "Black dots behind a monochrome camera",
        """
        One of the paper's layers alone, of markers darker than the gel around them (contrast 100 below a background of
        150 levels, noise 2), in pictures without colours. 400 gf of the paper's probe, from the normal to 30 degrees off
        it, single frames, each with a zero of its own. The layer at 8 mm is that of `config/gels/black_dots.toml`; at
        6 mm a lone layer reads a small probe too high.""",
    )
    trials = 6 if quick else 20
    degrees = np.repeat([0, 15, 30], trials)
    forces = 400 * GF * np.stack([np.sin(np.radians(degrees)), 0 * degrees, np.cos(np.radians(degrees))], 1)
    both = probe(forces)
    for depth, pixel_format, target in ((8, "Mono8", "<= 2 %"), (8, "Mono12p", ""), (6, "Mono8", "")):
        blue = depth == 6
        found = chain.run(
            both[:, :576] if blue else both[:, 576:],
            gel=chain.one_layer_text(depth=depth, centre_mm=0 if blue else 1.5),
            zero_every=1,
            format=pixel_format,
            background=150,
        )
        off = np.linalg.norm(found.resultant_N, axis=1) / np.linalg.norm(forces, axis=1) - 1
        report.row(
            f"400 gf, one layer of black dots at {depth} mm, {pixel_format}: magnitude",
            f"{100 * rms(off):.2f} % off, mean {100 * off.mean():+.2f} %",
            target,
            rms(off),
            must=True,
        )


def mechanics(report, quick):
    report.section(
        "The block's mechanics against CalculiX",
        """
        Largest distance between the markers' displacements of the two programs in parts of the largest displacement
        under the same load. CalculiX's own error is estimated by a mesh twice as coarse, at the markers that are
        nodes of both: the difference, of which the finer mesh has a quarter or less.""",
    )
    worst = []
    for poisson in (0.49, 0.4999) if quick else (0.3, 0.45, 0.49, 0.4999):
        off = off_the_peak(truth.load(40, poisson, "places" if poisson == 0.49 else "centre"), chain.gel_text(poisson=poisson))
        worst.append(off.max())
        report.row(f"block of 40 mm, Poisson's ratio {poisson}, {len(off)} loads", beside_meshes(off.max(), 40, poisson))
    report.row(
        "marker displacement of the block against CalculiX, largest",
        f"{100 * max(worst):.2f} % of the peak",
        "<= 0.7 %",
        max(worst),
        must=True,
    )
    for thickness in () if quick else (15, 25):
        off = off_the_peak(truth.load(thickness, 0.49, "places"), chain.gel_text(thickness))
        report.row(f"block of {thickness} mm, Poisson's ratio 0.49", beside_meshes(off.max(), thickness, 0.49))


def off_the_peak(places, gel):
    """How far the block's displacements are from CalculiX's, of the largest one, for each load."""
    off = np.linalg.norm(chain.mechanics(gel, force_rows(places)) - places.displacement, axis=2).max(1)
    return off / np.linalg.norm(places.displacement, axis=2).max(1)


def beside_meshes(off, thickness, poisson):
    return f"{100 * off:.2f} % of the peak (meshes {100 * mesh_difference(thickness, poisson):.2f} %)"


def mesh_difference(thickness, poisson):
    return float(np.loadtxt(truth.DATA / f"{thickness}_{poisson}_mesh_difference.txt"))


def force_rows(load_set):
    rows = []
    for number, contacts in enumerate(load_set.contacts):
        for contact in contacts[~np.isnan(contacts[:, 0])]:
            points, forces = loads.patch(truth.SHAPES[int(contact[0])], contact[1:3], contact[3], contact[4:7])
            rows.append(np.column_stack([np.full(points.shape[1], number), points.T, forces.T]))
    return np.concatenate(rows)


def bias(report, quick):
    report.section(
        "Bias of the resultant",
        """
        Mean over frames of the resultant less the truth, its length, for Hertz pressures of 5 mm diameter at eight
        places (near the centre, off it, near sides and in corners), along x, y and z, 5 to 400 gf; for 40 mm besides
        even discs of 20 mm diameter and 20 random loads. The solver alone is given the exact displacements.""",
    )
    frames = 10 if quick else 200  # the limit is half of one frame's deviation, and means are to be far below it
    for thickness in (15, 40):
        sets = [truth.load(thickness, 0.49, "places")]
        if thickness == 40:
            sets += [truth.load(40, 0.49, "disc"), truth.load(40, 0.49, "random")]
            sets[2] = truth.Set(sets[2].contacts[:20], sets[2].displacement[:20])
        unit = np.concatenate([one.displacement for one in sets])
        forces = np.concatenate([one.forces() for one in sets])
        contacts = np.concatenate([one.contacts[:, 0] for one in sets])
        listed, alone, noise = [], [], 0.0
        gel = chain.gel_text(thickness)

        def measure(magnitude_gf):
            displacement = magnitude_gf * GF * unit
            exact = chain.run(displacement, gel=gel, given=0)
            found = chain.run(np.repeat(displacement, frames, axis=0), gel=gel, zero_every=5)
            return exact.resultant_N / GF, found.resultant_N.reshape(len(unit), frames, 3) / GF

        chain.run(unit[:1], gel=gel, given=0)  # makes the factors, once
        magnitudes_gf = (5, 20, 50, 100, 400)
        with ThreadPoolExecutor(2) as pool:
            measured = list(pool.map(measure, magnitudes_gf))
        for magnitude_gf, (exact, total) in zip(magnitudes_gf, measured):
            limit = max(1, 0.015 * magnitude_gf)
            alone += list(np.linalg.norm(exact - magnitude_gf * forces, axis=1) / limit)
            noise = max(noise, rms(np.linalg.norm(total.std(1), axis=1)) / np.sqrt(frames))
            for mean, force, contact in zip(total.mean(1), magnitude_gf * forces, contacts):
                off = np.linalg.norm(mean - force)
                listed.append((off / limit, off, magnitude_gf, contact, force, mean))
        listed.sort(key=lambda one: -one[0])
        worst, off, magnitude_gf, *_ = listed[0]
        report.row(
            f"bias of the resultant, {thickness} mm, {len(listed)} loads; worst",
            f"{off:.1f} gf of {magnitude_gf} gf",
            "max(1 gf, 1.5 %)",
            worst,
            paper="unknown",
            within=(0, 1),
        )
        report.row("    loads beyond it", f"{sum(one[0] > 1 for one in listed)} of {len(listed)}")
        report.row("    noise that is left in these means", f"{noise:.1f} gf")
        report.row("    beyond it by the solver alone", f"{sum(np.array(alone) > 1)} of {len(alone)}")
        report.table(
            ["load", "at [mm]", "force [gf]", "measured [gf]", "off [gf]"],
            [
                (
                    f"{truth.SHAPES[int(contact[0])]}, {2e3 * contact[3]:.0f} mm across",
                    f"{1e3 * contact[1]:.0f}, {1e3 * contact[2]:.0f}",
                    ", ".join(f"{value:.0f}" for value in force),
                    ", ".join(f"{value:.1f}" for value in measured),
                    f"{off:.1f}",
                )
                for _, off, _, contact, force, measured in listed[:5]
            ],
        )


def missing(report, quick):
    report.section(
        "Missing markers",
        "400 gf at 25 degrees under the probe; a tenth of the markers, others in each frame, not drawn.",
    )
    frames = 600 if quick else 2000
    force = 400 * GF * np.array([np.sin(np.radians(25)), 0, np.cos(np.radians(25))])
    displacement = np.repeat(probe(force[None]), frames, axis=0)
    gone = np.random.default_rng(20054).random((frames, displacement.shape[1])) < 0.1
    spread = []
    for mask in (None, gone):
        found = chain.run(displacement, missing=mask)
        spread.append(found.resultant_N.std(axis=0) / GF)
    report.row("deviation of the resultant (x, y, z), all markers", "{:.2f}, {:.2f}, {:.2f} gf".format(*spread[0]))
    report.row("    a tenth missing", "{:.2f}, {:.2f}, {:.2f} gf".format(*spread[1]))
    growth = np.linalg.norm(spread[1]) / np.linalg.norm(spread[0]) - 1
    report.row("10 % of the markers missing: growth of the resultant's deviation", f"{100 * growth:+.0f} %", "<= 15 %", growth)


STRAIN_LIMIT = 0.25  # as in daemon/solve/large_strain.cpp
STRAIN_BANDS = [0, 0.05, 0.1, 0.15, 0.2, STRAIN_LIMIT, 0.3, 0.4, 0.6, 1, np.inf]


def marker_strain(force_N):
    """The largest strain below a node at the blue markers by Boussinesq: frames, from forces frames x 576 x 3."""
    nodes, depth = loads.nodes(), 6e-3
    squares = ((nodes[:, :, None] - nodes[:, None]) ** 2).sum(0)
    pressure = 1.5 / np.pi * depth**3 / (squares + depth**2) ** 2.5
    return (np.linalg.norm(force_N, axis=2) @ pressure).max(1) / chain.YOUNG


def chance(bias):
    """Of a 95 % interval to hold what is so many deviations off in the mean."""
    normal = NormalDist()
    return normal.cdf(1.96 - bias) - normal.cdf(-1.96 - bias)


def large_strain(report, quick):
    frames, places = 10, [(0.7e-3, 0.4e-3)] if quick else [(0.7e-3, 0.4e-3), (12e-3, -9e-3)]
    probes, rows = truth.Probes(), []
    for place in places:
        pressed = probes.at(place)
        found = chain.run(np.repeat(pressed.displacement, frames, axis=0), zero_every=frames)
        deviation = found.deviation.reshape(-1, frames, 6).mean(1)
        wrench = found.wrench.reshape(-1, frames, 6).mean(1)
        true = np.hstack([pressed.forces(), pressed.moments()])
        out_of_range = (found["flags"].astype(int) & OUT_OF_RANGE > 0).reshape(-1, frames).mean(1)
        strain = marker_strain(found.force_N.reshape(-1, 576, 3)).reshape(-1, frames).mean(1)
        for i in range(len(true)):
            off = np.linalg.norm(wrench[i, :3]) / true[i, 2] - 1
            bias = (wrench[i] - true[i]) / deviation[i]
            held = np.array([chance(one) for one in bias])
            rows.append((off, held, strain[i], out_of_range[i]))
    report.section(
        "Large strain",
        """
        Rigid probes are pressed into a neo-Hookean gel with contact and large deformations
        (`tests/evaluation/indentation.py`, axisymmetric, a program of our own that agrees with Hertz's solution at
        small forces, and with CalculiX where the pressure is prescribed). The solver is linear. Each near the centre
        of the face and at (12, -9) mm, 10 frames with a zero. "Sticks": what touches the probe stays where it
        touched; else there is no friction. Beyond the last force of a probe no equilibrium is found: it sinks in.
        Covered: how often the stated 95 % interval of a quantity would hold the truth if what the gel file states
        were drawn; it is exact here, and the error is the one of large strain. Strain: the largest below a node at
        the depth of the nearest markers, by Boussinesq's solution for the forces that were found, as
        `FLAG_OUT_OF_RANGE` is set by: above 0.25.""",
    )
    lines = []
    for low, high in zip(STRAIN_BANDS[:-1], STRAIN_BANDS[1:]):
        band = [row for row in rows if low <= row[2] < high]
        if band:
            off, held = np.array([row[0] for row in band]), np.array([row[1] for row in band])
            lines.append(
                (
                    f"{low:.2f} – {high:.2f}" if high < np.inf else f"above {low:.0f}",
                    str(len(band)),
                    f"{100 * rms(off):.1f} %",
                    f"{100 * off[abs(off).argmax()]:+.1f} %",
                    f"{100 * held[:, 2].mean():.0f} %",
                    f"{100 * held[:, 2].min():.0f} %",
                    f"{100 * held[:, 3:5].mean():.0f} %",
                    f"{100 * np.mean([row[3] for row in band]):.0f} %",
                )
            )
    report.table(
        ["strain", "loads", "length off, rms", "worst", "Fz covered", "least", "Mx, My covered", "flagged"], lines
    )
    prescribed(report)


def prescribed(report):
    """Pressures and shears on a fixed circle, by CalculiX."""
    large, frames = truth.load(40, 0.49, "large"), 10
    found = chain.run(np.repeat(large.displacement, frames, axis=0), zero_every=frames)
    mean = found.resultant_N.reshape(-1, frames, 3).mean(1) / GF
    strain = marker_strain(found.force_N.reshape(-1, 576, 3)).reshape(-1, frames).mean(1)
    report.table(
        ["CalculiX, across", "true [gf]", "measured [gf]", "length off", "strain"],
        [
            (
                f"{2e3 * contacts[0, 3]:.0f} mm",
                ", ".join(f"{value:.0f}" for value in true),
                ", ".join(f"{value:.1f}" for value in measured),
                f"{100 * (np.linalg.norm(measured) / np.linalg.norm(true) - 1):+.1f} %",
                f"{one:.2f}",
            )
            for measured, true, contacts, one in zip(mean, large.forces() / GF, large.contacts, strain)
        ],
    )
