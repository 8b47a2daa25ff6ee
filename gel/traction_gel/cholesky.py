"""Factorises a sparse symmetric matrix once and solves for many right-hand sides, by CHOLMOD of SuiteSparse.

Debian has no Python package for CHOLMOD, and GetFEM's own solvers factorise anew for each right-hand side. The calls
are those of CHOLMOD's documented C interface, which are the same in versions 3 to 5.
"""

import contextlib
import ctypes
import ctypes.util
import signal

import numpy as np
import scipy.sparse

_LONG, _REAL, _LOWER = 2, 1, -1
_WORKSPACE_BYTES = 1 << 16  # cholmod_common has some 3 KiB, and no call tells how many


class _Sparse(ctypes.Structure):
    _fields_ = (
        [(name, ctypes.c_size_t) for name in ("nrow", "ncol", "nzmax")]
        + [(name, ctypes.c_void_p) for name in ("p", "i", "nz", "x", "z")]
        + [(name, ctypes.c_int) for name in ("stype", "itype", "xtype", "dtype", "sorted", "packed")]
    )


class _Dense(ctypes.Structure):
    _fields_ = (
        [(name, ctypes.c_size_t) for name in ("nrow", "ncol", "nzmax", "d")]
        + [(name, ctypes.c_void_p) for name in ("x", "z")]
        + [(name, ctypes.c_int) for name in ("xtype", "dtype")]
    )


@contextlib.contextmanager
def ctrl_c_ends_at_once():
    """Lets Ctrl-C end the process inside a long call of a C library, where Python does not see it. Use it in the main
    thread, and only where no temporary file exists."""
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class Factor:
    """The Cholesky factor of a symmetric, positive definite matrix. Raises ArithmeticError if it is not, MemoryError
    if there is too little memory."""

    def __init__(self, matrix):
        name = ctypes.util.find_library("cholmod")
        if name is None:
            raise ImportError("CHOLMOD is missing: install libcholmod3 (Debian 12) or libcholmod5")
        self._library = ctypes.CDLL(name)
        for call in ("analyze", "solve"):
            getattr(self._library, f"cholmod_l_{call}").restype = ctypes.c_void_p
        self._common = ctypes.create_string_buffer(_WORKSPACE_BYTES)
        self._library.cholmod_l_start(self._common)
        lower = scipy.sparse.tril(matrix, format="csc")
        lower.sort_indices()
        arrays = lower.indptr.astype(np.int64), lower.indices.astype(np.int64), lower.data.astype(float)
        begins, rows, values = (array.ctypes.data for array in arrays)
        size = lower.shape[0]
        given = _Sparse(size, size, lower.nnz, begins, rows, None, values, None, _LOWER, _LONG, _REAL, 0, 1, 1)
        with ctrl_c_ends_at_once():
            self._factor = ctypes.c_void_p(self._library.cholmod_l_analyze(ctypes.byref(given), self._common))
            done = self._factor and self._library.cholmod_l_factorize(ctypes.byref(given), self._factor, self._common)
        if not done:
            raise MemoryError("the stiffness matrix could not be factorised: too little memory; ask for a larger error")
        if ctypes.cast(self._factor, ctypes.POINTER(ctypes.c_size_t))[1] != size:  # the column that is not positive
            raise ArithmeticError("the stiffness matrix is not positive definite: no part of the gel is bonded")

    def solve(self, right):
        """Returns the solution for each column of `right` (size x columns)."""
        right = np.asfortranarray(right, dtype=float)
        rows, columns = right.shape
        given = _Dense(rows, columns, right.size, rows, right.ctypes.data, None, _REAL, 0)
        with ctrl_c_ends_at_once():
            found = self._library.cholmod_l_solve(0, self._factor, ctypes.byref(given), self._common)
        if not found:
            raise MemoryError("too little memory for the solution")
        values = ctypes.cast(_Dense.from_address(found).x, ctypes.POINTER(ctypes.c_double))
        answer = np.ctypeslib.as_array(values, (columns, rows)).T.copy()
        self._library.cholmod_l_free_dense(ctypes.byref(ctypes.c_void_p(found)), self._common)
        return answer

    def __del__(self):
        if getattr(self, "_factor", None):
            self._library.cholmod_l_free_factor(ctypes.byref(self._factor), self._common)
            self._library.cholmod_l_finish(self._common)
