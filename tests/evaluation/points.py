"""Critical points of the shear: where the shear of a twist, a spread or a saddle vanishes. Called like the paper's experiments;
VTK finds the same points in the same fields."""

import numpy as np

import chain
import loads
import shapes
from chain import GF
from report import rms

THICKNESS = 40
PITCH = 3e-3
NEAR = 2 * PITCH  # of the true place
NODES = loads.nodes().T


class Load:
    """A ball or a disc that is pressed, and along the gel p J (x - zero): in parts of the pressure p."""

    def __init__(self, generator, has_point):
        radius, shape = generator.uniform(3e-3, 8e-3), generator.choice(["ball", "disc"])
        spacing = 0.5e-3 if radius < 6.5e-3 else 0.75e-3
        axis = spacing * np.arange(-(radius // spacing) - 1, radius // spacing + 2)
        x, y = np.meshgrid(*(axis + generator.uniform(-0.5, 0.5) * spacing for _ in range(2)))
        height = 1 - (x * x + y * y) / radius**2
        pressure = np.where(height > 0, np.sqrt(np.maximum(height, 0)) if shape == "ball" else 1.0, 0).ravel()
        points, pressure = np.stack([x.ravel(), y.ravel()])[:, pressure > 0], pressure[pressure > 0] / pressure.sum()
        turn, off = generator.uniform(0, 2 * np.pi), generator.uniform(0, 0.4) * radius
        zero = off * np.array([np.cos(turn), np.sin(turn)])
        self.slope = {
            "vortex": lambda: generator.choice([-1, 1]) * np.array([[0, -1], [1, 0]]) + generator.uniform(-0.3, 0.3) * np.eye(2),
            "radial": lambda: generator.choice([-1, 1]) * np.eye(2),
            "saddle": lambda: np.diag(generator.choice([-1, 1]) * np.array([1, -1])),
            "none": lambda: np.zeros((2, 2)),
        }[has_point]()
        shear = self.slope @ (points - zero[:, None]) * pressure
        if has_point == "none":  # pulled one way, or pressed alone
            shear = np.outer([np.cos(turn), np.sin(turn)], pressure) * generator.choice([0, 1])
        normal = generator.uniform(100, 500) * GF
        size = np.hypot(*shear).sum()
        shear *= generator.uniform(0.2, 0.7) * normal / size if size else 0
        centre = generator.uniform(-25e-3, 25e-3, (2, 1))
        self.has_point, self.zero = has_point, zero + centre[:, 0]
        self.index = 0 if has_point == "none" else int(np.sign(np.linalg.det(self.slope)))
        self.displacement = shapes.displacements(THICKNESS, points + centre, np.vstack([shear, normal * pressure]))


def find(force, deviation, least):
    """Rows of points.f64 (parts.cpp), of each field."""
    with chain.job() as job:
        np.stack([force, deviation], 1).astype(np.float32).tofile(job / "field.f32")
        chain.call("parts", "points", job, least)
        rows = np.fromfile(job / "points.f64").reshape(-1, 10)
        return [rows[rows[:, 0] == frame] for frame in range(len(force))]


def by_vtk(force, touched):
    """Index, x and y [m] of the points of a field, in triangles of which all nodes are touched."""
    import vtk
    from vtk.util import numpy_support

    grid = vtk.vtkImageData()
    grid.SetDimensions(24, 24, 1)
    vectors = numpy_support.numpy_to_vtk(force * [1e6, 1e6, 0], deep=True)  # VTK takes 1e-10 of any unit for 0
    vectors.SetName("shear")
    grid.GetPointData().SetVectors(vectors)
    topology = vtk.vtkVectorFieldTopology()
    topology.SetInputData(grid)
    topology.SetMaxNumSteps(0)
    topology.Update()
    points = topology.GetOutput(0)
    found = []
    for number in range(points.GetNumberOfPoints()):
        x, y, _ = points.GetPoint(number)
        column, row = min(int(x), 22), min(int(y), 22)
        s, t, first = x - column, y - row, row * 24 + column
        right, up, across = first + 1, first + 24, first + 25
        if (column + row) % 2 == 0:  # VTK alternates the diagonals, as we do
            corners = [first, across, right if s > t else up]
        else:
            corners = [right, up, first if s + t < 1 else across]
        if touched[corners].all():
            kind = points.GetPointData().GetArray("type").GetValue(number)
            found.append([-1 if kind == 1 else 1, *(NODES[0] + PITCH * np.array([x, y]))])
    return np.array(found).reshape(-1, 3)


def is_known(point, theirs):
    return bool(np.any((np.linalg.norm(theirs[:, 1:] - point[8:10], axis=1) < 1e-6) & (theirs[:, 0] == point[1])))


def points(report, quick):
    report.section(
        "Critical points of the shear",
        f"""
        Balls and discs of 3 to 8 mm radius, 100 to 500 gf, whose shear is 0.2 to 0.7 of their pressure and vanishes at a
        place up to 0.4 of the radius beside the centre: turning (and up to 0.3 of that towards it or away), away from it or towards it, or
        a saddle; and a quarter without such a place, pulled or pressed alone. Listed are points of at least 3 deviations. Right: at most
        {1e3 * NEAR:.0f} mm from a true place with that index, once. VTK: all points of vtkVectorFieldTopology in what is touched.""",
    )
    generator = np.random.default_rng([report.seed, 7])
    kinds = ["vortex", "radial", "saddle", "none"]
    drawn = [Load(generator, kinds[i % 4]) for i in range(80 if quick else 1200)]
    field = chain.run(np.array([load.displacement for load in drawn]), gel=chain.gel_text(THICKNESS), zero_every=100,
                       seed=report.seed % 2**20)
    force, deviation = (field[name].reshape(len(drawn), -1, 3) for name in ("force_N", "deviation_N"))
    listed, everything = find(force, deviation, 3), find(force, deviation, 0)
    right = {kind: [] for kind in kinds}  # of each that is listed: whether
    error, ratio, missing = {kind: [] for kind in kinds}, [], {kind: 0 for kind in kinds}
    for load, found in zip(drawn, listed):
        off = found[:, 4:6] - load.zero
        true = (found[:, 1] == load.index) & (np.linalg.norm(off, axis=1) < NEAR)
        first = true & (np.cumsum(true) == 1)
        right[load.has_point] += list(first)
        missing[load.has_point] += load.index != 0 and not first.any()
        error[load.has_point] += list(1e3 * np.linalg.norm(off[first], axis=1))
        ratio += list(np.ravel(off[first] / found[first, 6:8]))
    lines = [
        (kind, str(len(drawn) // 4), str(len(right[kind])), str(sum(right[kind])), *(
            (f"{rms(error[kind]):.3f} mm", f"{np.quantile(error[kind], 0.95):.3f} mm") if error[kind] else ("–", "–")))
        for kind in kinds
    ]
    report.table(["load", "loads", "listed", "right", "place off, rms", "95 %"], lines)
    every = np.concatenate([right[kind] for kind in kinds])
    vortex = rms(error["vortex"])
    report.row("vortices: place, rms; largest", f"{vortex:.3f} mm; {max(error['vortex']):.3f} mm", "<= 0.5 mm", vortex)
    report.row("listed points whose index is right", f"{100 * every.mean():.2f} % of {len(every)}", ">= 99 %", every.mean())
    report.row("true points that are too weak to be listed", f"{sum(missing.values())} of {3 * len(drawn) // 4}")
    near = np.abs(ratio)
    report.row(
        "coordinates off by at most two deviations of noise; largest",
        f"{100 * (near <= 2).mean():.1f} %; {near.max():.1f}",
        ">= 95 %",
        (near <= 2).mean(),
    )
    try:
        strong = [ours[ours[:, 2] >= 3] for ours in everything]
        theirs = [by_vtk(one, spread[:, :2].max(1) > 0) for one, spread in zip(force, deviation)]
        known = [is_known(point, those) for ours, those in zip(strong, theirs) for point in ours]
        report.row("listed points that VTK has, too", f"{np.sum(known)} of {len(known)}", "all", np.mean(known), within=(1, 1))
    except ModuleNotFoundError:
        report.row("listed points that VTK has, too", "not compared: python3-vtk9 is not installed")
