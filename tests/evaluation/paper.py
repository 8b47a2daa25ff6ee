"""The paper's own experiments. Each takes the report and whether to be quick (fewer trials); truth.py has the loads.

Errors are root mean squares over trials unless they are called the worst. A trial has its own noise and its own zero.
"""

import numpy as np

import chain
import loads
import truth
from chain import GF
from report import rms
from truth import probe

PAPER_NOISE_PX = 0.1  # of the paper's tracking; what the pictures have themselves is negligible beside it


def angle_deg(vectors):
    """From the normal, of ... x 3."""
    return np.degrees(np.arctan2(np.hypot(vectors[..., 0], vectors[..., 1]), vectors[..., 2]))


def magnitude(report, quick):
    report.section(
        "Magnitude (the paper's figure 7a)",
        """
        A probe of 5 mm diameter presses near the centre, 0 to 750 gf in steps of 50 gf, 10 trials, single frames.""",
    )
    applied = np.arange(0, 751, 50)
    trials = 10
    forces = np.zeros((trials, len(applied), 3))
    forces[:, :, 2] = applied * GF
    displacement = probe(forces.reshape(-1, 3))
    lines, drawn = [], {}
    for label, extra, target in (("pictures", 0.0, "<= 3 gf + 1 %"), ("0.1 px of noise", PAPER_NOISE_PX, "")):
        found = chain.run(displacement, zero_every=len(applied), extra=extra)
        total = found.resultant_N.reshape(trials, len(applied), 3) / GF
        error = np.linalg.norm(total, axis=2) * np.sign(total[:, :, 2]) - applied
        error[:, 0] = total[:, 0, 2]
        step = rms(error, 0)
        worst = np.argmax(step / (3 + 0.01 * applied))
        drawn[label] = total[:, :, 2]
        lines.append((label, *[f"{value:.1f}" for value in step[[0, 1, 2, 4, 8, 15]]]))
        report.row(
            f"magnitude error, 0 - 750 gf, {label}",
            f"{rms(error):.1f} gf",
            target,
            step[worst] / (3 + 0.01 * applied[worst]),
            paper="30 gf",
            within=(0, 1),
            must=True,
        )
        report.row(
            "    worst step", f"{step[worst]:.1f} gf at {applied[worst]} gf, mean off {error[:, worst].mean():+.1f}"
        )
    report.table(["error [gf] at", "0 gf", "50", "100", "200", "400", "750"], lines)

    def draw(axes):
        axes.plot([0, 750], [0, 750], "k-", lw=0.5)
        for mark, (label, values) in zip("x+", drawn.items()):
            axes.plot(np.tile(applied, trials) + (6 if mark == "+" else -6), values.ravel(), mark, ms=4, label=label)
        axes.set(xlabel="applied normal force [gf]", ylabel="measured [gf]")
        axes.legend()

    report.picture("magnitude", draw, "Figure 7a: ten trials a step. The paper's resolution is about 30 gf.")


def direction(report, quick):
    report.section(
        "Direction (the paper's figure 7b)",
        """
        The same probe with 400 gf, 0 to 45 degrees from the normal in steps of 5, 10 trials, single frames.""",
    )
    applied = np.arange(0, 46, 5)
    trials = 10
    radians = np.radians(np.tile(applied, (trials, 1)))
    forces = 400 * GF * np.stack([np.sin(radians), 0 * radians, np.cos(radians)], 2)
    displacement = probe(forces.reshape(-1, 3))
    drawn = {}
    for label, extra, target in (("pictures", 0.0, "<= 0.4 deg"), ("0.1 px of noise", PAPER_NOISE_PX, "")):
        found = chain.run(displacement, zero_every=len(applied), extra=extra)
        total = found.resultant_N.reshape(trials, len(applied), 3)
        cosine = (total * forces).sum(2) / np.linalg.norm(total, axis=2) / np.linalg.norm(forces, axis=2)
        error = np.degrees(np.arccos(np.minimum(cosine, 1)))
        step = rms(error, 0)
        worst = np.argmax(step)
        drawn[label] = angle_deg(total)
        report.row(
            f"direction error, 0 - 45 deg at 400 gf, {label}",
            f"{rms(error):.2f} deg",
            target,
            rms(error),
            paper="5 deg",
            must=True,
        )
        report.row("    worst step", f"{step[worst]:.2f} deg at {applied[worst]} deg")

    def draw(axes):
        axes.plot([0, 45], [0, 45], "k-", lw=0.5)
        for mark, (label, values) in zip("x+", drawn.items()):
            axes.plot(
                np.tile(applied, trials) + (0.3 if mark == "+" else -0.3), values.ravel(), mark, ms=4, label=label
            )
        axes.set(xlabel="applied angle [deg]", ylabel="measured [deg]")
        axes.legend()

    report.picture("direction", draw, "Figure 7b: ten trials a step. The paper's resolution is about 5 degrees.")


