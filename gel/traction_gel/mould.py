"""Drawings of what a built-in shape is cast in: its bone, cups, and a lid, as STEP and STL. Lengths in mm, gel frame.

A cup's cavity is the gel, or what of it is deeper than a layer of markers or than a skin: one cup for each, all of the same
outside. Two pins stand on a cup's rim. With a bone, two halves of a lid close the gel's end; the bone passes between them and
hangs by a bridge, which has the lid's outline, on the same pins. Without a bone, a window on the cup's rim takes its place.
"""

import contextlib
import dataclasses
import itertools
import math
import os
import pathlib
import sys

import gmsh
import numpy as np

from . import picture, shapes, triangles
from .files import replaced
from .mesh import session
from .problem import Problem

CHORDS = 48  # of a circle, in STL
SAME_STEP, SAME_STL = 1e-4, 5e-3  # parts by which volumes may differ
TOUCHING_MM3 = 1e-3  # parts that intersect by less only touch
BESIDE = 1e-3  # mm, of a cavity's middle from the gel's
SPARE = 0.5  # mm, by which holes of the lid reach over the bone, and the bridge stays away from them


@dataclasses.dataclass
class Part:
    """A part as it is written: its volume [mm³], and the triangles of its STL (corners V x 3, corner numbers T x 3)."""

    name: str
    volume: float
    corners: np.ndarray
    triangles: np.ndarray


