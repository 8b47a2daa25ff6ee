"""Gels that somebody made: how many of their dots are found, and how well."""

import collections
import subprocess

import chain
import numpy as np

# Targets of the share that is valid under load, and of the rms error over the bound. None: the share is printed without a
# target, because a dot that dust, a reflection or a neighbour covers cannot be found.
TARGETS = {
    "plain": (1.0, 1.3),
    "sizes": (0.98, 1.3),
    "contrasts": (0.98, 1.3),
    "ellipses": (0.98, 1.3),
    "light": (1.0, 1.3),
    "dust": (None, 1.5),
    "glare": (None, 1.3),
    "missing": (1.0, 1.3),
    "touching": (None, 1.3),
    "all, 40 %": (None, 1.3),
}


def markers(report, quick):
    report.section(
        "Dots of any make",
        f"""
        Pictures of one grey layer of 24 x 24 dots, each drawn from its family: diameters of 4 to 10 px, brighter or darker
        than the gel, contrasts of 40 to 100 levels, blur of 0.5 to 1.3 px, noise of 1 to 3. Each family adds one
        difficulty: diameters or contrasts that scatter by up to 20 %, discs that are elongated by up to 30 % in the
        corners, light that differs by up to 60 %, 20 to 300 specks of dust, three reflections, up to 10 % of the dots
        missing or touching a neighbour. The last one has all of them at 40 % of that. Under load the gel is pushed aside
        by up to 10 px. The bound is that of Cramer and Rao for the whole picture, dirt included. Of the shares the worst
        trial is printed, of the errors the largest (seed {report.seed}).""",
    )
    command = [chain.BUILD / "bin/evaluation_markers", "--seed", str(report.seed), "--trials", "3" if quick else "20"]
    families = collections.defaultdict(list)
    for line in subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines():
        name, *numbers = line.split("\t")
        families[name].append([float(number) for number in numbers])
    for name, trials in families.items():
        there, found, valid, wrong, error, ratio, _ = np.array(trials).T
        least, most = TARGETS[name]
        share = (valid / there).min()
        report.row(
            f"{name}: found at rest, valid under load; taken for another",
            f"{(found / there).min():.1%}, {share:.1%}; {wrong.sum():.0f} of {there.sum():.0f}",
            target="" if least is None else f">= {least:.0%}",
            least=least,
            value=None if least is None else share,
            name=f"dots: {name}",
        )
        report.row(
            "    error over its bound; squared over the variance",
            f"{error.max():.2f}; {ratio.max():.2f}",
            target=f"<= {most}",
            limit=most,
            value=error.max(),
            name=f"dots: {name}, error",
        )