def separation(report, quick):
    truth_of = truth.load(40, 0.49, "layers")
    report.section(
        "Distance between the marker layers (the paper's figure 6)",
        """
        The paper's load, the same force at each of 10 x 10 nodes, mostly normal with half of it along y; mean
        difference of the 576 node forces from the truth, relative to that of a single layer of markers. Displacements
        are given with noise, not drawn. The paper has no noise and its own model as the truth; its optimum is at 2 or
        3 mm.""",
    )
    true = np.zeros((576, 3))
    for one in truth_of.contacts[0]:
        true[np.argmin(np.linalg.norm(loads.nodes() - one[1:3, None], axis=0))] = one[4:7]
    field_of = truth_of.displacement[0].reshape(-1, 576, 3)
    frames = 10 if quick else 40
    distances = [depth - 6 for depth in truth.LAYER_DEPTHS_MM]
    curves, lines = {}, []
    for noise in (0.02, PAPER_NOISE_PX):
        errors = []
        for depth in [None, *truth.LAYER_DEPTHS_MM]:
            text = chain.gel_text(red_depth=depth or 8)
            if depth is None:  # the blue layer alone
                text = text[: text.index('[[layers]]\ncolour = "red"')] + text[text.index("[camera]") :]
            shown = [field_of[0]] if depth is None else [field_of[0], field_of[1 + truth.LAYER_DEPTHS_MM.index(depth)]]
            found = chain.run(np.repeat(np.concatenate(shown)[None], frames, axis=0), gel=text, given=noise)
            errors.append(abs(found.force_N.reshape(frames, 576, 3) - true).mean((0, 1)))
        errors = np.array(errors)
        curves[noise] = errors / errors[0]
        lines += [
            (f"{noise} px, {axis}", *[f"{value:.2f}" for value in errors[1:, c] / errors[0, c]])
            for c, axis in enumerate(("Fx", "Fy", "Fz"))
        ]
        best = distances[int(np.argmin(errors[1:].sum(1)))]
        report.row(f"best distance between the layers, {noise} px of noise", f"{best} mm", paper="2 - 3 mm")
    report.table(["noise, component", *[f"{distance} mm" for distance in distances]], lines)

    def draw(axes):
        for (noise, values), style in zip(curves.items(), ("-", "--")):
            for c, axis in enumerate(("Fx", "Fy", "Fz")):
                axes.plot(distances, values[1:, c], style + "o", ms=3, color=f"C{c}", label=f"{axis}, {noise} px")
        axes.set(xlabel="distance between the layers [mm]", ylabel="mean difference / of one layer")
        axes.legend(fontsize=7)

    report.picture(
        "separation", draw, "Figure 6: error over the distance of the layers; 1 is a single layer of blue markers."
    )


def point_load(report, quick):
    report.section(
        "Response to a point load (the paper's figure 8)",
        """
        200 gf at a point, at nine places between two neighbouring nodes; the normal forces of the nodes in its row
        over their distance from it, mean of 10 frames.""",
    )
    steps = truth.load(40, 0.49, "steps")
    frames = 10
    drawn = {}
    x = 1e3 * loads.nodes()[0].reshape(24, 24)[12]
    for label, extra, target in (("pictures", 0.0, "<= 2.5 mm"), ("0.1 px of noise", PAPER_NOISE_PX, "")):
        found = chain.run(np.repeat(200 * GF * steps.displacement, frames, axis=0), extra=extra)
        normal = found.force_N.reshape(-1, frames, 24, 24, 3).mean(1)[:, 12, :, 2] / GF
        offset = x[None, :] - 1e3 * steps.contacts[:, 0, 1][:, None]
        order = np.argsort(offset.ravel())
        offset, normal = offset.ravel()[order], normal.ravel()[order]
        smooth = np.convolve(np.pad(normal, 2, mode="edge"), np.ones(5) / 5, "valid")
        above = offset[smooth >= smooth.max() / 2]
        half = (above.max() - above.min()) / 2
        drawn[label] = (offset, normal / normal.max())
        report.row(
            f"half-width of a point load, {label}", f"{half:.2f} mm", target, half, paper="4 mm", must=True
        )

    def draw(axes):
        for mark, (label, (offset, normal)) in zip(".x", drawn.items()):
            axes.plot(offset, normal, mark, ms=4, label=label)
        axes.set(xlim=(-15, 15), xlabel="distance from the load [mm]", ylabel="normal force of a node / largest")
        axes.legend()

    report.picture("point_load", draw, "Figure 8: the paper's half-width is about 4 mm.")