class Drawing:
    """The dimensions, and the parts in gmsh's current model: each a list of (3, tag)."""

    def __init__(self, task):
        shape, table = task["shape"], task["mould"]
        if "gel_file" in shape:
            raise Problem("moulds are drawn for the built-in shapes; draw that of shape.gel_file in the CAD program")
        self.form = shapes.built_in(shape)
        self.wall, self.pin, self.clearance = (table[key] for key in ("wall_mm", "pin_mm", "clearance_mm"))
        self.hollow_wall = task.get("bone", {}).get("wall_mm")
        self.lid, self.bridge = (table["lid_mm"] if self.form.has_bone else 0.0), table["bridge_mm"]
        x, y = self.form.base
        self.half = x + self.wall, y + self.wall + self.pin
        self.pin_at = self.half[1] - (self.wall + self.pin) / 2
        gap = self.form.inside if self.form.has_bone else self.wall
        self.pour = table.get("pour_mm", 0.75 * gap)
        if self.pour > gap:
            raise Problem(f"mould.pour_mm is {self.pour:g}: it must be at most {gap:g}, which is what there is room for")
        self.bridge_half = x - self.form.inside - 2 * SPARE
        self.pour_at = x - self.form.inside - SPARE + self.pour / 2  # so that it opens into the thinnest inner layer, too
        if self.form.has_bone and self.bridge_half < SPARE:
            raise Problem(f"the bone is {2 * (x - self.form.inside):g} mm wide: too thin to hang by a bridge between two holes")

    def depths(self, task):
        """Depths of the surfaces that are cast one after the other, the touched one first."""
        skins = np.cumsum([material["skin_mm"] for material in task.get("materials", [])])
        found = {0.0, *map(float, skins), *(layer["depth_mm"] for layer in task["layers"] if "depth_mm" in layer)}
        return sorted(depth for depth in found if depth < self.form.inside)

    def box(self, low, high, half=None):
        """A box about the z axis from z = low to high."""
        x, y = half or self.half
        return [(3, gmsh.model.occ.addBox(-x, -y, low, 2 * x, 2 * y, high - low))]

    def pins(self, low, high, radius):
        return [(3, gmsh.model.occ.addCylinder(0, sign * self.pin_at, low, 0, 0, high - low, radius)) for sign in (-1, 1)]

    def column(self, low, high, more):
        """The bone's outline at its end, wider by `more`, from z = low to high."""
        occ = gmsh.model.occ
        x, y = (side - self.form.inside + more for side in self.form.base)
        cylinder = [(3, occ.addCylinder(0, 0, low, 0, 0, high - low, 1))]
        occ.dilate(cylinder, 0, 0, 0, x, y, 1)
        return cylinder

    def weighed(self, solids):
        """Volume and centre of bodies in a cup, of which only their eighths are left: OpenCASCADE's sums over half an ellipsoid
        err by 0.2 %, over eighths by 1e-5."""
        occ, end = gmsh.model.occ, self.form.end
        x, y = self.half
        boxes = [
            (3, occ.addBox(-x * left, -y * near, end / 2 * high, x, y, end / 2))
            for left, near, high in itertools.product((0, 1), repeat=3)
        ]
        parts = occ.intersect(solids, boxes)[0]
        volumes = np.array([occ.getMass(*part) for part in parts])
        centres = np.array([occ.getCenterOfMass(*part) for part in parts])
        return volumes.sum(), volumes @ centres / volumes.sum()

    def channels(self, depth):
        """Grooves in a cup's rim below a window, by which what is too much leaves."""
        if self.form.has_bone:
            return []
        length = 2 * self.half[0] + 2
        across = [(3, gmsh.model.occ.addCylinder(-length / 2, 0, self.form.end, length, 0, 0, self.pour / 2))]
        return gmsh.model.occ.cut(across, self.form.solid(depth))[0]

    def cup(self, depth):
        occ, end = gmsh.model.occ, self.form.end
        whole, _ = occ.cut(self.box(-self.wall, end), [*self.form.solid(depth), *self.channels(depth)])
        return occ.fuse(whole, self.pins(end - self.wall, end + self.lid + self.bridge, self.pin / 2))[0]

    def lid_half(self):
        occ, low, high = gmsh.model.occ, self.form.end, self.form.end + self.lid
        x, y = self.half
        half = [(3, occ.addBox(-x, 0, low, 2 * x, y, high - low))]
        holes = [(3, occ.addCylinder(sign * self.pour_at, 0, low, 0, 0, high - low, self.pour / 2)) for sign in (-1, 1)]
        pins = self.pins(low, high, self.pin / 2 + self.clearance)
        return occ.cut(half, [*holes, *pins, *self.column(low, high, self.clearance)])[0]

    def hollow(self):
        """What is empty within a bone that has a wall."""
        if self.hollow_wall is None:
            return []
        top = self.form.end + self.lid + self.bridge
        return [*self.form.solid(self.form.inside + self.hollow_wall), *self.column(self.form.end, top, -self.hollow_wall)]

    def bone(self):
        occ, low, high = gmsh.model.occ, self.form.end + self.lid, self.form.end + self.lid + self.bridge
        if self.form.has_bone:
            bridge = self.box(low, high, (self.bridge_half, self.half[1]))
            bone = [*self.form.solid(self.form.inside), *self.column(self.form.end, low, 0)]
            whole = occ.fuse(bridge, bone)[0]
        else:
            whole = self.box(low, high)
        return occ.cut(whole, [*self.hollow(), *self.pins(low, high, self.pin / 2 + self.clearance)])[0]

    def parts(self, task):
        """Names of the parts, and what draws each."""
        cups = [(f"cup_{depth:g}mm" if depth else "cup", lambda depth=depth: self.cup(depth)) for depth in self.depths(task)]
        if not self.form.has_bone:
            return [("window", self.bone), *cups]
        return [("bone", self.bone), *cups, ("lid_half", self.lid_half)]


@contextlib.contextmanager
def silent():
    """Keeps standard output from OpenCASCADE, which reports what it writes."""
    sys.stdout.flush()
    with open(os.devnull, "w") as nothing:
        kept = os.dup(1)
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def volume(solids):
    gmsh.model.occ.synchronize()
    return sum(gmsh.model.occ.getMass(*solid) for solid in solids)


def common(one, other):
    """Volume that two bodies have in common; both stay."""
    found, _ = gmsh.model.occ.intersect(one, other, removeObject=False, removeTool=False)
    return volume([solid for solid in found if solid[0] == 3])


