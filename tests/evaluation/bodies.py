"""Gels of another shape: the shipped fingertip from its description to newtons, against CalculiX (fingertip.py)."""

import hashlib
import subprocess
import time
import tomllib

import numpy as np

import chain
import fingertip
from chain import BUILD, GF
from report import SOURCE, rms

DESCRIPTION = SOURCE / "gel" / "fingertip.toml"
LOADS_GF = (5, 400)
FRICTION = 1.0  # directions within 45 degrees of the normal
PAIR_GF, NEAR_MM, NEAR_SHARE = 100, 1, 0.1  # as for the block's two contacts
KNOWN = """youngs_modulus_relative = 0
focal_relative = 0
position_mm = [0, 0, 0]
rotation_rad = [0, 0, 0]
"""


class Truth:
    """What CalculiX says of patches on the fingertip; directions are from the ball's middle."""

    def __init__(self):
        with np.load(fingertip.KEPT) as file:
            self.directions, self.radii, self.unit = file["directions"], file["radii"], fingertip.unpacked(file, "moved")
            self.by_bone = fingertip.unpacked(file, "by_bone")  # of the random patches alone
        self.places = 1e-3 * fingertip.RADIUS * (self.directions + [0, 0, 1])


def made(description, folder, anew=True):
    """Runs traction-gel. Returns the gel file and the seconds that it took; None if it is not made anew."""
    folder.mkdir(parents=True, exist_ok=True)
    gel = folder / f"{description.stem}_gel.toml"
    if gel.exists() and not anew:
        return gel, None
    begin = time.monotonic()
    command = [BUILD / "bin/traction-gel", "mesh", description, "--output", folder / description.stem]
    subprocess.run(list(map(str, command)), check=True, capture_output=True)
    return gel, time.monotonic() - begin


def text_of(gel, uncertainty=""):
    """The gel file with its influence file's path; `uncertainty` in place of the camera's and the modulus's."""
    text = gel.read_text().replace('influence_file = "', f'influence_file = "{gel.parent}/')
    return text.replace("[uncertainty]\n", f"[uncertainty]\n{uncertainty}")


class Fingertip:
    """The gel as traction-gel makes it, and runs of the chain on it."""

    def __init__(self, anew):
        sources = [DESCRIPTION, *sorted((SOURCE / "gel" / "traction_gel").glob("*.py"))]
        name = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:12]
        self.gel, self.seconds = made(DESCRIPTION, BUILD / "evaluation-state" / f"fingertip-{name}", anew)
        with np.load(self.gel.parent / "fingertip.npz") as file:
            self.nodes, self.markers = file["node_positions"], file["marker_positions"]

    def run(self, moved, uncertainty="", frames=1, **options):
        """`moved`: loads x markers x 3 [m]. Found, a row a frame."""
        return chain.run(np.repeat(moved, frames, axis=0), gel=text_of(self.gel, uncertainty), **options)


def strongest(found):
    """Place [m] and force [N] of each frame's strongest contact; NaN where there is none."""
    listed = [contacts[0] if len(contacts) else np.full(12, np.nan) for contacts in found.contacts_found]
    places = np.array([on_surface(one[:2]) for one in listed])
    return places, np.array([one[4:7] for one in listed])


def on_surface(place):
    """x, y, z of a place that is given by x, y [m]."""
    radius = 1e-3 * fingertip.RADIUS
    return np.array([*place, radius - np.sqrt(np.maximum(radius**2 - place @ place, 0))])


