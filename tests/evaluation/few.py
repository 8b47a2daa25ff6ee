"""Gels of few markers. Called like the paper's experiments."""

import numpy as np

import chain
import shapes
import unseen

GRIDS = {4: (6, 2), 5: (5, 1), 6: (4, 1), 7: (3, 2), 8: (3, 1)}  # markers a side: every so many of the paper's 24, from the first


def gel(side):
    """Its text, and which of the paper's markers it has."""
    step, first = GRIDS[side]
    index = first + step * np.arange(side)
    centre = 3 * (index.mean() - 11.5)
    text = chain.gel_text()
    layer = f'[[layers]]\ncolour = "blue"\ndepth_mm = 6\ncolumns = {side}\nrows = {side}\npitch_mm = {3 * step}\ndiameter_mm = 2\ncentre_mm = [{centre}, {centre}]\n'
    return text[: text.index("[[layers]]")] + layer + text[text.index("[camera]") :] + unseen.ALL_KNOWN, (24 * index[:, None] + index).ravel()


def few(report, quick):
    report.section(
        "Gels of few markers",
        """
        One layer of 4 x 4 to 8 x 8 dots, 6 mm deep and 18 to 9 mm apart, and random loads inside the field (see loads nobody has
        tuned with), two frames each. The gel file is right and states no nodes. Intervals are those of force and moment.""",
    )
    count = 6 if quick else 150
    families = [shapes.INSIDE[i % len(shapes.INSIDE)] for i in range(count)]
    drawn = unseen.Drawn(40, families, np.random.default_rng([report.seed, 16]))
    true = np.repeat(drawn.wrench, 2, axis=0)
    size = np.linalg.norm(true[:, :3], axis=1)
    for side in GRIDS:
        text, markers = gel(side)
        moved = np.repeat(drawn.displacement[:, markers], 2, axis=0)
        found = chain.run(moved, gel=text, zero_every=2 * unseen.OF_A_ZERO, seed=report.seed)
        error = found.wrench - true
        covered = float(np.mean(abs(error) <= 1.96 * found.deviation))
        report.row(f"{side} x {side} dots: valid", f"{100 * found.valid.mean():.1f} %", "100 %", 100 * found.valid.mean(), within=(100, 100))
        report.row("    95 % intervals of force and moment hold", f"{100 * covered:.1f} %", "92 - 98 %", 100 * covered, within=(92, 98))
        report.row("    error of the force, median", f"{100 * np.median(np.linalg.norm(error[:, :3], axis=1) / size):.0f} % of it")