def show_quarters(solids, half):
    """Divides bodies by the planes x = 0 and y = 0, and leaves their outer faces alone to be written: gmsh 4.13 cannot mesh every
    face that closes around an axis."""
    occ, far = gmsh.model.occ, 4 * max(half)
    planes = [(2, occ.addRectangle(-far, -far, 0, 2 * far, 2 * far)) for _ in range(2)]
    occ.rotate(planes[:1], 0, 0, 0, 1, 0, 0, math.pi / 2)
    occ.rotate(planes[1:], 0, 0, 0, 0, 1, 0, math.pi / 2)
    parts, _ = occ.fragment(solids, planes)
    occ.synchronize()
    volumes = [part for part in parts if part[0] == 3]
    outer = gmsh.model.getBoundary(volumes, combined=True, oriented=False)
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in outer])


def write(task, stem, say):
    """Writes STEM_PART.step and .stl for each part, and a picture, STEM_mould.png. Returns their paths. Raises a Problem, and
    writes nothing, if the parts do not fit together (check)."""
    drawing = Drawing(task)
    names = [name for name, _ in drawing.parts(task)]
    stem = pathlib.Path(stem)
    paths = [stem.with_name(f"{stem.name}_{name}{end}") for name in names for end in (".step", ".stl")]
    paths.append(stem.with_name(f"{stem.name}_mould.png"))
    with replaced(*paths) as temporary:
        parts = []
        with session():
            gmsh.option.setNumber("Mesh.CharacteristicLengthFromCurvature", CHORDS)
            gmsh.option.setNumber("Mesh.Binary", 1)
            for (name, draw), step, stl in zip(drawing.parts(task), temporary[:-1:2], temporary[1::2]):
                say(f"drawing {name}", True)
                gmsh.clear()
                solids = draw()
                held = volume(solids)
                with silent():
                    gmsh.write(str(step))
                show_quarters(solids, drawing.half)
                gmsh.model.mesh.generate(2)
                gmsh.write(str(stl))
                parts.append(Part(name, held, *triangles.read(stl, name)))
            check(drawing, task, parts, temporary[:-1:2], say)
        picture.draw_mould(parts, temporary[-1])
    return paths


def check(drawing, task, parts, steps, say):
    """Reads the parts from their STEP files and holds them against the gel and against each other. Says the cavities'
    volumes."""
    for part in parts:
        corners = part.corners[triangles.oriented(part.corners, part.triangles)]
        a, b, c = corners.transpose(1, 0, 2)
        by_triangles = (a * np.cross(b, c)).sum() / 6
        if not math.isclose(by_triangles, part.volume, rel_tol=SAME_STL):
            raise Problem(
                f"mould: the triangles of {part.name} enclose {by_triangles:.6g} mm³, and it has {part.volume:.6g}; "
                "nothing was written. Please report it, with the description"
            )
    for depth in drawing.depths(task):
        gmsh.clear()
        read = {part.name: gmsh.model.occ.importShapes(str(step)) for part, step in zip(parts, steps)}
        cup = f"cup_{depth:g}mm" if depth else "cup"
        used = {name: solids for name, solids in read.items() if not name.startswith("cup") or name == cup}
        if "lid_half" in used:
            used["lid"] = gmsh.model.occ.copy(used["lid_half"])
            gmsh.model.occ.rotate(used["lid"], 0, 0, 0, 0, 0, 1, math.pi)
        for (one, first), (other, second) in itertools.combinations(used.items(), 2):
            if common(first, second) > TOUCHING_MM3:
                raise Problem(
                    f"mould: {one} and {other} intersect; nothing was written. Please report it, with the description"
                )
        filled = [*read[cup], *read[parts[0].name], *drawing.hollow(), *drawing.channels(depth)]
        found = gmsh.model.occ.cut(drawing.box(-drawing.wall, drawing.form.end), filled)[0]
        held, there = drawing.weighed(found)
        wanted, here = drawing.weighed(drawing.form.solid(depth))
        if drawing.form.has_bone:
            bone, middle = drawing.weighed(drawing.form.solid(drawing.form.inside))
            wanted, here = wanted - bone, (wanted * here - bone * middle) / (wanted - bone)
        if not math.isclose(held, wanted, rel_tol=SAME_STEP) or math.dist(there, here) > BESIDE:
            raise Problem(
                f"mould: the cavity of {cup} has {held:.6g} mm³, and the gel {wanted:.6g}, or it lies beside it; nothing was "
                "written. Please report it, with the description"
            )
        say(f"{cup}: {1e-3 * held:.2f} ml of gel", False)
