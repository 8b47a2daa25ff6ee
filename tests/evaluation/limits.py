"""The smallest and the closest that is told, what a ramp jumps by, what a highlight invents, gels as they are made,
other gels: at random places, by CalculiX's influence. Part of the section of unseen.py."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

import chain
import influence
import loads
import shapes
from chain import GF
from report import rms

NODES = loads.nodes()
BACKGROUND = 20  # of the default picture [levels]
NO_CONTACT = 1  # the method of a frame whose forces are all zero
TARGETS = {40: 3.5, 25: None, 15: 4.5}  # smallest press found [gf]


def limits(report, quick, thicknesses):
    generator = np.random.default_rng([report.seed, 1])
    for measure in (smallest_press, closest_pair, ramps, scattered, highlighted):
        for thickness in thicknesses:
            measure(report, quick, thickness, generator)
    if not quick:
        other_gels(report, generator)


def presses(count, generator, radius=2.5):
    """Balls' pressures of 1 N anywhere within the nodes."""
    places = generator.uniform(-shapes.OUTERMOST + 1e-3 * radius, shapes.OUTERMOST - 1e-3 * radius, (count, 2))
    return [loads.patch("hertz", place, 1e-3 * radius, [0, 0, 1]) for place in places]


def found_from(found_share, forces):
    """The smallest force from which on 95 % are found: found_share(force) is asked upwards until all are found."""
    smallest, lines = np.inf, []
    for force in forces:
        share = found_share(force)
        lines.append((force, share))
        smallest = min(smallest, force) if share >= 0.95 else np.inf
        if share >= 0.995:
            break
    return smallest, lines


FORCES = (1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 10, 13, 17, 22, 30)


def touched(found):
    """Frames that show a force or a contact."""
    return (found["method"][:, 0] != NO_CONTACT) | (found["contact_count"][:, 0] > 0)


def smallest_press(report, quick, thickness, generator):
    gel, frames = chain.gel_text(thickness), 200 if quick else 3000
    unit = np.array([shapes.displacements(thickness, *one) for one in presses(20 if quick else 300, generator)])
    idle = chain.run(np.zeros((frames, 1152, 3)), gel=gel, zero_every=100, seed=generator.integers(2**20))
    alarms = touched(idle)
    size = np.linalg.norm(idle.resultant_N[alarms], axis=1) / GF
    report.row(
        f"{thickness} mm, nothing touches: frames that show a force",
        f"{alarms.sum()} of {frames}, at most {max(size, default=0):.1f} gf",
        "<= 1 %",
        alarms.mean(),
    )

    def share(force):
        found = chain.run(force * GF * unit, gel=gel, zero_every=40, seed=generator.integers(2**20))
        return (found["contact_count"] > 0).mean()

    smallest, lines = found_from(share, FORCES)
    target = TARGETS[thickness]
    report.row(
        f"{thickness} mm, smallest press of 5 mm found in 95 % ({len(unit)} places)",
        f"{smallest} gf",
        f"<= {target} gf" if target else "",
        smallest,
    )
    report.row("    found", ", ".join(f"{force:g}: {100 * part:.0f}" for force, part in lines if part < 0.995) + " %")


def closest_pair(report, quick, thickness, generator):
    """Presses of 100 gf, 3 mm across, told apart when there are two contacts, each
    within 1 mm and 10 %."""
    gel, count = chain.gel_text(thickness), 6 if quick else 60
    shares = {}
    for distance in (5, 6, 7) if quick else (4, 5, 5.5, 6, 6.5, 7, 8, 10):
        unit, places = [], []
        for _ in range(count):
            centre, turn = generator.uniform(-27e-3, 27e-3, 2), generator.uniform(0, 2 * np.pi)
            half = 0.5e-3 * distance * np.array([np.cos(turn), np.sin(turn)])
            pair = [loads.patch("hertz", centre + side * half, 1.5e-3, [0, 0, 1]) for side in (-1, 1)]
            unit.append(shapes.displacements(thickness, *(np.hstack(both) for both in zip(*pair))))
            places.append([centre - half, centre + half])
        found = chain.run(
            100 * GF * np.repeat(unit, 2, axis=0), gel=gel, zero_every=40, seed=generator.integers(2**20)
        )
        shares[distance] = np.mean(
            [told_apart(seen, at) for seen, at in zip(found.contacts_found, np.repeat(places, 2, axis=0))]
        )
    smallest = min([d for d in shares if all(shares[e] >= 0.95 for e in shares if e >= d)], default=np.inf)
    single = []
    for _ in range(20 if quick else 400):
        shape = generator.choice(["ball", "disc"])
        load = shapes.single(shape, generator, force=100 * GF, mixture="friction")
        while shape == "disc" and load.points.shape[1] * 0.25 > 80:  # at most 10 mm across
            load = shapes.single(shape, generator, force=100 * GF, mixture="friction")
        single.append(shapes.displacements(thickness, load.points, load.forces))
    alone = chain.run(np.repeat(single, 2, axis=0), gel=gel, zero_every=40, seed=generator.integers(2**20))
    split = (alone["contact_count"] > 1).mean()
    report.row(
        f"{thickness} mm, two contacts of 100 gf told apart from; false splits of a ball or a disc",
        f"{smallest:g} mm; {100 * split:.2f} %",
        "<= 6 mm; 0.5 %",
        max(smallest / 6, split / 0.005),
        within=(0, 1),
    )
    report.row("    told apart", ", ".join(f"{d:g} mm: {100 * share:.0f}" for d, share in shares.items()) + " %")


