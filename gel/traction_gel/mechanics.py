"""Displacements of markers under forces on the surface of a gel, by finite elements and reciprocity.

By the theorem of Maxwell and Betti, a marker moves along c by as much under a force along a at a node as the node moves
along a under the same force along c at the marker. A force at a marker has Kelvin's closed form in an infinite body,
which is singular at the marker; the elements compute the rest, which is smooth: the free surface carries minus Kelvin's
traction, the bonded one moves by minus Kelvin's displacement. docs/decisions/0054-traction-gel.md has the measurements.

Of several materials, Kelvin's field is that of the marker's, and it ends where that material ends: there its traction acts
on the other as on nothing, and its displacement is a step, which the rest takes back. A force at a marker that is too near
to the other material is left to the elements. docs/decisions/0061-several-materials.md has why and the measurements.

Elements are tetrahedra with cubic displacements. The resistance to a change of volume is integrated at four points of
each: with full integration, nearly incompressible silicone is too stiff. Lengths are in the mesh's unit.
"""

import getfem
import numpy as np
import scipy.sparse
import scipy.spatial

from .cholesky import Factor

BONDED, FREE, VOLUME = 1, 2, 10  # regions of the GetFEM mesh; VOLUME + k is filled by material k
LOADED, HELD = 1000, 2000  # + k: faces of material k that are not bonded, or not free
ORDER = 3  # of the displacements
TRACTION_DEGREE = 4  # of the polynomials by which Kelvin's stress is given to the elements
BATCH = 48  # right-hand sides at a time
NEAR = 0.5  # of an element's size: where Kelvin's traction on the next material is too steep for the elements


def kelvin(offsets, young, poisson):
    """Displacement at `offsets` (P x 3) from a unit force in an infinite body: P x 3 x 3, last axis the force."""
    r = np.linalg.norm(offsets, axis=1)[:, None, None]
    along = offsets / r[:, 0]
    scale = (1 + poisson) / (8 * np.pi * young * (1 - poisson))
    return scale / r * ((3 - 4 * poisson) * np.eye(3) + along[:, :, None] * along[:, None, :])


def kelvin_stress(offsets, poisson):
    """Stress of the same: P x 3 x 3 x 3, last axis the force."""
    r = np.linalg.norm(offsets, axis=1)
    along, one = offsets / r[:, None], np.eye(3)
    turned = np.einsum("pj,ia->pija", along, one)
    bend = turned + turned.transpose(0, 2, 1, 3) - np.einsum("pa,ij->pija", along, one)
    stress = 3 * np.einsum("pi,pj,pa->pija", along, along, along) + (1 - 2 * poisson) * bend
    return stress * (-1 / (8 * np.pi * (1 - poisson) * r**2))[:, None, None, None]


def _sparse(matrix):
    begins, rows = matrix.csc_ind()
    return scipy.sparse.csc_matrix((matrix.csc_val(), rows, begins), shape=matrix.size())


class Part:
    """What one material of the gel fills, and what Kelvin's field about a marker in it does to the unknowns."""

    def __init__(self, mesh, number, material, field, scalar):
        self.young, self.poisson = material
        self.field, self.region = field, VOLUME + number
        self.stiffness = self._stiffness(mesh)
        outer = mesh.outer_faces(mesh.region(self.region)[0])
        for region, without in ((LOADED, BONDED), (HELD, FREE)):
            mesh.set_region(region + number, outer)
            mesh.region_subtract(region + number, without)
        self.held = field.basic_dof_on_region(HELD + number)
        self.coupling = self.stiffness[:, self.held].tocsr()
        self.held_points = field.basic_dof_nodes()[:, self.held[::3]].T
        self._prepare_tractions(mesh, LOADED + number, scalar)

    def _stiffness(self, mesh):
        shear = self.young / (2 * (1 + self.poisson))
        bulk = self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))
        unknown = ("u", 1, self.field, np.zeros(self.field.nbdof()), "c", 0)
        parts = ((5, "c*(Grad_u+Grad_u'):Grad_Test_u", shear), (2, "c*Div_u*Div_Test_u", bulk))
        return sum(
            _sparse(getfem.asm_generic(rule(mesh, degree), 2, form, self.region, *unknown, np.array([value])))
            for degree, form, value in parts
        ).tocsc()

    def _prepare_tractions(self, mesh, region, scalar):
        """Makes the matrices that turn stress at points of the surface into forces on the unknowns."""
        data = getfem.MeshFem(mesh, 1)
        data.set_fem(getfem.Fem(f"FEM_PK(3,{TRACTION_DEGREE})"), np.unique(mesh.region(region)[0]))
        variables = ("q", 1, scalar, np.zeros(scalar.nbdof()), "s", 1, data, np.zeros(data.nbdof()))
        normal = [
            _sparse(
                getfem.asm_generic(
                    rule(mesh, 6), 2, f"Test2_s*Normal({k})*Test_q", region, *variables, "select_output", "q", "s"
                )
            )
            for k in (1, 2, 3)
        ]
        used = np.flatnonzero(np.diff(sum(abs(part) for part in normal).tocsc().indptr))
        self.stress_points = data.basic_dof_nodes()[:, used].T
        self.normal = [part[:, used].tocsr() for part in normal]

    def field_about(self, marker, points):
        """Kelvin's displacement at points: P x 3 x 3, last axis the force."""
        return kelvin(points - marker, self.young, self.poisson)

    def load(self, marker):
        """Returns the forces on the unknowns (unknowns x 3) that make up for Kelvin's field about a marker, and that field
        where the material is held."""
        stress = kelvin_stress(self.stress_points - marker, self.poisson)
        force = -sum(self.normal[k] @ stress[:, :, k].reshape(-1, 9) for k in range(3)).reshape(-1, 3)
        held = self.field_about(marker, self.held_points).reshape(-1, 3)
        return force + self.coupling @ held, held

    def touched(self):
        """Unknowns that load() may give a force: a matrix whose non-empty rows they are."""
        surface = scipy.sparse.kron(sum(abs(part) for part in self.normal), np.ones((3, 1)))
        return scipy.sparse.hstack([surface, abs(self.coupling)]).tocsr()


