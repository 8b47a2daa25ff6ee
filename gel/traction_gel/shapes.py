"""The gel's body in gmsh: built-in shapes and files of CAD. Lengths in mm, gel frame: the touched surface crosses the
z axis at 0, z points into the gel."""

import math
import pathlib
from collections.abc import Callable
from typing import NamedTuple

import gmsh
import numpy as np

from . import triangles
from .problem import Problem

UNIT_LIMITS_MM = (2, 500)  # of the largest extent of a gel
UNITS = {"metres": 1000, "inches": 25.4, "centimetres": 10, "micrometres": 0.001}  # in mm, by which a file is held to be wrong


def build(shape, materials, folder):
    """Makes the volumes of the gel in the current model. Returns those of each material, the table [material] first, the
    bonded faces, and the other faces of the bone (tags).

    \\param shape the table [shape] of the input
    \\param materials the tables [[materials]]: each a skin or the solids of a file
    \\param folder which the names of files count from
    """
    given, other = ("gel_file", "skin_mm") if "gel_file" in shape else ("skin_mm", "gel_file")
    for number, material in enumerate(materials):
        if given not in material or other in material:
            why = f"[shape] has {'a' if given == 'gel_file' else 'no'} gel_file"
            raise Problem(f"materials[{number}] must have {given}, and not {other}: {why}")
    if "gel_file" in shape:
        volumes, bonded, bone = _from_files(shape, [material["gel_file"] for material in materials], folder)
    else:
        depths = np.cumsum([0.0, *(material["skin_mm"] for material in materials)])
        form = built_in(shape)
        form.check_skins(depths)
        gels = [form.solid(depth) for depth in depths]
        volumes, bonded, bone = _with_bone(gels, form.solid(form.inside)) if form.has_bone else _at_base(gels)
        volumes = volumes[-1:] + volumes[:-1]  # the core is the last from outside
    gmsh.model.occ.synchronize()
    _check_unit(np.ptp(extent(3, sum(volumes, [])), axis=0).max())
    _check_pieces(volumes, bonded, shape.get("cavities", 0))
    return volumes, bonded, bone


def _pieces(dimension, tags):
    """Groups entities (tags) of which each touches another of its group in what bounds them. The largest group is the first."""
    pieces = []
    for tag in tags:
        piece, sides = {tag}, set(gmsh.model.getAdjacencies(dimension, tag)[1].tolist())
        for other in [other for other in pieces if other[1] & sides]:
            pieces.remove(other)
            piece, sides = piece | other[0], sides | other[1]
        pieces.append((piece, sides))
    pieces = [(piece, extent(dimension, piece)) for piece, _ in pieces]
    return sorted(pieces, key=lambda each: -np.ptp(each[1], axis=0).max())


def extent(dimension, tags):
    """Least and largest coordinates of entities: 2 x 3."""
    boxes = np.array([gmsh.model.getBoundingBox(dimension, tag) for tag in tags])
    return np.array([boxes[:, :3].min(0), boxes[:, 3:].max(0)])


def _check_pieces(volumes, bonded, cavities):
    """Raises a Problem for a gel of several bodies, or with closed cavities that no bone fills and nobody named."""
    bodies = _pieces(3, sum(volumes, []))
    if len(bodies) > 1:
        names = ["[material]", *(f"materials[{number}]" for number in range(len(volumes) - 1))]
        found = "; ".join(
            f"{', '.join(name for name, part in zip(names, volumes) if body & set(part))}, {triangles.extent_and_place(box)}"
            for body, box in bodies
        )
        raise Problem(
            f"the gel is {len(bodies)} bodies of which one touches no other: {found}. Delete what is not the gel, or close the gap"
        )
    empty = [box for shell, box in _pieces(2, faces(sum(volumes, [])))[1:] if not shell & bonded]
    if len(empty) != cavities:
        found = "; ".join(map(triangles.extent_and_place, empty)) or "none"
        raise Problem(
            f"the gel has {len(empty)} closed cavities without a bone, and shape.cavities says {cavities}: {found}. Fill them, give "
            f"the bone, or write shape.cavities = {len(empty)} if they are meant"
        )


