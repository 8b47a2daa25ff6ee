"""Sums over the whole face: how far they are off, and what disturbs them. Called like the paper's experiments."""

from concurrent.futures import ThreadPoolExecutor

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
    for depth, pixel_format in ((8, "Mono8"), (8, "Mono12p"), (6, "Mono8")):
        blue = depth == 6
        found = chain.run(
            both[:, :576] if blue else both[:, 576:],
            gel=chain.one_layer_text(depth=depth, centre_mm=0 if blue else 1.5),
            zero_every=1,
            format=pixel_format,
            background=150,
        )
        off = np.linalg.norm(found.resultant_N, axis=1) / np.linalg.norm(forces, axis=1) - 1
        judged = (depth, pixel_format) == (8, "Mono8")
        report.row(
            f"400 gf, one layer of black dots at {depth} mm, {pixel_format}: magnitude",
            f"{100 * rms(off):.2f} % off, mean {100 * off.mean():+.2f} %",
            "–",
            "<= 2 %" if judged else "",
            *(0.02, rms(off)) if judged else (),
            name="monochrome",
        )


def mechanics(report, quick):
    report.section(
        "The block's mechanics against CalculiX",
        """
        Largest distance between the markers' displacements of the two programs in parts of the largest displacement
        under the same load. CalculiX's own error is estimated by a mesh twice as coarse, at the markers that are
        nodes of both: the difference, of which the finer mesh has a quarter or less.""",
    )
    worst_of_all = 0.0
    for poisson in (0.49, 0.4999) if quick else (0.3, 0.45, 0.49, 0.4999):
        try:
            places = truth.load(40, poisson, "places" if poisson == 0.49 else "centre")
        except FileNotFoundError:
            continue
        ours = chain.mechanics(chain.gel_text(poisson=poisson), force_rows(places))
        off = np.linalg.norm(ours - places.displacement, axis=2).max(1)
        worst = (off / np.linalg.norm(places.displacement, axis=2).max(1)).max()
        worst_of_all = max(worst, worst_of_all)
        report.row(
            f"block of 40 mm, Poisson's ratio {poisson}, {len(off)} loads",
            f"{100 * worst:.2f} % of the peak (meshes {100 * mesh_difference(40, poisson):.2f} %)",
        )
    report.row(
        "marker displacement of the block against CalculiX, largest",
        f"{100 * worst_of_all:.2f} % of the peak",
        "–",
        "<= 0.7 %",
        0.007,
        worst_of_all,
        name="mechanics",
    )
    for thickness in () if quick else (15, 25):
        try:
            places = truth.load(thickness, 0.49, "places")
        except FileNotFoundError:
            continue
        ours = chain.mechanics(chain.gel_text(thickness), force_rows(places))
        off = np.linalg.norm(ours - places.displacement, axis=2).max(1)
        worst = (off / np.linalg.norm(places.displacement, axis=2).max(1)).max()
        report.row(
            f"block of {thickness} mm, Poisson's ratio 0.49",
            f"{100 * worst:.2f} % of the peak " f"(meshes {100 * mesh_difference(thickness, 0.49):.2f} %)",
        )


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
        try:
            sets = [truth.load(thickness, 0.49, "places")]
        except FileNotFoundError:
            continue
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
            "unknown",
            "max(1 gf, 1.5 %)",
            1,
            worst,
            name=f"bias {thickness} mm",
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