def told_apart(seen, places):
    if len(seen) != 2:
        return False
    order = [0, 1] if np.linalg.norm(seen[0, :2] - places[0]) < np.linalg.norm(seen[1, :2] - places[0]) else [1, 0]
    near = np.linalg.norm(seen[order, :2] - places, axis=1) < 1e-3
    return near.all() and (abs(seen[:, 6] - 100 * GF) < 10 * GF).all()


def ramps(report, quick, thickness, generator):
    """What the resultant does in a step of 1 gf beside moving by 1 gf, with the same noise in every frame."""
    steps, jumps = np.arange(101), []
    for number in range(4 if quick else 40):
        family = shapes.INSIDE[number % len(shapes.INSIDE)]
        load = shapes.draw(family, generator)
        load = load.scaled(GF / load.size)
        moved = steps[:, None, None] * shapes.displacements(thickness, load.points, load.forces)
        found = chain.run(
            moved,
            gel=chain.gel_text(thickness),
            given=shapes.MARKER_NOISE_PX,
            same_noise=True,
            seed=generator.integers(2**20),
        )
        jump = np.linalg.norm(np.diff(found.resultant_N - np.outer(steps, load.resultant[:3]), axis=0), axis=1) / GF
        jumps.append((jump.max(), steps[jump.argmax() + 1], family, load.text))
    largest = max(jumps)
    report.row(
        f"{thickness} mm, largest jump in ramps of 1 gf steps to 100 gf, {len(jumps)} random shapes, no pictures",
        f"{largest[0]:.1f} gf, median {np.median([one[0] for one in jumps]):.1f}",
        "<= 1 gf",
        largest[0],
    )
    report.row("    in the step to; of", f"{largest[1]} gf; {largest[3].partition(', at')[0]}")


def scattered(report, quick, thickness, generator):
    """Markers beside the grid, as made by hand: presses of 400 gf, against the same in a perfect gel."""
    gels, places, frames = (1, 4, 5) if quick else (5, 12, 20)
    bias, deviation, perfect, valid = [], [], [], []
    kept = influence.of(thickness)
    for _ in range(gels):
        scatter = generator.standard_normal((3, 1152)) * [[0.3e-3], [0.3e-3], [0.1e-3]]
        some = presses(places, generator)
        for by in (scatter, None):
            unit = np.array([kept.displacement(*one, scatter=by) for one in some])
            found = chain.run(
                400 * GF * np.repeat(unit, frames, axis=0),
                gel=chain.gel_text(thickness),
                scatter=None if by is None else by.T,
                zero_every=frames,
                seed=generator.integers(2**20),
            )
            total = found.resultant_N.reshape(places, frames, 3) / GF
            (perfect if by is None else deviation).append(np.linalg.norm(total.std(1), axis=1))
            if by is not None:
                bias.append(np.linalg.norm(total.mean(1) - [0, 0, 400], axis=1))
                valid.append(found["valid"])
    ratio, off = rms(deviation) / rms(perfect), rms(bias) / 400
    report.row(
        f"{thickness} mm, markers scattered by 0.3, 0.3, 0.1 mm, 400 gf: bias; deviation against a perfect grid's",
        f"{100 * off:.1f} % (worst {np.max(bias):.1f} gf); {ratio:.2f} x of {rms(perfect):.2f} gf",
        "<= 1 %; 1.3 x",
        max(off / 0.01, ratio / 1.3),
        within=(0, 1),
    )
    report.row("    frames not valid", f"{100 * (1 - np.mean(valid)):.1f} %")