def _length(shape, key):
    value = shape.get(key)
    if not isinstance(value, (int, float)) or not 0 < value < math.inf:
        raise Problem(f"shape.{key} is {value!r}: it must be a length above 0, in mm")
    return float(value)


def faces(volumes):
    """The faces (tags) that bound volumes (tags): not those between two of them."""
    return {tag for _, tag in gmsh.model.getBoundary([(3, tag) for tag in volumes], oriented=False)}


def _divided(bodies):
    """Cuts bodies, each a list of (3, tag), where they overlap: what is in several belongs to the last. They share the
    faces where they touch. Returns the volumes of each (tags)."""
    for later in range(len(bodies) - 1, 0, -1):  # cut, so that no thin layer of both is left between them
        for earlier in range(later):
            if bodies[earlier] and bodies[later]:
                bodies[earlier] = gmsh.model.occ.cut(bodies[earlier], bodies[later], removeTool=False)[0]
    solids = sum(bodies, [])
    parts = gmsh.model.occ.fragment(solids[:1], solids[1:])[1] if solids[1:] else [solids]
    gmsh.model.occ.synchronize()
    owners = [number for number, body in enumerate(bodies) for _ in body]
    owner = {tag: number for number, part in zip(owners, parts) for _, tag in part}
    return [sorted(tag for tag in owner if owner[tag] == number) for number in range(len(bodies))]


def _with_bone(gels, bone):
    """Cuts the bone out of the gel's bodies. The faces that they share with it are bonded. Its other faces stay."""
    *volumes, bones = _divided([*gels, bone])
    for number, each in enumerate(volumes):
        if not each:
            raise Problem(
                f"nothing is left of part {number} of the gel: bone and other materials fill it. Is shape.bone_file the gel's?"
            )
    outside, bone = faces(sum(volumes, [])), faces(bones)
    gmsh.model.occ.remove([(3, tag) for tag in bones])
    gmsh.model.occ.synchronize()
    return volumes, outside & bone, bone - outside


def _at_base(gels):
    """Bonds the plane faces farthest along z."""
    volumes = _divided(gels)
    begins = {face: gmsh.model.getBoundingBox(2, face)[2] for face in faces(sum(volumes, []))}
    return volumes, {face for face, begin in begins.items() if begin > max(begins.values()) - 1e-3}, set()


class BuiltIn(NamedTuple):
    """A built-in shape. `solid` makes the shape less what is at most a depth below its touched surface: a list of (3, tag)."""

    solid: Callable
    end: float  # z of the plane in which it ends
    base: tuple  # half its extent there, along x and y
    inside: float  # the depth at which no gel is left
    middle: float  # z of the centre of the ellipsoid that it is at the tip, with the half axes (*base, middle); of a bone
    key: str  # of [shape], which states that
    has_bone: bool  # what is below `inside`; if there is none, the gel is bonded in its base

    def check_skins(self, depths):
        if depths[-1] >= self.inside:
            skins = f"materials[{len(depths) - 2}].skin_mm: skins of {depths[-1]:g} mm together"
            raise Problem(f"{skins} leave no gel, of shape.{self.key} {self.inside:g}")


def _ball(radius, depth):
    """A ball about (0, 0, depth), whose poles, where meshes are poor, are not on the z axis."""
    ball = gmsh.model.occ.addSphere(0, 0, 0, radius)
    gmsh.model.occ.rotate([(3, ball)], 0, 0, 0, 1, 0, 0, math.pi / 2)
    gmsh.model.occ.translate([(3, ball)], 0, 0, depth)
    return ball


def _finger(radius, length, top):
    """A hemisphere whose lowest point is at z = top, on a cylinder."""
    occ = gmsh.model.occ
    ball = _ball(radius, top + radius)
    lower = occ.addBox(-2 * radius, -2 * radius, top - radius, 4 * radius, 4 * radius, 2 * radius)
    half, _ = occ.intersect([(3, ball)], [(3, lower)])
    whole, _ = occ.fuse(half, [(3, occ.addCylinder(0, 0, top + radius, 0, 0, length, radius))])
    return whole


def _hemisphere(shape):
    radius, length, gel = _length(shape, "diameter_mm") / 2, _length(shape, "length_mm"), _length(shape, "gel_mm")
    if gel >= radius:
        raise Problem(f"shape.gel_mm is {gel:g}: it must be below half the diameter, for there is a bone inside")
    return BuiltIn(lambda depth: _finger(radius - depth, length, depth), radius + length, (radius, radius), gel, radius, "gel_mm", True)