class Gel:
    """A meshed gel. Linear mechanics scale with the moduli, of which only ratios need be known."""

    def __init__(self, mesh, materials):
        """\\param mesh of GetFEM, whose regions BONDED and FREE are its whole surface, and VOLUME + k its parts
        \\param materials of each part: Young's modulus, as a multiple of one of them, and Poisson's ratio
        """
        field, scalar, self.place = (getfem.MeshFem(mesh, size) for size in (3, 1, 1))
        for each, order in ((field, ORDER), (scalar, ORDER), (self.place, 0)):
            each.set_fem(getfem.Fem(f"FEM_PK(3,{order})"))
        self.field, self.unknowns = field, field.nbdof()
        self.parts = [Part(mesh, number, material, field, scalar) for number, material in enumerate(materials)]
        self.size_of_place = np.cbrt(6 * np.sqrt(2) * mesh.convex_area())  # edges of a regular tetrahedron
        self.part_of_place = np.zeros(self.place.nbdof(), int)
        for number in range(len(materials)):
            self.part_of_place[self.place.basic_dof_on_region(VOLUME + number)] = number
        held = np.bincount(np.concatenate([part.held for part in self.parts]), minlength=self.unknowns)
        self.between = field.basic_dof_nodes()[:, np.flatnonzero(held > 1)[::3]].T  # points of two materials
        is_bonded = np.zeros(self.unknowns, bool)
        is_bonded[field.basic_dof_on_region(BONDED)] = True
        self.moving = np.flatnonzero(~is_bonded)
        self.factor = Factor(sum(part.stiffness for part in self.parts)[self.moving][:, self.moving])

    def places(self, points):
        """Returns the unknown of `place` that is each point's, one for each element."""
        return _sparse(getfem.asm_extrapolation_matrix(self.place, np.ascontiguousarray(points.T))).tocsr().indices

    def left_to_elements(self, markers):
        """Returns of each marker whether another material is too near for Kelvin's field."""
        if not len(self.between):
            return np.zeros(len(markers), bool)
        distance = scipy.spatial.cKDTree(self.between).query(markers)[0]
        return distance < NEAR * self.size_of_place[self.places(markers)]

    def at(self, points):
        """Returns the matrix of displacements at points: 3P x unknowns."""
        return _sparse(getfem.asm_extrapolation_matrix(self.field, np.ascontiguousarray(points.T))).tocsr()

    def influence(self, markers, points, weights, progress=lambda part: None):
        """Returns the displacement of each marker for a unit force at each node, M x 3 x N x 3, times the modulus
        [1 / unit of length].

        \\param points P x 3, of the surface
        \\param weights N x P, sparse: how the force of a node is spread over the points; a row's sum is 1
        \\param progress is called with the part that is done, 0 to 1
        """
        values, spread = self.at(points), scipy.sparse.kron(weights, scipy.sparse.eye(3)).tocsr()
        mean = (spread @ values).tocsc()[:, self.moving]
        count, nodes = len(markers), weights.shape[0]
        found = np.zeros((3 * nodes, 3 * count))
        plain, own = self.left_to_elements(markers), self.at(markers)
        by_nodes = nodes <= count
        if by_nodes:
            touched = scipy.sparse.hstack([own[np.repeat(plain, 3)].T, *(part.touched() for part in self.parts)]).tocsr()
            reach = np.flatnonzero(np.diff(touched[self.moving].indptr))
            answers = np.empty((3 * nodes, len(reach)))
            for first in range(0, 3 * nodes, BATCH):
                right = mean[first : first + BATCH].T.toarray()
                answers[first : first + BATCH] = self.factor.solve(right)[reach].T
                progress(0.8 * first / (3 * nodes))
        among, of_marker = (self.part_of_place[self.places(each)] for each in (points, markers))
        within = [scipy.sparse.diags(np.repeat(among == number, 3).astype(float)) for number in range(len(self.parts))]
        steps = [spread @ here @ values[:, part.held] for here, part in zip(within, self.parts)]
        closed = [spread @ here for here in within]
        for first in range(0, count, BATCH // 3):
            forces = []
            for marker in range(first, min(first + BATCH // 3, count)):
                columns = slice(3 * marker, 3 * marker + 3)
                if plain[marker]:
                    forces.append(own[columns].T.toarray())
                    continue
                number = of_marker[marker]
                part = self.parts[number]
                force, held = part.load(markers[marker])
                forces.append(force)
                near = part.field_about(markers[marker], points).reshape(-1, 3)
                found[:, columns] = closed[number] @ near - steps[number] @ held
            right = np.hstack(forces)[self.moving]
            columns = slice(3 * first, 3 * first + right.shape[1])
            found[:, columns] += answers @ right[reach] if by_nodes else mean @ self.factor.solve(right)
            progress(0.8 + 0.2 * first / count if by_nodes else first / count)
        return found.reshape(nodes, 3, count, 3).transpose(2, 3, 0, 1)


def rule(mesh, degree):
    """Integration of polynomials of this degree: GetFEM has 1, 2, 3, 5, 6 and 8."""
    return getfem.MeshIm(mesh, getfem.Integ(f"IM_TETRAHEDRON({degree})"))