def angle(one, two):
    """Degrees between vectors."""
    cosine = (one * two).sum(-1) / np.linalg.norm(one, axis=-1) / np.linalg.norm(two, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def directions(normals, generator):
    """A unit vector within the friction cone of each normal."""
    tilt, turn = np.arctan(FRICTION) * np.sqrt(generator.random(len(normals))), 2 * np.pi * generator.random(len(normals))
    one = np.cross(normals, [1.0, 0, 0])
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    across = np.cos(turn)[:, None] * one + np.sin(turn)[:, None] * np.cross(normals, one)
    return np.cos(tilt)[:, None] * normals + np.sin(tilt)[:, None] * across


def random_loads(tip, truth, count, generator, hidden, frames=4):
    """Errors and what is stated of `count` loads: force [N], moment, place, polar angle. `hidden`: deviations of the
    bone's place [mm] and of Young's modulus."""
    bone_mm, modulus = hidden
    which = np.arange(count) % fingertip.RANDOM
    force = np.exp(generator.uniform(*np.log(LOADS_GF), count)) * GF
    true = force[:, None] * directions(-truth.directions[which], generator)
    bone = bone_mm * generator.standard_normal((count, 3))
    unit = truth.unit[which] + np.einsum("lb,lbamc->lamc", bone, truth.by_bone[which])
    moved = np.einsum("la,lamc->lmc", true, unit) / (1 + modulus * generator.standard_normal(count))[:, None, None]
    uncertainty = KNOWN.replace("relative = 0", f"relative = {modulus}", 1)
    found = tip.run(moved, uncertainty, frames, zero_every=frames * 10, seed=int(generator.integers(2**20)))
    true, which = np.repeat(true, frames, axis=0), np.repeat(which, frames)
    places, forces = strongest(found)
    wrench = np.hstack([true, np.cross(truth.places[which], true)])
    return chain.Found(
        true=true,
        size=np.linalg.norm(true, axis=1),
        error=found.wrench - wrench,
        stated=found.deviation,
        read=found.resultant_N,
        off=np.linalg.norm(places - truth.places[which], axis=1),
        turned=angle(found.resultant_N, true),
        polar=np.degrees(np.arccos(-truth.directions[which, 2])),
        listed=found.contact_count[:, 0],
        valid=found["valid"][:, 0],
    )


def mechanics(report, tip, truth):
    """Displacements under forces on nodes' areas against CalculiX's."""
    with np.load(tip.gel.parent / "fingertip.npz") as file:
        influence = file["influence"]
    own = influence[:, :, fingertip.sampled_nodes()].transpose(2, 3, 0, 1)
    true = truth.unit[-len(own) :]
    off = np.linalg.norm(own - true, axis=3).max(2) / np.linalg.norm(true, axis=3).max(2)
    report.row(
        f"mechanics of the fingertip against CalculiX, {len(own)} nodes: largest error, of the peak",
        f"{100 * off.max():.2f} %",
    )
    report.row("    markers beside the sphere that they belong on, largest", f"{1e6 * beside(tip):.1f} µm")
    report.row("    a mesh of CalculiX twice as coarse differs by, contacts, at most", f"{100 * fingertip.mesh_difference():.2f} %")


def beside(tip):
    middle = 1e-3 * np.array([0, 0, fingertip.RADIUS])
    return np.linalg.norm(tip.markers - middle - 1e-3 * fingertip.MARKERS * fingertip.marker_directions(), axis=1).max()


def random_contacts(report, tip, truth, count, generator):
    found = random_loads(tip, truth, count, generator, (0, 0))
    error = np.linalg.norm(found.error[:, :3], axis=1)
    allowed = 0.015 + 0.015 * found.size
    lines = []
    for low, high in ((0, 20), (20, 40), (40, 60)):
        for least, most in ((5, 30), (30, 100), (100, 400)):
            some = (found.polar >= low) & (found.polar < high) & (found.size >= least * GF) & (found.size < most * GF)
            if some.any():
                lines.append(
                    (
                        f"{low} - {high}°, {least} - {most} gf",
                        f"{rms(error[some]):.3f} N",
                        f"{100 * rms(error[some] / found.size[some]):.1f} %",
                        f"{1e3 * np.nanmedian(found.off[some]):.2f} mm",
                        f"{np.median(found.turned[some]):.1f}°",
                        f"{100 * (found.listed[some] == 1).mean():.0f} %",
                    )
                )
    report.table(["from the pole, load", "force", "of the load", "place, median", "angle, median", "one listed"], lines)
    good = np.isfinite(found.off)
    strong = found.size >= 100 * GF
    off, place_mm, turned = rms(error / allowed), 1e3 * rms(found.off[good]), rms(found.turned[strong])
    report.row("force error over 0.015 N + 1.5 %, root mean square", f"{off:.2f} x", "<= 1 x", off)
    report.row("place error, root mean square, of those listed", f"{place_mm:.2f} mm", "<= 0.2 mm", place_mm)
    report.row("angle error from 100 gf on, root mean square", f"{turned:.2f}°", "<= 1°", turned)
    listed = ", ".join(f"{100 * some.mean():.1f} %" for some in (found.listed == 0, found.listed == 1, found.listed > 1))
    report.row("    frames not valid; contacts listed: none, one, more", f"{100 * (1 - found.valid.mean()):.1f} %; {listed}")


def coverage(report, tip, truth, count, generator):
    found = random_loads(tip, truth, count, generator, (fingertip.BONE_MM, 0.02))
    inside = abs(found.error) <= 1.96 * found.stated
    for part, name in ((slice(0, 3), "force"), (slice(3, 6), "moment")):
        share = inside[:, part].mean()
        each = ", ".join(f"{100 * axis:.0f}" for axis in inside[:, part].mean(0))
        report.row(
            f"truth inside the stated 95 % interval, E and the bone's position hidden: {name}",
            f"{100 * share:.1f} % ({each})",
            "93 – 97 %",
            share,
        )


def two_contacts(report, tip, truth, generator, trials):
    lines, smallest = [], np.inf
    first = fingertip.RANDOM
    for distance in sorted(fingertip.PAIRS_MM, reverse=True):
        at = first + 2 * fingertip.PAIRS_EACH * fingertip.PAIRS_MM.index(distance) + np.arange(2 * fingertip.PAIRS_EACH)
        pairs = at.reshape(-1, 2)
        forces = -PAIR_GF * GF * truth.directions[pairs]
        moved = np.einsum("pka,pkamc->pmc", forces, truth.unit[pairs])
        found = tip.run(moved, KNOWN, trials, zero_every=trials, seed=int(generator.integers(2**20)))
        good = []
        for frame, listed in enumerate(found.contacts_found):
            true = truth.places[pairs[frame // trials]]
            near = False
            if len(listed) == 2:
                seen = np.array([on_surface(one[:2]) for one in listed])
                for order in ([0, 1], [1, 0]):
                    force = np.linalg.norm(listed[order, 4:7], axis=1)
                    near |= (np.linalg.norm(seen[order] - true, axis=1) < 1e-3 * NEAR_MM).all() and (
                        abs(force / (PAIR_GF * GF) - 1) < NEAR_SHARE
                    ).all()
            good.append(near)
        two = (found.contact_count[:, 0] == 2).mean()
        lines.append((f"{distance:g}", f"{100 * np.mean(good):.0f} %", f"{100 * two:.0f} %"))
        smallest = distance if np.mean(good) >= 0.95 and smallest >= distance else smallest
        if np.mean(good) < 0.95:
            break
    report.table(["distance [mm]", "told apart", "two listed"], lines)
    report.row("two contacts of 100 gf told apart from", f"{smallest:g} mm", "<= 5 mm", smallest)


def smallest_press(report, tip, truth, generator, frames):
    idle = tip.run(np.zeros((1, len(tip.markers), 3)), "", 10 * frames, seed=int(generator.integers(2**20)))
    alarms = (idle.contact_count[:, 0] > 0).mean()
    some = slice(0, fingertip.RANDOM)
    unit = np.einsum("la,lamc->lmc", -truth.directions[some], truth.unit[some])
    least = np.inf
    for force in (0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 2.5, 3, 4, 5, 7, 10, 15, 20):
        found = tip.run(force * GF * unit, "", seed=int(generator.integers(2**20)), zero_every=40)
        if (found.contact_count[:, 0] > 0).mean() >= 0.95:
            least = force
            break
    report.row("smallest press found in 95 % of places", f"{least:g} gf", "<= 3 gf", least)
    report.row("    frames without a load that list a contact", f"{100 * alarms:.1f} %")


BLOCK = """format = 1
[gel]
width_mm = 60
height_mm = 60
thickness_mm = 20
[[layers]]
colour = "blue"
columns = {0}
rows = {0}
pitch_mm = {1}
depth_mm = 4
diameter_mm = {4}
[nodes]
columns = {2}
rows = {2}
pitch_mm = {3}
[camera]
focal_px = 1000
position_mm = [0, 0, 70]
"""


def timing(report, tip, truth, generator):
    """Track and solve of one frame, as the daemon does, in a press of 100 gf; a block of as many markers, as large in the
    picture, and as many nodes. Caches are empty: drawing a body's markers leaves less in them than drawing a block's."""
    count, nodes = (round(np.sqrt(len(each))) for each in (tip.markers, tip.nodes))
    description = tomllib.loads(DESCRIPTION.read_text())
    away_mm = description["camera"]["position_mm"][2] - 1e3 * np.median(tip.markers[:, 2])
    block = BLOCK.format(count, 1.5, nodes, 1.5, 66 * description["layers"][0]["diameter_mm"] / away_mm)
    rows = [[0, 0, 0, 0, 0, 1.0]]
    press = chain.mechanics(block, rows, count**2)
    own = np.einsum("a,amc->mc", -truth.directions[0], truth.unit[0])[None]
    times = {}
    for name, gel, unit in (("block", block, press), ("body", text_of(tip.gel), own)):
        moved = 100 * GF * np.repeat(unit, 200, axis=0) * (1 + 0.02 * np.sin(np.arange(200)))[:, None, None]
        found = chain.run(moved, gel=gel, as_daemon=True, cold=True, seed=int(generator.integers(2**20)))
        times[name] = [np.median(part[20:]) for part in (found.track_ms + found.solve_ms, found.track_ms, found.solve_ms)]
    whole, track, solve = zip(*(times[name] for name in ("body", "block")))
    ratio = whole[0] / whole[1]
    report.row("frame time of a body beside a block's", f"{whole[0]:.2f} ms, {whole[1]:.2f} ms: {ratio:.2f} x", "<= 1.2 x", ratio)
    report.row("    of these tracked; solved", "; ".join(f"{one:.2f} ms, {two:.2f} ms" for one, two in (track, solve)))


def block(report):
    """A block by traction-gel, against the daemon's own mechanics."""
    grid = {"columns": 8, "rows": 8, "pitch_mm": 3}
    layers = [("blue", 6, [0, 0]), ("red", 8, [1.5, 1.5])]
    common = "".join(f"{key} = {value}\n" for key, value in grid.items())
    markers = "".join(
        f'[[layers]]\ncolour = "{colour}"\n{common}depth_mm = {depth}\ndiameter_mm = 0.6\ncentre_mm = {centre}\n'
        for colour, depth, centre in layers
    )
    size = "width_mm = 60\nheight_mm = 60\nthickness_mm = 20\n"
    folder = BUILD / "evaluation-state" / "block"
    folder.mkdir(parents=True, exist_ok=True)
    description = folder / "block.toml"
    description.write_text(
        f'format = 1\nerror_percent = 0.5\n[shape]\nkind = "block"\n{size}[material]\nyoungs_modulus_pa = 180000\n'
        f"poisson_ratio = 0.49\n{markers}[nodes]\n{common}[camera]\nposition_mm = [0, 0, 157]\n"
    )
    gel, seconds = made(description, folder)
    with np.load(gel.parent / "block.npz") as file:
        own, nodes = file["influence"], file["node_positions"]
    own = own.reshape(len(own), 3, -1).transpose(2, 0, 1)
    part = 3e-3 * ((np.arange(4) + 0.5) / 4 - 0.5)
    rows = [
        [3 * node + axis, x + a, y + b, *np.eye(3)[axis] / 16]
        for node, (x, y, _) in enumerate(nodes)
        for axis in range(3)
        for a in part
        for b in part
    ]
    true = chain.mechanics(f"format = 1\n[gel]\n{size}{markers}[nodes]\n{common}", rows, own.shape[1])
    off = (np.linalg.norm(own - true, axis=2).max(1) / np.linalg.norm(true, axis=2).max(1)).max()
    report.row(
        f"a block through traction-gel ({seconds:.0f} s), of the daemon's own: largest error, of the peak",
        f"{100 * off:.2f} %",
        "<= 0.5 %",
        off,
    )


def bodies(report, quick):
    report.section(
        "A fingertip",
        f"""
        The shipped fingertip (`gel/fingertip.toml`) through `traction-gel`. The truth is CalculiX's, on bricks that share
        nothing with its mesh: ball contacts' pressures of radius 1 to 3 mm, {LOADS_GF[0]} to {LOADS_GF[1]} gf, anywhere
        up to {fingertip.MOST_POLAR:g}° from the pole, in any direction within 45° of the normal, linear; gel file exact
        but for what is called hidden: Young's modulus by 2 %, the bone by {fingertip.BONE_MM} mm along each axis.
        Markers are discs in the surface of their layer, as the camera sees them. Errors are lengths of vectors, of
        single frames; their times are with empty caches.""",
    )
    generator, truth = np.random.default_rng(report.seed), Truth()
    tip = Fingertip(anew=not quick)
    if tip.seconds:
        report.row("from the description to the files", f"{tip.seconds:.0f} s", "<= 10 min", tip.seconds / 60)
    mechanics(report, tip, truth)
    random_contacts(report, tip, truth, 80 if quick else 400, generator)
    coverage(report, tip, truth, 80 if quick else 400, generator)
    two_contacts(report, tip, truth, generator, 2 if quick else 10)
    smallest_press(report, tip, truth, generator, 10 if quick else 100)
    timing(report, tip, truth, generator)
    if not quick:
        block(report)
