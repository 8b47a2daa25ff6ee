"""Tetrahedra of the gel, from gmsh to GetFEM, and triangles of its surface. Lengths in mm."""

import contextlib
import itertools
import pathlib
import signal
import tempfile

import getfem
import gmsh
import numpy as np
import scipy.sparse
import scipy.spatial

from . import shapes, triangles
from .mechanics import BONDED, FREE, VOLUME
from .problem import Problem

GROWTH = 0.2  # of the elements' size with the distance from nodes and markers
SMALLER = 0.7  # the largest element, where curved ones are inside out
TETRAHEDRON, TRIANGLE, BRICK = 11, 9, 17  # gmsh's numbers of kinds of elements, with 10, 6 and 20 nodes
# Corners, middles of edges and the middle of a tetrahedron, where curved sides may have turned it inside out.
WITHIN = np.array([*itertools.product((0, 0.5, 1), repeat=3), (0.25, 0.25, 0.25)])
WITHIN = WITHIN[WITHIN.sum(1) <= 1].ravel()
# A brick's, in CalculiX's order.
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
TO_CALCULIX = [*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]  # from gmsh's order of a brick's nodes
OCTANTS = np.array([*itertools.product((-1, 1), repeat=3)])
REGULAR = 1 / (6 * 2**0.5)  # volume of a tetrahedron with edges of 1
CELLS = 48  # of the grid on which sizes are given to gmsh, along the longest side


@contextlib.contextmanager
def session():
    """gmsh with an empty model, which says nothing and sizes elements by what it is given."""
    _initialize()
    try:
        yield
    finally:
        gmsh.finalize()


def _initialize():
    gmsh.initialize([], False)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # newer versions of gmsh let it end the process
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    for name in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.CharacteristicLength{name}", 0)


class Body:
    """The gel's geometry, open in gmsh while the context lasts."""

    def __init__(self, shape, folder, materials=()):
        self.shape, self.folder, self.materials = shape, folder, materials

    def __enter__(self):
        with contextlib.ExitStack() as stack:
            stack.enter_context(session())
            self._build()
            self._left = stack.pop_all()
        return self

    def _build(self):
        """Makes the model anew, which is all that takes every mesh away: triangles of a file are geometry and mesh."""
        gmsh.clear()
        self.parts, self.bonded, self.bone = shapes.build(self.shape, self.materials, self.folder)
        self.volumes = sum(self.parts, [])
        self.faces = shapes.faces(self.volumes)
        self.between = set().union(*map(shapes.faces, self.parts)) - self.faces
        for number, part in enumerate(self.parts):
            gmsh.model.addPhysicalGroup(3, part, VOLUME + number)
        gmsh.model.addPhysicalGroup(2, sorted(self.bonded), BONDED)
        gmsh.model.addPhysicalGroup(2, sorted(self.faces - self.bonded), FREE)

    def __exit__(self, *_):
        self._left.close()

    def box(self):
        """Least and largest coordinates of the gel: 2 x 3."""
        return shapes.extent(3, self.volumes)

    def surface(self, size):
        """Triangles of this size [mm]: corners (V x 3), and of the free and of the bonded faces corner numbers (T x 3),
        in an order by which their normals point out of the gel; those between materials in any order. `sides` has the
        material of each free triangle, and the triangles of the bone that are not bonded, in any order; `filled` is the part of
        the gel's box that is gel."""
        self._mesh(2, lambda points: np.full(len(points), size))
        numbers, places, _ = gmsh.model.mesh.getNodes()
        index = np.zeros(int(numbers.max()) + 1, int)
        index[numbers.astype(int)] = np.arange(len(numbers))
        corners = places.reshape(-1, 3)

        def numbered(faces):
            parts = [gmsh.model.mesh.getElementsByType(2, face)[1].astype(int) for face in sorted(faces)]
            return index[np.concatenate([np.zeros(0, int), *parts])].reshape(-1, 3)

        each = [numbered(shapes.faces(part) & self.faces - self.bonded) for part in self.parts]
        free, bonded, between = np.concatenate(each), numbered(self.bonded), numbered(self.between)
        whole = triangles.oriented(corners, np.concatenate([free, bonded]))
        a, b, c = corners[whole].transpose(1, 0, 2)
        self.filled = (a * np.cross(b, c)).sum() / 6 / np.ptp(self.box(), axis=0).prod()
        self.sides = np.repeat(np.arange(len(each)), list(map(len, each))), numbered(self.bone)
        return corners, whole[: len(free)], whole[len(free) :], between

    def expected(self, size, fine, most):
        """Returns about how many tetrahedra elements() would make after surface(), or more than `most`, without making them:
        cubes in the gel's box are halved until they are as small as the elements there."""
        low, high = self.box()
        edge, tree, count = float((high - low).max()), scipy.spatial.cKDTree(fine), 0.0
        middles = (low + high)[None] / 2
        while 0 < len(middles) and count + len(middles) <= most:
            wanted = size + GROWTH * tree.query(middles)[0]
            small = edge <= wanted
            count += ((edge / wanted[small]) ** 3).sum() * self.filled / REGULAR
            edge, middles = edge / 2, (middles[~small, None] + edge / 4 * OCTANTS).reshape(-1, 3)
            middles = middles[((middles > low - edge / 2) & (middles < high + edge / 2)).all(1)]
        return count + len(middles)

    def elements(self, size, fine):
        """Tetrahedra with curved sides, as a mesh of GetFEM; of this size at the points `fine` (P x 3) and growing with
        the distance from them."""
        self._curved(size, fine)
        gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
        with tempfile.TemporaryDirectory(prefix="traction-gel-") as folder:
            path = str(pathlib.Path(folder, "gel.msh"))
            gmsh.write(path)
            return getfem.Mesh("import", "gmsh", path)

    def bricks(self, size, fine):
        """The gel in bricks of 20 nodes: tetrahedra as of elements(), each cut into four."""
        self._curved(size, fine)
        return Bricks(self.parts, self.bonded)

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
                failed = Problem("gmsh cannot mesh the gel: a skin, a cavity or another part is too small for its curvature")
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
                gmsh.finalize()
                _initialize()  # else gmsh 4.8 meshes nothing any more, and says nothing
                raise Problem(f"gmsh cannot mesh the gel: {error}. Does its surface intersect itself?") from None