def _ellipsoid(shape):
    axes = _length(shape, "width_mm") / 2, _length(shape, "height_mm") / 2, _length(shape, "length_mm")
    gel = _length(shape, "gel_mm")
    if gel >= min(axes):
        raise Problem(f"shape.gel_mm is {gel:g}: it must be below half of width and height, and below the length")
    occ, end = gmsh.model.occ, axes[2]

    def half(depth):
        ball = _ball(1, 0)
        occ.dilate([(3, ball)], 0, 0, 0, *(axis - depth for axis in axes))
        occ.translate([(3, ball)], 0, 0, end)
        lower = occ.addBox(-2 * axes[0], -2 * axes[1], -end, 4 * axes[0], 4 * axes[1], 2 * end)
        return occ.intersect([(3, ball)], [(3, lower)])[0]

    return BuiltIn(half, end, axes[:2], gel, end, "gel_mm", True)


def _dome(shape):
    diameter, height = _length(shape, "diameter_mm"), _length(shape, "height_mm")
    if height > diameter / 2:
        raise Problem(f"shape.height_mm is {height:g}: a dome is at most half as high as its diameter")
    radius = (diameter**2 / 4 + height**2) / (2 * height)

    def cap(depth):
        slab = gmsh.model.occ.addBox(-diameter, -diameter, -1, 2 * diameter, 2 * diameter, 1 + height)
        return gmsh.model.occ.intersect([(3, _ball(radius - depth, radius))], [(3, slab)])[0]

    return BuiltIn(cap, height, (diameter / 2, diameter / 2), height, 0.0, "height_mm", False)


def _block(shape):
    width, height, end = (_length(shape, key) for key in ("width_mm", "height_mm", "thickness_mm"))

    def slab(depth):
        return [(3, gmsh.model.occ.addBox(-width / 2, -height / 2, depth, width, height, end - depth))]

    return BuiltIn(slab, end, (width / 2, height / 2), end, 0.0, "thickness_mm", False)


BUILT_IN = {"hemisphere": _hemisphere, "ellipsoid": _ellipsoid, "dome": _dome, "block": _block}


def built_in(shape):
    """Returns the BuiltIn of the table [shape]."""
    kind = shape.get("kind")
    if kind not in BUILT_IN:
        raise Problem(f"shape.kind is {kind!r}: one of {', '.join(BUILT_IN)}, or give shape.gel_file")
    return BUILT_IN[kind](shape)


def refracting_surfaces(task):
    """Returns `camera.surfaces` of a gel file for the clear bone of [bone]: what the camera sees the gel through."""
    shape, bone = task["shape"], task["bone"]
    form = None if "gel_file" in shape else built_in(shape)
    if form is None or not form.has_bone:
        raise Problem("[bone] is for shapes with a bone, without gel_file: write [[camera.surfaces]] instead (docs/sensor.md)")
    wall = bone.get("wall_mm")
    depths = [form.inside] if wall is None else [form.inside, form.inside + wall]
    axes = [[axis - depth for axis in (*form.base, form.middle)] for depth in depths]
    if min(axes[-1]) <= 0:
        raise Problem(f"bone.wall_mm is {wall:g}: the bone is not hollow then; leave it out")
    found = [{"centre_mm": [0.0, 0.0, form.middle], "radii_mm": radii} for radii in axes]
    if wall is None:
        found.append({"centre_mm": [0.0, 0.0, form.end + task["mould"]["lid_mm"] + task["mould"]["bridge_mm"]]})
    return [surface | {"index": index} for surface, index in zip(found, (bone["index"], 1.0))]


