"""The gel's body in gmsh: built-in shapes and files of CAD. Lengths in mm, gel frame: the touched surface crosses the
z axis at 0, z points into the gel."""

import math
import pathlib

import gmsh
import numpy as np

from . import triangles
from .problem import Problem

UNIT_LIMITS_MM = (2, 500)  # of the largest extent of a gel


def build(shape, folder):
    """Makes the volumes of the gel in the current model. Returns the volumes and the bonded faces (tags).

    \\param shape the table [shape] of the input
    \\param folder which the names of files count from
    """
    kind = shape.get("kind")
    if "gel_file" in shape:
        volumes, bonded = _from_files(shape, folder)
    elif kind in BUILT_IN:
        volumes, bonded = BUILT_IN[kind](shape)
    else:
        raise Problem(f"shape.kind is {kind!r}: one of {', '.join(BUILT_IN)}, or give shape.gel_file")
    _check_extent(volumes)
    return volumes, bonded


def _length(shape, key):
    value = shape.get(key)
    if not isinstance(value, (int, float)) or not 0 < value < math.inf:
        raise Problem(f"shape.{key} is {value!r}: it must be a length above 0, in mm")
    return float(value)


def _faces(volumes):
    return {tag for _, tag in gmsh.model.getBoundary([(3, tag) for tag in volumes], oriented=False)}


def _with_bone(gel, bone):
    """Cuts the bone out of the gel; both are lists of (3, tag). The faces that they share are bonded."""
    if not bone:
        gmsh.model.occ.synchronize()
        return [tag for _, tag in gel], set()
    _, parts = gmsh.model.occ.fragment(gel, bone)
    gmsh.model.occ.synchronize()
    bones = {tag for part in parts[len(gel) :] for _, tag in part}
    gels = {tag for part in parts[: len(gel)] for _, tag in part} - bones
    if not gels:
        raise Problem("the bone fills the whole gel: is shape.bone_file the gel's, or shape.gel_mm too large?")
    bonded = _faces(gels) & _faces(bones)
    gmsh.model.occ.remove([(3, tag) for tag in bones])
    gmsh.model.occ.synchronize()
    return sorted(gels), bonded


def _at_base(gel):
    """Bonds the plane face farthest along z."""
    gmsh.model.occ.synchronize()
    volumes = [tag for _, tag in gel]
    end = max(gmsh.model.getBoundingBox(3, tag)[5] for tag in volumes)
    return volumes, {face for face in _faces(volumes) if gmsh.model.getBoundingBox(2, face)[2] > end - 1e-3}


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
    return _with_bone(_finger(radius, length, 0), _finger(radius - gel, length, gel))


def _ellipsoid(shape):
    axes = _length(shape, "width_mm") / 2, _length(shape, "height_mm") / 2, _length(shape, "length_mm")
    gel = _length(shape, "gel_mm")
    if gel >= min(axes):
        raise Problem(f"shape.gel_mm is {gel:g}: it must be below half of width and height, and below the length")
    occ, end = gmsh.model.occ, axes[2]

    def half(semi):
        ball = _ball(1, 0)
        occ.dilate([(3, ball)], 0, 0, 0, *semi)
        occ.translate([(3, ball)], 0, 0, end)
        lower = occ.addBox(-2 * axes[0], -2 * axes[1], -end, 4 * axes[0], 4 * axes[1], 2 * end)
        return occ.intersect([(3, ball)], [(3, lower)])[0]

    return _with_bone(half(axes), half([axis - gel for axis in axes]))


def _dome(shape):
    diameter, height = _length(shape, "diameter_mm"), _length(shape, "height_mm")
    if height > diameter / 2:
        raise Problem(f"shape.height_mm is {height:g}: a dome is at most half as high as its diameter")
    radius = (diameter**2 / 4 + height**2) / (2 * height)
    occ = gmsh.model.occ
    ball = _ball(radius, radius)
    slab = occ.addBox(-diameter, -diameter, -1, 2 * diameter, 2 * diameter, 1 + height)
    return _at_base(occ.intersect([(3, ball)], [(3, slab)])[0])


