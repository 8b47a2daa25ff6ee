"""Displacements of markers under forces on the surface of a gel, by finite elements and reciprocity.

By the theorem of Maxwell and Betti, a marker moves along c by as much under a force along a at a node as the node moves
along a under the same force along c at the marker. A force at a marker has Kelvin's closed form in an infinite body,
which is singular at the marker; the elements compute the rest, which is smooth: the free surface carries minus Kelvin's
traction, the bonded one moves by minus Kelvin's displacement. docs/decisions/0054-traction-gel.md has the measurements.

Elements are tetrahedra with cubic displacements. The resistance to a change of volume is integrated at four points of
each: with full integration, nearly incompressible silicone is too stiff. Lengths are in the mesh's unit.
"""

import getfem
import numpy as np
import scipy.sparse

from .cholesky import Factor

BONDED, FREE = 1, 2  # regions of the GetFEM mesh
ORDER = 3  # of the displacements
TRACTION_DEGREE = 4  # of the polynomials by which Kelvin's stress is given to the elements
BATCH = 48  # right-hand sides at a time


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


class Gel:
    """A meshed gel of one material. The modulus is 1: linear mechanics scale with it."""

    def __init__(self, mesh, poisson):
        """\\param mesh of GetFEM, whose regions BONDED and FREE are its whole surface."""
        self.poisson = poisson
        field, scalar = getfem.MeshFem(mesh, 3), getfem.MeshFem(mesh, 1)
        for each in (field, scalar):
            each.set_fem(getfem.Fem(f"FEM_PK(3,{ORDER})"))
        self.field, self.unknowns = field, field.nbdof()
        self.stiffness = self._stiffness(mesh)
        is_bonded = np.zeros(self.unknowns, bool)
        is_bonded[field.basic_dof_on_region(BONDED)] = True
        self.bonded, self.moving = np.flatnonzero(is_bonded), np.flatnonzero(~is_bonded)
        self.bonded_points = field.basic_dof_nodes()[:, self.bonded[::3]].T
        self._prepare_tractions(mesh, scalar)
        self.held = self.stiffness[self.moving][:, self.bonded]
        self.factor = Factor(self.stiffness[self.moving][:, self.moving])

    def _stiffness(self, mesh):
        shear = 1 / (2 * (1 + self.poisson))
        bulk = self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))
        unknown = ("u", 1, self.field, np.zeros(self.unknowns), "c", 0)
        parts = ((5, "c*(Grad_u+Grad_u'):Grad_Test_u", shear), (2, "c*Div_u*Div_Test_u", bulk))
        return sum(
            _sparse(getfem.asm_generic(rule(mesh, degree), 2, form, -1, *unknown, np.array([value])))
            for degree, form, value in parts
        ).tocsc()

    def _prepare_tractions(self, mesh, scalar):
        """Makes the matrices that turn stress at points of the free surface into forces on the unknowns."""
        data = getfem.MeshFem(mesh, 1)
        data.set_fem(getfem.Fem(f"FEM_PK(3,{TRACTION_DEGREE})"), np.unique(mesh.region(FREE)[0]))
        variables = ("q", 1, scalar, np.zeros(scalar.nbdof()), "s", 1, data, np.zeros(data.nbdof()))
        normal = [
            _sparse(
                getfem.asm_generic(
                    rule(mesh, 6), 2, f"Test2_s*Normal({k})*Test_q", FREE, *variables, "select_output", "q", "s"
                )
            )
            for k in (1, 2, 3)
        ]
        used = np.flatnonzero(np.diff(sum(abs(part) for part in normal).tocsc().indptr))
        self.stress_points = data.basic_dof_nodes()[:, used].T
        self.normal = [part[:, used].tocsr() for part in normal]

    def load(self, marker):
        """Returns the forces on the moving unknowns (unknowns x 3) that make up for Kelvin's field about a marker."""
        stress = kelvin_stress(self.stress_points - marker, self.poisson)
        force = -sum(self.normal[k] @ stress[:, :, k].reshape(-1, 9) for k in range(3))
        moved = -kelvin(self.bonded_points - marker, 1, self.poisson).reshape(-1, 3)
        return force.reshape(-1, 3)[self.moving] - self.held @ moved

    def at(self, points, weights):
        """Returns the matrix of weighted means of displacements: 3N x unknowns. `points`: P x 3, `weights`: N x P."""
        values = _sparse(getfem.asm_extrapolation_matrix(self.field, np.ascontiguousarray(points.T)))
        return (scipy.sparse.kron(weights, scipy.sparse.eye(3)) @ values).tocsc()

    def influence(self, markers, points, weights, progress=lambda part: None):
        """Returns the displacement of each marker for a unit force at each node, M x 3 x N x 3, times the modulus
        [1 / unit of length].

        \\param points P x 3, of the surface
        \\param weights N x P, sparse: how the force of a node is spread over the points; a row's sum is 1
        \\param progress is called with the part that is done, 0 to 1
        """
        mean = self.at(points, weights)[:, self.moving]
        count, nodes = len(markers), weights.shape[0]
        rest = np.empty((3 * nodes, 3 * count))
        by_nodes = nodes <= count
        if by_nodes:
            reach = np.flatnonzero(np.diff(self._touched().indptr))
            answers = np.empty((3 * nodes, len(reach)))
            for first in range(0, 3 * nodes, BATCH):
                right = mean[first : first + BATCH].T.toarray()
                answers[first : first + BATCH] = self.factor.solve(right)[reach].T
                progress(0.8 * first / (3 * nodes))
        for first in range(0, count, BATCH // 3):
            some = markers[first : first + BATCH // 3]
            right = np.hstack([self.load(marker) for marker in some])
            columns = slice(3 * first, 3 * first + 3 * len(some))
            rest[:, columns] = answers @ right[reach] if by_nodes else mean @ self.factor.solve(right)
            progress(0.8 + 0.2 * first / count if by_nodes else first / count)
        closed = np.stack([weights @ kelvin(points - marker, 1, self.poisson).reshape(-1, 9) for marker in markers])
        whole = closed.reshape(count, nodes, 3, 3) + rest.reshape(nodes, 3, count, 3).transpose(2, 0, 1, 3)
        return whole.transpose(0, 3, 1, 2)

    def _touched(self):
        """Moving unknowns that load() may give a force, as the non-empty rows of a matrix."""
        surface = scipy.sparse.kron(sum(abs(part) for part in self.normal), np.ones((3, 1))).tocsr()
        return scipy.sparse.hstack([surface[self.moving], abs(self.held)]).tocsr()


def rule(mesh, degree):
    """Integration of polynomials of this degree: GetFEM has 1, 2, 3, 5, 6 and 8."""
    return getfem.MeshIm(mesh, getfem.Integ(f"IM_TETRAHEDRON({degree})"))