def _solids(path, key):
    """Reads the solids of a STEP or BREP file."""
    try:
        with open(path, "rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise Problem(f"{key}: {path} cannot be read: {error.strerror}") from None
    marks = {b"ISO-10303-21": "step", b"CASCADE Topology": "brep", b"DBRep_DrawableShape": "brep"}
    kind = next((marks[mark] for mark in marks if mark in head), None)
    if not kind:
        raise Problem(f"{key}: {path} holds neither STEP, BREP nor STL: export the body as .step")
    try:
        parts = gmsh.model.occ.importShapes(str(path), highestDimOnly=False, format=kind)
    except Exception as error:  # gmsh raises this class and ValueError
        raise Problem(f"{key}: {path} cannot be read: {error}") from None
    solids = [part for part in parts if part[0] == 3]
    gmsh.model.occ.synchronize()
    if not solids:
        raise Problem(f"{key}: {path} has faces that enclose no volume: {_hole()}")
    loose = {tag for dimension, tag in parts if dimension == 2} - faces([tag for _, tag in solids])
    if loose:
        raise Problem(f"{key}: {path} has {len(loose)} faces that bound no solid, one of {_place(2, min(loose))}: close or delete them")
    found = "; ".join(_place(*part) for part in solids)
    if min(gmsh.model.occ.getMass(*part) for part in solids) <= 0:
        raise Problem(f"{key}: {path} has a solid that is inside out ({found}): turn its faces in the CAD program")
    if len(solids) > 1 and key == "shape.gel_file":
        raise Problem(f"{key}: {path} has {len(solids)} solids, and not 1: {found}. Export the gel alone, joined to one solid")
    return solids


def _hole():
    """Describes an edge that belongs to one face only."""
    for _, edge in gmsh.model.getEntities(1):
        faces = gmsh.model.getAdjacencies(1, edge)[0]
        if len(faces) == 1:
            return f"there is a hole at face {faces[0]}, by its edge of {_place(1, edge)}. Close it in the CAD program"
    return "export a solid body"


def _from_triangles(paths):
    """The gel from STL; the walls of its cavity that touch the bone are bonded."""
    parts = {key: triangles.read(path, key) for key, path in paths.items()}
    corners, numbers = parts["shape.gel_file"]
    _check_unit(np.ptp(corners, axis=0).max())
    triangles.check(corners, numbers, "shape.gel_file")
    volume = triangles.volume(corners, numbers)
    if "shape.bone_file" not in parts:
        return [[volume]], set(), set()
    bone = parts["shape.bone_file"]
    return [[volume]], triangles.touching(faces([volume]), *bone), {triangles.discrete(*bone)}


def _from_solids(paths):
    solids = {key: _solids(path, key) for key, path in paths.items()}
    bone = solids.pop("shape.bone_file", [])
    return _with_bone(list(solids.values()), bone)


def _from_files(shape, others, folder):
    """\\param others the files of further materials"""
    paths = {f"shape.{key}": pathlib.Path(folder, shape[key]) for key in ("gel_file", "bone_file") if key in shape}
    paths |= {f"materials[{number}].gel_file": pathlib.Path(folder, name) for number, name in enumerate(others)}
    for key, path in paths.items():
        if not path.exists():
            raise Problem(f"{key}: {path} does not exist")
    kinds = {path.suffix.lower() == ".stl" for path in paths.values()}
    if len(kinds) > 1 or others and True in kinds:
        raise Problem("gel_file and bone_file must all be .step or .brep, or both .stl and without [[materials]]")
    volumes, bonded, bone = (_from_triangles if kinds.pop() else _from_solids)(paths)
    outside = faces(sum(volumes, []))
    if "bonded_box_mm" in shape:
        low, high = shape["bonded_box_mm"]
        bonded |= {tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*low, *high, 2)} & outside
    if not bonded:
        raise Problem(
            "no part of the gel is bonded: its faces touch neither shape.bone_file nor lie in shape.bonded_box_mm. "
            "The faces are " + "; ".join(f"{face}, {_place(2, face)}" for face in sorted(outside))
        )
    return volumes, bonded, bone


def _place(dimension, tag):
    return triangles.extent_and_place(extent(dimension, [tag]))


def _check_unit(largest):
    low, high = UNIT_LIMITS_MM
    if not low <= largest <= high:
        units = [f"{name} ({largest * scale:.3g} mm)" for name, scale in UNITS.items() if low <= largest * scale <= high]
        raise Problem(
            f"the gel is {largest:.3g} mm large, and gels have {low} to {high}: metres and millimetres were confused. "
            f"Its numbers may be {' or '.join(units) or 'of another body'}. STEP files are read in their own unit, others as "
            "millimetres; export in millimetres"
        )
