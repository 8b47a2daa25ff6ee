"""What is seen of single contacts. Called like the paper's experiments."""

import numpy as np

import chain
import loads
import shapes
import truth
from chain import GF
from report import rms
from unseen import ALL_KNOWN


def flat_disc(report, quick):
    report.section(
        "Pressure of a flat disc", "Even pressure on a disc of radius 10 mm, 400 gf, single frames, 10 trials."
    )
    disc = truth.load(40, 0.49, "disc")
    trials = 10
    found = chain.run(np.repeat(400 * GF * disc.displacement[::2], trials, axis=0), zero_every=1)
    pressure = found.force_N.reshape(2, trials, 576, 3)[..., 2] / 9e-6
    true = 400 * GF / (np.pi * 0.01**2)
    inside, outside = [], []
    for place, contacts in zip(pressure, disc.contacts[::2]):
        radius = np.linalg.norm(loads.nodes() - contacts[0, 1:3, None], axis=0)
        inside.append(place[:, radius < 7e-3] / true - 1)
        outside.append(place[:, radius > 13e-3] / true)
    off = rms(np.concatenate(inside, axis=1))
    report.row("pressure of a flat disc, more than 3 mm within its edge, RMS", f"{100 * off:.0f} %", "<= 15 %", off, must=True)
    report.row("    more than 3 mm outside", f"{100 * rms(np.concatenate(outside, axis=1)):.1f} % of it")

    def draw(axes):
        radius = 1e3 * np.linalg.norm(loads.nodes() - disc.contacts[0, 0, 1:3, None], axis=0)
        axes.plot(np.tile(radius, (trials, 1)).ravel(), 1e-3 * pressure[0].ravel(), ".", ms=2)
        axes.plot([0, 10, 10, 25], [1e-3 * true, 1e-3 * true, 0, 0], "k-", lw=0.8)
        axes.set(xlim=(0, 25), xlabel="distance from the disc's centre [mm]", ylabel="pressure [kPa]")

    report.picture("disc", draw, "Pressure of each node in ten frames; the line is the truth.")


def wrench(report, quick):
    report.section(
        "Wrench of a contact",
        """
        Balls and discs of 4 to 12 mm, pressed by 100 to 400 gf, sheared and half of them twisted, within the nodes.
        Of contacts that are found alone: torque about the stated point, and place, less what acts. The gel is what the gel
        file says but for what CalculiX does otherwise.""",
    )
    generator, frames, count = np.random.default_rng(report.seed), 2, 40 if quick else 300
    drawn = []
    while len(drawn) < count:
        load = shapes.single(generator.choice(["ball", "disc"]), generator, mixture="friction")
        if load.zone == "inside" and 2e-3 < np.ptp(load.points[0]) / 2 < 6e-3:
            drawn.append(load.scaled(GF * np.exp(generator.uniform(*np.log([100, 400]))) / load.forces[2].sum()))
    moved = np.array([shapes.displacements(40, load.points, load.forces) for load in drawn])
    gel = chain.gel_text() + ALL_KNOWN
    found = chain.run(np.repeat(moved, frames, axis=0), gel=gel, zero_every=20, seed=int(generator.integers(2**31)))
    table = found["contact_wrenches"].reshape(len(found.valid), -1, 75)
    errors, deviations, places = [], [], []
    for frame, listed in enumerate(found.contacts_found):
        if len(listed) != 1:
            continue
        true, (x, y) = drawn[frame // frames].resultant, listed[0, :2]
        places.append([x + true[4] / true[2], y - true[3] / true[2]])
        true[3:] -= np.cross([x, y, 0], true[:3])
        errors.append(np.hstack([listed[0, 4:7], table[frame, 0, :3]]) - true)
        deviations.append(np.sqrt(table[frame, 0, 3:39].reshape(6, 6)[5, 5]))
    torque, place = rms(np.array(errors)[:, 5]), rms(np.linalg.norm(places, axis=1))
    report.row("contacts found alone", f"{len(errors)} of {len(table)}")
    report.row("torque about the normal", f"{1e3 * torque:.3f} mN m", "<= 0.15 mN m", 1e3 * torque)
    report.row("    median deviation of its noise", f"{1e3 * np.median(deviations):.3f} mN m")
    report.row("place", f"{1e3 * place:.3f} mm", "<= 0.05 mm", 1e3 * place)
