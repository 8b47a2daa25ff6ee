"""Pictures: of gel, nodes and markers and of what one force does; of what a gel is cast in."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as pyplot  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import LineCollection  # noqa: E402
from matplotlib.colors import to_rgb  # noqa: E402
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # noqa: E402


def draw(result, path):
    """From the side: where they are. From the camera: how the markers move under a force on the middle node."""
    figure, (side, front) = pyplot.subplots(1, 2, figsize=(10, 5), layout="constrained")
    surfaces = [(result.free, "#bcd", "free surface"), (result.bonded, "#a87", "bonded surface")]
    for faces, colour, label in surfaces + [(result.between, "#7b7", "between materials")] * (len(result.between) > 0):
        cut = result.corners[faces]
        cut = cut[(cut[:, :, 1].min(1) <= 0) & (cut[:, :, 1].max(1) >= 0)].mean(1)
        side.plot(cut[:, 0], cut[:, 2], ".", color=colour, ms=4, label=label)
    thick = 0.6 * np.sqrt(result.areas.mean())  # of the slice that is shown
    cut = abs(result.nodes[:, 1]) < thick
    side.plot(*result.nodes[cut][:, [0, 2]].T, "k.", ms=4, label="nodes")
    side.quiver(*result.nodes[cut][:, [0, 2]].T, *result.normals[cut][:, [0, 2]].T, angles="xy", width=0.002, color="0.5")
    side.plot(*result.markers[abs(result.markers[:, 1]) < thick][:, [0, 2]].T, "r.", ms=4, label="markers")
    side.set(aspect="equal", xlabel="x [mm]", ylabel="z [mm], into the gel")
    side.legend(fontsize="small")
    middle = np.linalg.norm(result.nodes[:, :2], axis=1).argmin()
    moved = result.influence[:, :, middle] @ result.normals[middle]
    front.plot(*result.nodes[:, :2].T, "k.", ms=2)
    front.quiver(*result.markers[:, :2].T, *moved[:, :2].T, color="r", angles="xy")
    front.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    front.set_title(f"press on the middle node: up to {1e3 * np.linalg.norm(moved, axis=1).max():.2g} mm/N")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def _section(corners, triangles):
    """Where triangles cross the plane x = 0: segments, S x 2 (ends) x 2 (y, z)."""
    found = []
    for one, two in ((0, 1), (1, 2), (2, 0)):
        a, b = corners[triangles[:, one]], corners[triangles[:, two]]
        crosses = (a[:, 0] > 0) != (b[:, 0] > 0)
        part = np.where(crosses, a[:, 0] / np.where(crosses, a[:, 0] - b[:, 0], 1), np.nan)[:, None]
        found.append((a + part * (b - a))[:, 1:])
    ends = np.stack(found, 1)
    some = np.isfinite(ends[:, :, 0]).sum(1) == 2
    return ends[some][np.isfinite(ends[some][:, :, 0])].reshape(-1, 2, 2)


def draw_mould(parts, path):
    """Put together, cut at x = 0, and taken apart, in the pose in which gel is poured. \\param parts of mould.py"""
    figure = pyplot.figure(figsize=(10, 6), layout="constrained")
    section, apart = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="3d")
    colours = dict(zip([part.name for part in parts], ("#a87", "#89b", "#bcd", "#9cb", "#b9c", "#cb9", "#9bc")))
    cups = [part for part in parts if part.name.startswith("cup")]
    shown = [(part, 1, 0) for part in cups[:1]]
    height = np.ptp(cups[0].corners[:, 2])
    shown += [(part, turn, 0.8 * height) for part in parts if part.name == "lid_half" for turn in (1, -1)]
    shown += [(parts[0], 1, 1.4 * height)]
    for part, turn, lift in shown:
        corners = part.corners * [turn, turn, 1]
        label = part.name if turn > 0 else None
        section.add_collection(LineCollection(_section(corners, part.triangles), colors=colours[part.name], label=label))
        faces = corners[part.triangles]
        normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        bright = 0.55 + 0.45 * abs(normals @ [0.3, -0.5, 0.8])
        colour = np.outer(bright, to_rgb(colours[part.name]))
        apart.add_collection3d(Poly3DCollection(faces + [0, 0, lift], facecolors=colour))
    for part in cups[1:]:
        lines = LineCollection(_section(part.corners, part.triangles), colors="0.6", ls=":", label=part.name)
        section.add_collection(lines)
    section.autoscale()
    section.set(aspect="equal", xlabel="y [mm]", ylabel="z [mm]")
    section.legend(fontsize="small", loc="lower left")
    low, high = (np.array([getattr(part.corners, side)(0) for part in cups]) for side in ("min", "max"))
    size = high.max(0) - low.min(0)
    apart.set(xlim=(low[0, 0], high[0, 0]), ylim=(low[0, 1], high[0, 1]), zlim=(low[0, 2], low[0, 2] + 2.4 * size[2]))
    apart.set_box_aspect((size[0], size[1], 2.4 * size[2]))
    apart.view_init(28, 25)
    apart.set_axis_off()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
