"""A picture of gel, nodes and markers, and of what one force does."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as pyplot  # noqa: E402
import numpy as np  # noqa: E402


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