def models(report, quick):
    report.section(
        "Resultant by model",
        """
        200 gf as Hertz pressures of 5 mm diameter at eight places along x, y and z; single frames. Error: length of
        the difference of the resultants, root mean square over the places.""",
    )
    lines = []
    for thickness in (15, 40) if quick else (15, 25, 40):
        try:
            places = truth.load(thickness, 0.49, "places")
        except FileNotFoundError:
            continue
        forces = 200 * places.forces()
        for model, solve in (("half-space", 'model = "half-space"'), ("block", "")):
            found = chain.run(200 * GF * places.displacement, gel=chain.gel_text(thickness), solve=solve)
            error = np.linalg.norm(found.resultant_N / GF - forces, axis=1).reshape(-1, 3)
            lines.append(
                (
                    f"{thickness} mm, {model}",
                    f"{rms(error[:, 2]) / 2:.1f} %",
                    f"{error[:, 2].max() / 2:.1f} %",
                    f"{rms(error[:, :2]) / 2:.1f} %",
                    f"{error[:, :2].max() / 2:.1f} %",
                )
            )
    report.table(["gel, model", "press", "worst", "shear", "worst"], lines)


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
    report.row(
        "10 % of the markers missing: growth of the resultant's deviation",
        f"{100 * growth:+.0f} %",
        "–",
        "<= 15 %",
        0.15,
        growth,
        name="missing markers",
    )


def picture_motion(report, quick):
    report.section(
        "Motion of the picture and heat", "The probe with 200 gf; mean of 20 frames each, less the same without motion."
    )
    frames = 20
    displacement = np.repeat(probe(np.array([[0, 0, 200 * GF]])), frames, axis=0)
    cases = {
        "still": (0, 0, 0, 0, 1),
        "shift of 0.05 px": (0.05, 0, 0, 0, 1),
        "scale 1.0001": (0, 0, 1e-4, 0, 1),
        "roll of 0.1 mrad": (0, 0, 0, 1e-4, 1),
    }
    means = {}
    for label, stray in cases.items():
        found = chain.run(displacement, stray=np.tile(np.array(stray, float), (frames, 1)))
        means[label] = found.resultant_N.mean(0) / GF
    lines = [
        (label, *[f"{value:+.1f}" for value in mean - means["still"]])
        for label, mean in means.items()
        if label != "still"
    ]
    try:
        warm = truth.load(40, 0.49, "expansion").displacement
        found = chain.run(displacement + warm[0])
        lines.append(("1 K warmer", *[f"{value:+.1f}" for value in found.resultant_N.mean(0) / GF - means["still"]]))
    except FileNotFoundError:
        pass
    report.table(["what moves", "Fx [gf]", "Fy", "Fz"], lines)


def large_strain(report, quick):
    try:
        large = truth.load(40, 0.49, "large")
    except FileNotFoundError:
        return
    report.section(
        "Large strain",
        """
        The truth is a neo-Hookean gel with large deformations (CalculiX, NLGEOM), the solver is linear. Hertz
        pressures at the centre whose directions do not follow the surface; mean of 10 frames. With 5 mm across
        CalculiX finds no equilibrium much beyond 300 gf: the true contact of a probe grows. Flagged: share of the
        frames marked as out of range or unexplained. Largest node: force of the strongest node in any frame in parts of
        E pitch^2.""",
    )
    frames = 10
    found = chain.run(np.repeat(large.displacement, frames, axis=0), zero_every=frames)
    mean = found.resultant_N.reshape(-1, frames, 3).mean(1) / GF
    flagged = ((found["flags"].astype(int) & (OUT_OF_RANGE | UNEXPLAINED)) != 0).reshape(-1, frames).mean(1)
    nodes = np.linalg.norm(found.force_N.reshape(-1, frames, 576, 3), axis=3).max((1, 2)) / (chain.YOUNG * 9e-6)
    lines = []
    for measured, true, contacts, flag, node in zip(mean, large.forces() / GF, large.contacts, flagged, nodes):
        lines.append(
            (
                f"{2e3 * contacts[0, 3]:.0f} mm",
                ", ".join(f"{value:.0f}" for value in true),
                ", ".join(f"{value:.1f}" for value in measured),
                f"{100 * (np.linalg.norm(measured) / np.linalg.norm(true) - 1):+.1f} %",
                f"{100 * flag:.0f} %",
                f"{node:.2f}",
            )
        )
    report.table(["across", "true [gf]", "measured [gf]", "length off", "flagged", "largest node"], lines)