def highlighted(report, quick, thickness, generator):
    """Nothing touches, but there is a highlight, white where 5 % of the markers are, grey around: anywhere, at half of
    the places when the zero is taken as well."""
    places, frames = (2, 5) if quick else (30, 20)
    markers = loads.markers()
    focal, height = shapes.CAMERA
    seen = focal * markers[:2] * [[1], [-1]] / (height - markers[2]) + [[319.5], [239.5]]
    whole = []
    for lit_at_zero in (False, True):
        highlights = []
        for _ in range(places):
            centre, strength = seen[:, generator.integers(seen.shape[1])], generator.uniform(300, 1000)
            white = np.sort(np.hypot(*(seen - centre[:, None])))[seen.shape[1] // 20]
            radius = white / np.sqrt(2 * np.log(strength / (255 - BACKGROUND)))
            highlights.append([*centre, radius, strength])
        whole.append(
            chain.run(
                np.zeros((places * frames, 1152, 3)),
                gel=chain.gel_text(thickness),
                highlight=np.repeat(highlights, frames, axis=0),
                zero_every=frames,
                seed=generator.integers(2**20),
                lit_at_zero=lit_at_zero or None,
            )
        )
    invented = np.concatenate([touched(found) for found in whole])
    size = np.linalg.norm(np.concatenate([found.resultant_N for found in whole]), axis=1)[invented] / GF
    report.row(
        f"{thickness} mm, nothing touches, a highlight saturates 5 % of the markers: frames that show a force",
        f"{invented.sum()} of {len(invented)}"
        + (f", median {np.median(size):.1f}, at most {size.max():.1f} gf" if len(size) else ""),
        "<= 1 %",
        invented.mean(),
    )


class Gel:
    """Another gel; its truth is the project's own mechanics, which the section on mechanics holds against CalculiX."""

    def __init__(self, label, young=0.18e6, poisson=0.49, pitch=3.0, depth=6.0):
        self.label, self.young, self.pitch = label, young, pitch
        self.scale = pitch / 3
        side = max(100, 100 * self.scale)
        text = chain.gel_text(40, poisson, young, red_depth=depth + 2 * (depth / 6), focal=960 / self.scale)
        text = text.replace("thickness_mm", f"width_mm = {side}\nheight_mm = {side}\nthickness_mm")
        text = text.replace("depth_mm = 6", f"depth_mm = {depth}").replace("[1.5, 1.5]", f"[{pitch / 2}, {pitch / 2}]")
        layer = f"pitch_mm = {pitch}\ndiameter_mm = {0.6 * self.scale}\n"
        for colour in ("blue", "red"):
            text = text.replace(f'colour = "{colour}"\n', f'colour = "{colour}"\n{layer}')
        self.text = text + f"\n[nodes]\npitch_mm = {pitch}\n"

    def displacement(self, points_and_forces):
        rows = []
        for number, (points, forces) in enumerate(points_and_forces):
            rows.append(np.column_stack([np.full(points.shape[1], number), self.scale * points.T, forces.T]))
        return chain.mechanics(self.text, np.concatenate(rows))

    def limit(self, seed):
        """Smallest press found [gf], on a fine scale: between the forces at which less and more than 95 % are found."""
        generator = np.random.default_rng(seed)
        unit = self.displacement(presses(150, generator))
        begin = 0.5 * self.young / 0.18e6

        def share(force):
            found = chain.run(
                force * GF * unit, gel=self.text, given=shapes.MARKER_NOISE_PX, seed=generator.integers(2**20)
            )
            return (found["contact_count"] > 0).mean()

        return found_from(share, begin * 1.15 ** np.arange(40))[0]


def other_gels(report, generator):
    """Random loads in units of the gel's own detection limit: the same shapes (as wide in pitches), the same forces in
    that unit, the error in that unit too."""
    gels = [
        Gel("the paper's"),
        Gel("E 0.02 MPa", young=0.02e6),
        Gel("E 2 MPa", young=2e6),
        Gel("pitch 1.5 mm", pitch=1.5),
        Gel("pitch 5 mm", pitch=5.0),
        Gel("depth 3 mm", depth=3.0),
        Gel("depth 10 mm", depth=10.0),
        Gel("Poisson's ratio 0.45", poisson=0.45),
        Gel("Poisson's ratio 0.4999", poisson=0.4999),
    ]
    drawn = [shapes.draw(family, generator) for family in 10 * shapes.INSIDE]
    amount = np.exp(generator.uniform(0, np.log(100), len(drawn)))  # in detection limits
    seed = int(generator.integers(2**20))

    def measure(gel):
        unit = gel.limit(seed)
        if np.isinf(unit):
            return unit, np.full(len(drawn), np.inf)
        units = [load.forces / load.size for load in drawn]
        moved = gel.displacement([(load.points, forces) for load, forces in zip(drawn, units)])
        moved *= (amount * unit * GF)[:, None, None]
        found = chain.run(np.repeat(moved, 4, axis=0), gel=gel.text, given=shapes.MARKER_NOISE_PX, seed=seed)
        true = np.array([forces.sum(1) for forces in units]) * amount[:, None]
        error = found.resultant_N.reshape(-1, 4, 3) / (unit * GF) - true[:, None]
        return unit, rms(np.linalg.norm(error, axis=2), 1) / np.maximum(1 / 3, 0.015 * amount)

    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(measure, gels))
    straight = [np.median(results[0][1]), np.quantile(results[0][1], 0.95)]
    lines, off = [], 0.0
    for gel, (unit, ratio) in zip(gels, results):
        if np.isinf(unit):
            lines.append((gel.label, "none", "–", "–"))
            off = np.inf
            continue
        figures = [np.median(ratio), np.quantile(ratio, 0.95)]
        off = max(off, *(figure / by for figure, by in zip(figures, straight)))
        lines.append((gel.label, f"{unit:.2g} gf", *[f"{figure:.2f}" for figure in figures]))
    report.table(["gel", "detection limit D", "error / max(D/3, 1.5 %): median", "95th percentile"], lines)
    report.row("other gels (own mechanics, no pictures): worst of these over the paper's", f"{off:.2f}", "<= 1.2", off)
