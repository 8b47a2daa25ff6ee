"""Gels that somebody made: how many of their dots are found, and how well."""

import collections

import chain
import numpy as np

# Targets of the share that is valid under load, and of the rms error over the bound. The share has none where a dot that
# dust, a reflection or a neighbour covers cannot be found.
LEAST = dict.fromkeys(["plain", "light", "missing"], ">= 100%") | dict.fromkeys(["sizes", "contrasts", "ellipses"], ">= 98%")
MOST = {"dust": "<= 1.5"}


def markers(report, quick):
    report.section(
        "Dots of any make",
        """
        Pictures of one grey layer of 24 x 24 dots, each drawn from its family: diameters of 4 to 10 px, brighter or darker
        than the gel, contrasts of 40 to 100 levels, blur of 0.5 to 1.3 px, noise of 1 to 3. Each family adds one
        difficulty: diameters or contrasts that scatter by up to 20 %, discs that are elongated by up to 30 % in the
        corners, light that differs by up to 60 %, 20 to 300 specks of dust, three reflections, up to 10 % of the dots
        missing or touching a neighbour. The last one has all of them at 40 % of that. Under load the gel is pushed aside
        by up to 10 px. The bound is that of Cramer and Rao for the whole picture, dirt included. Of the shares the worst
        trial is printed, of the errors the largest.""",
    )
    families = collections.defaultdict(list)
    for line in chain.call("markers", "--seed", report.seed, "--trials", 3 if quick else 20).splitlines():
        name, *numbers = line.split("\t")
        families[name].append([float(number) for number in numbers])
    for name, trials in families.items():
        there, found, valid, wrong, error, ratio, _ = np.array(trials).T
        least, most = LEAST.get(name, ""), MOST.get(name, "<= 1.3")
        share = (valid / there).min()
        report.row(
            f"{name}: found at rest, valid under load; taken for another",
            f"{(found / there).min():.1%}, {share:.1%}; {wrong.sum():.0f} of {there.sum():.0f}",
            least,
            share,
        )
        report.row(
            "    error over its bound; squared over the variance",
            f"{error.max():.2f}; {ratio.max():.2f}",
            most,
            error.max(),
        )
