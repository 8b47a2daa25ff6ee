"""Tetrahedra of the gel, from gmsh to GetFEM, and triangles of its surface. Lengths in mm."""

import itertools
import pathlib
import signal
import tempfile

import getfem
import gmsh
import numpy as np
import scipy.spatial

from . import shapes, triangles
from .mechanics import BONDED, FREE, VOLUME
from .problem import Problem

GROWTH = 0.2  # of the elements' size with the distance from nodes and markers
SMALLER = 0.7  # the largest element, where curved ones are inside out
TETRAHEDRON = 11  # gmsh's number of those with 10 nodes
# Corners, middles of edges and the middle of a tetrahedron, where curved sides may have turned it inside out.
WITHIN = np.array([*itertools.product((0, 0.5, 1), repeat=3), (0.25, 0.25, 0.25)])
WITHIN = WITHIN[WITHIN.sum(1) <= 1].ravel()
CELLS = 48  # of the grid on which sizes are given to gmsh, along the longest side


class Body:
    """The gel's geometry, open in gmsh while the context lasts."""

    def __init__(self, shape, folder, materials=()):
        self.shape, self.folder, self.materials = shape, folder, materials

    def __enter__(self):
        gmsh.initialize([], False)
        signal.signal(signal.SIGINT, signal.default_int_handler)  # newer versions of gmsh let it end the process
        gmsh.option.setNumber("General.Terminal", 0)
        for name in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.CharacteristicLength{name}", 0)
        try:
            self._build()
        except BaseException:
            gmsh.finalize()
            raise
        return self

    def _build(self):
        """Makes the model anew, which is all that takes every mesh away: triangles of a file are geometry and mesh."""
        gmsh.clear()
        self.parts, self.bonded = shapes.build(self.shape, self.materials, self.folder)
        self.volumes = sum(self.parts, [])
        self.faces = shapes.faces(self.volumes)
        self.between = set().union(*map(shapes.faces, self.parts)) - self.faces
        for number, part in enumerate(self.parts):
            gmsh.model.addPhysicalGroup(3, part, VOLUME + number)
        gmsh.model.addPhysicalGroup(2, sorted(self.bonded), BONDED)
        gmsh.model.addPhysicalGroup(2, sorted(self.faces - self.bonded), FREE)

    def __exit__(self, *_):
        gmsh.finalize()

    def box(self):
        """Least and largest coordinates of the gel: 2 x 3."""
        boxes = np.array([gmsh.model.getBoundingBox(3, tag) for tag in self.volumes])
        return np.array([boxes[:, :3].min(0), boxes[:, 3:].max(0)])

    def surface(self, size):
        """Triangles of this size [mm]: corners (V x 3), and of the free and of the bonded faces corner numbers (T x 3),
        in an order by which their normals point out of the gel; those between materials in any order."""
        self._mesh(2, lambda points: np.full(len(points), size))
        numbers, places, _ = gmsh.model.mesh.getNodes()
        index = np.zeros(int(numbers.max()) + 1, int)
        index[numbers.astype(int)] = np.arange(len(numbers))
        corners = places.reshape(-1, 3)

        def numbered(faces):
            parts = [gmsh.model.mesh.getElementsByType(2, face)[1].astype(int) for face in sorted(faces)]
            return index[np.concatenate([np.zeros(0, int), *parts])].reshape(-1, 3)

        free, bonded, between = map(numbered, (self.faces - self.bonded, self.bonded, self.between))
        whole = triangles.oriented(corners, np.concatenate([free, bonded]))
        return corners, whole[: len(free)], whole[len(free) :], between

    def elements(self, size, fine):
        """Tetrahedra with curved sides, as a mesh of GetFEM; of this size at the points `fine` (P x 3) and growing with
        the distance from them."""
        self._curved(size, fine)
        gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
        with tempfile.TemporaryDirectory(prefix="traction-gel-") as folder:
            path = str(pathlib.Path(folder, "gel.msh"))
            gmsh.write(path)
            return getfem.Mesh("import", "gmsh", path)

    def _curved(self, size, fine):
        """Makes elements with curved sides; smaller ones where those in a thin skin would be inside out."""
        tree = scipy.spatial.cKDTree(fine)
        most = size + GROWTH * tree.query(self.box())[0].max()
        for _ in range(6):
            try:
                self._mesh(3, lambda points, most=most: np.minimum(size + GROWTH * tree.query(points)[0], most))
            except Problem as problem:
                failed = problem
            else:
                gmsh.model.mesh.setOrder(2)
                if gmsh.model.mesh.getJacobians(TETRAHEDRON, WITHIN)[1].min() > 0:
                    return
                failed = Problem("gmsh cannot mesh the gel: a skin, or another part, is too thin for its curvature")
            most *= SMALLER
        raise failed

    def with_bone_at(self, mesh, offset):
        """Returns a copy of tetrahedra whose bonded surface is moved by `offset`; the free one stays where it is."""
        moved = getfem.Mesh("clone", mesh)
        points = mesh.pts().T
        on = [np.unique(mesh.pid_in_regions(region)) for region in (FREE, BONDED)]
        far = [scipy.spatial.cKDTree(points[each]).query(points)[0] for each in on]
        part = far[0] / np.maximum(far[0] + far[1], 1e-9)
        part[on[1]] = 1
        moved.set_pts((points + part[:, None] * offset).T)
        return moved

    def _mesh(self, dimension, size):
        self._build()
        low, high = self.box()
        step = float((high - low).max() / CELLS)  # whose repr() is a number in every NumPy
        counts = np.ceil((high - low) / step).astype(int) + 3
        axes = [start - step + step * np.arange(count) for start, count in zip(low, counts)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        with tempfile.TemporaryDirectory(prefix="traction-gel-") as folder:
            path = pathlib.Path(folder, "sizes")
            head = [" ".join(map(repr, map(float, low - step))), f"{step!r} {step!r} {step!r}", "%d %d %d" % tuple(counts)]
            path.write_text("\n".join(head + [f"{value:.6g}" for value in size(points)]) + "\n")
            field = gmsh.model.mesh.field.add("Structured")
            gmsh.model.mesh.field.setString(field, "FileName", str(path))
            gmsh.model.mesh.field.setNumber(field, "TextFormat", 1)
            gmsh.model.mesh.field.setNumber(field, "SetOutsideValue", 0)  # gmsh 4.8 leaves it uninitialised
            gmsh.model.mesh.field.setAsBackgroundMesh(field)
            try:
                gmsh.model.mesh.generate(dimension)
            except Exception as error:  # gmsh raises this class
                raise Problem(f"gmsh cannot mesh the gel: {error}. Does its surface intersect itself?") from None
            finally:
                gmsh.model.mesh.field.remove(field)
