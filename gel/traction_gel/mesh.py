"""Tetrahedra of the gel, from gmsh to GetFEM, and triangles of its surface. Lengths in mm."""

import collections
import pathlib
import signal
import tempfile

import getfem
import gmsh
import numpy as np
import scipy.spatial

from . import shapes
from .mechanics import BONDED, FREE
from .problem import Problem

VOLUME = 10  # region of the tetrahedra
GROWTH = 0.2  # of the elements' size with the distance from nodes and markers
CELLS = 48  # of the grid on which sizes are given to gmsh, along the longest side


class Body:
    """The gel's geometry, open in gmsh while the context lasts."""

    def __init__(self, shape, folder):
        self.shape, self.folder = shape, folder

    def __enter__(self):
        gmsh.initialize([], False)
        signal.signal(signal.SIGINT, signal.default_int_handler)  # newer versions of gmsh let it end the process
        gmsh.option.setNumber("General.Terminal", 0)
        for name in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.CharacteristicLength{name}", 0)
        try:
            self.volumes, self.bonded = shapes.build(self.shape, self.folder)
        except BaseException:
            gmsh.finalize()
            raise
        self.faces = {tag for _, tag in gmsh.model.getBoundary([(3, tag) for tag in self.volumes], oriented=False)}
        gmsh.model.addPhysicalGroup(3, self.volumes, VOLUME)
        gmsh.model.addPhysicalGroup(2, sorted(self.bonded), BONDED)
        gmsh.model.addPhysicalGroup(2, sorted(self.faces - self.bonded), FREE)
        return self

    def __exit__(self, *_):
        gmsh.finalize()

    def box(self):
        """Least and largest coordinates of the gel: 2 x 3."""
        boxes = np.array([gmsh.model.getBoundingBox(3, tag) for tag in self.volumes])
        return np.array([boxes[:, :3].min(0), boxes[:, 3:].max(0)])

    def surface(self, size):
        """Triangles of this size [mm]: corners (V x 3), and of the free and of the bonded faces corner numbers (T x 3),
        in an order by which their normals point out of the gel."""
        self._mesh(2, lambda points: np.full(len(points), size))
        numbers, places, _ = gmsh.model.mesh.getNodes()
        index = np.zeros(int(numbers.max()) + 1, int)
        index[numbers.astype(int)] = np.arange(len(numbers))
        corners = places.reshape(-1, 3)

        def triangles(faces):
            parts = [gmsh.model.mesh.getElementsByType(2, face)[1].astype(int) for face in sorted(faces)]
            return index[np.concatenate(parts)].reshape(-1, 3)

        free, bonded = triangles(self.faces - self.bonded), triangles(self.bonded)
        whole = oriented(corners, np.concatenate([free, bonded]))
        return corners, whole[: len(free)], whole[len(free) :]

    def elements(self, size, fine):
        """Tetrahedra with curved sides, as a mesh of GetFEM; of this size at the points `fine` (P x 3) and growing with
        the distance from them."""
        tree = scipy.spatial.cKDTree(fine)
        self._mesh(3, lambda points: size + GROWTH * tree.query(points)[0])
        gmsh.model.mesh.setOrder(2)
        gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
        with tempfile.TemporaryDirectory(prefix="traction-gel-") as folder:
            path = str(pathlib.Path(folder, "gel.msh"))
            gmsh.write(path)
            return getfem.Mesh("import", "gmsh", path)

    def _mesh(self, dimension, size):
        low, high = self.box()
        step = (high - low).max() / CELLS
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
            gmsh.model.mesh.field.setAsBackgroundMesh(field)
            gmsh.model.mesh.clear()
            try:
                gmsh.model.mesh.generate(dimension)
            except Exception as error:  # gmsh raises this class
                raise Problem(f"gmsh cannot mesh the gel: {error}. Does its surface intersect itself?") from None
            finally:
                gmsh.model.mesh.field.remove(field)


def oriented(corners, triangles):
    """Turns the triangles of a closed surface so that their normals point out of the body. Raises a Problem at a hole."""
    result = triangles.copy()
    beside = collections.defaultdict(list)
    for number, triangle in enumerate(triangles.tolist()):
        for one, two in zip(triangle, triangle[1:] + triangle[:1]):
            beside[min(one, two), max(one, two)].append(number)
    for (one, two), sharing in beside.items():
        if len(sharing) != 2:
            place = ", ".join(f"{value:.3g}" for value in (corners[one] + corners[two]) / 2)
            raise Problem(f"the gel's surface is not closed: {len(sharing)} faces meet at ({place}) mm, and not 2")
    shell = np.full(len(triangles), -1)
    for start in range(len(triangles)):
        if shell[start] >= 0:
            continue
        shell[start], waiting = start, [start]
        while waiting:
            number = waiting.pop()
            triangle = result[number].tolist()
            for one, two in zip(triangle, triangle[1:] + triangle[:1]):
                for other in beside[min(one, two), max(one, two)]:
                    if shell[other] >= 0:
                        continue
                    shell[other] = start
                    waiting.append(other)
                    there = result[other].tolist()
                    if (one, two) in zip(there, there[1:] + there[:1]):  # the same way round: turned
                        result[other] = result[other][::-1]
    a, b, c = corners[result].transpose(1, 0, 2)
    volumes = np.bincount(shell, (a * np.cross(b, c)).sum(1) / 6)
    outermost = abs(volumes).argmax()
    outward = (volumes > 0) == (np.arange(len(volumes)) == outermost)  # a cavity's volume counts as negative
    return np.where(outward[shell][:, None], result, result[:, ::-1])