def _block(shape):
    width, height, depth = (_length(shape, key) for key in ("width_mm", "height_mm", "thickness_mm"))
    return _at_base([(3, gmsh.model.occ.addBox(-width / 2, -height / 2, 0, width, height, depth))])


BUILT_IN = {"hemisphere": _hemisphere, "ellipsoid": _ellipsoid, "dome": _dome, "block": _block}


def _solids(path, key):
    """Reads the solids of a STEP or BREP file."""
    if path.suffix.lower() not in (".step", ".stp", ".brep"):
        raise Problem(f"{key}: {path} is none of .step, .brep, .stl: export the body as .step")
    try:
        parts = gmsh.model.occ.importShapes(str(path), highestDimOnly=False)
    except Exception as error:  # gmsh raises this class and ValueError
        raise Problem(f"{key}: {path} cannot be read: {error}") from None
    solids = [part for part in parts if part[0] == 3]
    if not solids:
        gmsh.model.occ.synchronize()
        raise Problem(f"{key}: {path} has faces that enclose no volume: {_hole()}")
    return solids


def _hole():
    """Describes an edge that belongs to one face only."""
    for _, edge in gmsh.model.getEntities(1):
        faces = gmsh.model.getAdjacencies(1, edge)[0]
        if len(faces) == 1:
            box = gmsh.model.getBoundingBox(1, edge)
            middle = ", ".join(f"{(a + b) / 2:.3g}" for a, b in zip(box, box[3:]))
            return f"there is a hole at face {faces[0]}, by its edge at ({middle}) mm. Close it in the CAD program"
    return "export a solid body"


def _from_triangles(paths):
    """The gel from STL; the walls of its cavity that touch the bone are bonded."""
    parts = {key: triangles.read(path, f"shape.{key}") for key, path in paths.items()}
    corners, faces = parts["gel_file"]
    _check_unit(np.ptp(corners, axis=0).max())
    triangles.check(corners, faces, "shape.gel_file")
    volume = triangles.volume(paths["gel_file"])
    return [volume], triangles.touching(_faces([volume]), *parts["bone_file"]) if "bone_file" in parts else set()


def _from_solids(paths):
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    return _with_bone(*(_solids(paths[key], f"shape.{key}") if key in paths else [] for key in ("gel_file", "bone_file")))


def _from_files(shape, folder):
    paths = {key: pathlib.Path(folder, shape[key]) for key in ("gel_file", "bone_file") if key in shape}
    for key, path in paths.items():
        if not path.exists():
            raise Problem(f"shape.{key}: {path} does not exist")
    kinds = {path.suffix.lower() == ".stl" for path in paths.values()}
    if len(kinds) > 1:
        raise Problem("shape.gel_file and shape.bone_file must both be .stl, or both .step or .brep")
    volumes, bonded = (_from_triangles if kinds.pop() else _from_solids)(paths)
    if "bonded_box_mm" in shape:
        low, high = shape["bonded_box_mm"]
        inside = gmsh.model.getEntitiesInBoundingBox(*low, *high, 2)
        bonded |= {tag for _, tag in inside} & _faces(volumes)
    if not bonded:
        raise Problem(
            "no part of the gel is bonded: its faces touch neither shape.bone_file nor lie in shape.bonded_box_mm. "
            "The faces are " + "; ".join(map(_describe, sorted(_faces(volumes))))
        )
    return volumes, bonded


def _describe(face):
    box = [round(value, 1) for value in gmsh.model.getBoundingBox(2, face)]
    return f"{face} from {box[:3]} to {box[3:]} mm"


def _check_extent(volumes):
    gmsh.model.occ.synchronize()
    boxes = [gmsh.model.getBoundingBox(3, tag) for tag in volumes]
    largest = max(max(b - a for a, b in zip(box, box[3:])) for box in boxes)
    _check_unit(largest)


def _check_unit(largest):
    low, high = UNIT_LIMITS_MM
    if not low <= largest <= high:
        raise Problem(
            f"the gel is {largest:.3g} mm large, and gels have {low} to {high}: metres and millimetres were confused. "
            "STEP files are read in their own unit, others as millimetres; export in millimetres"
        )