def _cut():
    """A tetrahedron cut into four bricks: 24 times the barycentric coordinates of their nodes, 4 x 20 x 4."""
    bricks = []
    for corner, one, two, three in ((0, 1, 2, 3), (1, 0, 3, 2), (2, 0, 1, 3), (3, 0, 2, 1)):
        sets = [(), (one,), (one, two), (two,), (three,), (one, three), (one, two, three), (two, three)]
        corners = np.zeros((8, 4), int)
        for row, others in zip(corners, sets):
            row[[corner, *others]] = 24 // (1 + len(others))
        bricks.append(np.concatenate([corners, [(corners[a] + corners[b]) // 2 for a, b in EDGES]]))
    return np.array(bricks)


CUT = _cut()


class Bricks:
    """The tetrahedra of gmsh's current model, each cut into four bricks of 20 nodes: positions (P x 3), of each material the
    nodes of its bricks (from 0, in the order of CalculiX), and whether a node is bonded (P)."""

    def __init__(self, parts, bonded):
        numbers, places, _ = gmsh.model.mesh.getNodes()
        index = np.zeros(int(numbers.max()) + 1, int)
        index[numbers.astype(int)] = np.arange(len(numbers))

        def elements(kind, tags, count):
            found = [gmsh.model.mesh.getElementsByType(kind, tag) for tag in tags]
            tags, nodes = (np.concatenate(each).astype(int) for each in zip(*found))
            return tags, index[nodes].reshape(-1, count)

        cut = CUT.reshape(-1, 4)
        shape = gmsh.model.mesh.getBasisFunctions(TETRAHEDRON, (cut[:, 1:] / 24).ravel(), "Lagrange")[1].reshape(-1, 10)
        mark = np.random.default_rng(0).integers(2**60, size=len(numbers))  # sums of these tell nodes of bricks apart
        found = [elements(TETRAHEDRON, part, 10) for part in parts]
        self.tags, whole = map(np.concatenate, zip(*found))
        keys, first, same = np.unique(mark[whole[:, :4]] @ cut.T, return_index=True, return_inverse=True)
        self.positions = np.einsum("kn,tnc->tkc", shape, places.reshape(-1, 3)[whole]).reshape(-1, 3)[first]
        self.nodes = same.reshape(-1, 20)
        self.parts = np.split(self.nodes, 4 * np.cumsum([len(tags) for tags, _ in found])[:-1])
        on_face = cut[cut[:, 3] == 0, :3]
        self.bonded = np.isin(keys, mark[elements(TRIANGLE, sorted(bonded), 6)[1][:, :3]] @ on_face.T)

    def weights(self, points):
        """Returns the matrix of the bricks' shape functions at points, P x nodes; as long as the model is there."""
        row = dict(zip(self.tags.tolist(), range(len(self.tags))))
        shapes_at, nodes = [], []
        for point in points:
            tag, _, _, *local = gmsh.model.mesh.getElementByCoordinates(*point, 3)
            target = np.array([1 - sum(local), *local])
            brick = int(target.argmax())
            inside = np.zeros(3)  # of the brick
            for _ in range(6):  # Newton
                slope = gmsh.model.mesh.getBasisFunctions(BRICK, inside, "GradLagrange")[1].reshape(20, 3)[TO_CALCULIX]
                shape = gmsh.model.mesh.getBasisFunctions(BRICK, inside, "Lagrange")[1][TO_CALCULIX]
                corners = CUT[brick] / 24
                inside = inside - np.linalg.lstsq(corners.T @ slope, corners.T @ shape - target, rcond=None)[0]
            shapes_at.append(gmsh.model.mesh.getBasisFunctions(BRICK, inside, "Lagrange")[1][TO_CALCULIX])
            nodes.append(self.nodes[4 * row[tag] + brick])
        ends = np.arange(len(points) + 1) * 20
        values = np.concatenate(shapes_at), np.concatenate(nodes), ends
        return scipy.sparse.csr_matrix(values, (len(points), len(self.positions)))