def spline(nodes, places):
    """The surface between nodes (24 x 24 x 3) at places (2 x P, m): Catmull and Rom's spline, as the viewer draws it."""
    at = np.clip(places / 3e-3 + 11.5, 0, 22.999)
    first = at.astype(int)

    def weights(t):
        return np.array(
            [t * (t * (1 - t / 2) - 0.5), 1 + t * t * (1.5 * t - 2.5), t * (0.5 + t * (2 - 1.5 * t)), t * t * (t - 1) / 2]
        )

    column, row = (np.clip(one + np.arange(-1, 3)[:, None], 0, 23) for one in first)
    x, y = weights(at[0] - first[0]), weights(at[1] - first[1])
    return np.einsum("yp,xp,yxpc->pc", y, x, nodes[row[:, None], column[None]])


def surface(report, quick):
    press = truth.load(40, 0.49, "surface")
    radius = press.contacts[0, 0, 3]
    report.section(
        "The touched surface (the paper's figure 9a)",
        f"""
        A ball of 8 mm pressed with 400 gf at {len(press.contacts)} places within a pitch of the centre, single frames;
        it touches a circle of {2e3 * radius:.1f} mm. How the touched surface moves, as the viewer computes it (from the
        nodes' forces, and beneath a round contact by Hertz), against CalculiX's: the largest errors at any node, and at any of the places 1 mm apart between
        them, in parts of the depth. Within the circle CalculiX's own meshes differ by a tenth of it.""",
    )
    trials = 2 if quick else 10
    shown = np.repeat(press.displacement, trials, axis=0)
    centres = np.repeat(press.contacts[:, 0, 1:3], trials, axis=0)
    answers = chain.run(shown[:, :1152], zero_every=1)
    found = chain.surface(chain.gel_text(), answers.force_N.reshape(-1, 576, 3))
    depth = shown[:, 1152:, 2].max(1)
    points = truth.surface_points()[:2]
    everywhere = np.concatenate([loads.nodes()[:2], points], axis=1)
    found[:, :, 2], under = chain.under_rounds(answers, found, (chain.YOUNG, 0.49), (24, 24, 3e-3), everywhere)
    between = np.array([spline(one.reshape(24, 24, 3), points) for one in found])
    found[:, :, 2] += under[:, :576]
    between[:, :, 2] += under[:, 576:]
    for label, places, error in (
        ("at the nodes", loads.nodes(), abs(found - shown[:, 1152:1728])),
        ("between them", points, abs(between - shown[:, 1728:])),
    ):
        error /= depth[:, None, None]
        beyond = np.linalg.norm(places.T - centres[:, None], axis=2) - radius  # the rim
        worst = error[:, :, 2][beyond > 0].max()
        report.row(
            f"touched surface {label}, inwards, beyond the contact's rim",
            f"{100 * worst:.1f} %",
            f"<= 3 % of {1e3 * depth.mean():.2f} mm",
            worst,
            must=True,
        )
        shares = [error[:, :, 2][beyond > 1e-3 * mm].max() for mm in (1, 2, 3, 4, 6)]
        report.row("    1, 2, 3, 4, 6 mm beyond it", ", ".join(f"{100 * share:.1f}" for share in shares) + " %")
        report.row("    sideways, beyond it", f"{100 * error[:, :, :2][beyond > 0].max():.1f} %")
    # The displacement is linear in the forces: the mean of its frames is that of their forces' mean.
    mean = found.reshape(-1, trials, 576, 3).mean(1) - press.displacement[:, 1152:1728]
    beyond = np.linalg.norm(loads.nodes().T - press.contacts[:, 0, None, 1:3], axis=2) - radius
    report.row(
        f"at the nodes, inwards, beyond the rim, means of {trials} frames",
        f"{100 * abs(mean[:, :, 2][beyond > 0]).max() / depth.mean():.1f} %",
    )

    def draw(axes):
        order = np.argsort(points[0])
        row = order[points[1][order] == 0]
        axes.plot(1e3 * points[0, row], -1e3 * shown[0, 1728 + row, 2], "k-", lw=0.8, label="CalculiX")
        axes.plot(1e3 * points[0, row], -1e3 * between[0, row, 2], "+", label="tractiond")
        axes.set(xlabel="x [mm]", ylabel="height [mm]")
        axes.legend()

    report.picture("surface", draw, "A section through the touched surface, y = 0.")
