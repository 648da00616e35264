"""Small dense linear algebra for the compiled fit."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import FloatArray
from estimator.jit import jit_sums


@jit_sums
def cholesky(m: FloatArray) -> None:
    """Lower Cholesky factor in place (only the lower triangle is read and written)."""
    for j in range(m.shape[0]):
        for i in range(j, m.shape[0]):
            value = m[i, j]
            for k in range(j):
                value -= m[i, k] * m[j, k]
            m[i, j] = np.sqrt(max(value, 1e-12)) if i == j else value / m[j, j]


@jit_sums
def solve_column(factor: FloatArray, columns: FloatArray, j: int) -> None:
    """Solve in place for column ``j`` with a lower Cholesky factor."""
    n = factor.shape[0]
    for i in range(n):
        value = columns[i, j]
        for k in range(i):
            value -= factor[i, k] * columns[k, j]
        columns[i, j] = value / factor[i, i]
    for i in range(n - 1, -1, -1):
        value = columns[i, j]
        for k in range(i + 1, n):
            value -= factor[k, i] * columns[k, j]
        columns[i, j] = value / factor[i, i]


@jit_sums
def inverse_diagonal(factor: FloatArray, out: FloatArray) -> None:
    """Diagonal of the inverse of the matrix with this lower Cholesky factor into ``out``."""
    count = factor.shape[0]
    column = np.empty(count)
    for m in range(count):
        total = 0.0
        for i in range(m, count):
            value = 1.0 if i == m else 0.0
            for k in range(m, i):
                value -= factor[i, k] * column[k]
            column[i] = value / factor[i, i]
            total += column[i] * column[i]
        out[m] = total


@jit_sums
def reduce_normal(
    gpp: FloatArray, rhs: FloatArray, gtt: FloatArray, p: FloatArray, fit: FloatArray
) -> None:
    """Eliminate p from joint normal equations (Schur complement), in place.

    ``gpp`` (m, m) belongs to p, ``rhs`` (m, w + 1) couples it to the w other unknowns and, in the
    last column, to the data; ``gtt`` (w, w + 1) belongs to the others, its last column to the
    residual at the present ``p`` (m,). Leaves the Cholesky factor in gpp, the reduced equations
    (lower triangle and last column) in gtt and gpp^-1 rhs in ``fit``.
    """
    count, others = gpp.shape[0], gtt.shape[0]
    cholesky(gpp)
    fit[:] = rhs
    _solve_half(gpp, fit)
    for m in range(count):
        for j in range(others):
            half = fit[m, j]
            for i in range(j + 1):
                gtt[j, i] -= half * fit[m, i]
            # The prior's mean of p is zero, hence the step of p from its present value.
            gtt[j, others] -= half * fit[m, others] - rhs[m, j] * p[m]
    _solve_other_half(gpp, fit)


@jit_sums
def _solve_half(factor: FloatArray, columns: FloatArray) -> None:
    """Columns times the inverse of the lower Cholesky factor, row by row, in place."""
    width = columns.shape[1]
    for i in range(factor.shape[0]):
        for k in range(i):
            times = factor[i, k]
            for j in range(width):
                columns[i, j] -= times * columns[k, j]
        inverse = 1.0 / factor[i, i]
        for j in range(width):
            columns[i, j] *= inverse


@jit_sums
def _solve_other_half(factor: FloatArray, columns: FloatArray) -> None:
    """Columns times the inverse of the factor's transpose, row by row, in place."""
    width = columns.shape[1]
    for i in range(factor.shape[0] - 1, -1, -1):
        for k in range(i + 1, factor.shape[0]):
            times = factor[k, i]
            for j in range(width):
                columns[i, j] -= times * columns[k, j]
        inverse = 1.0 / factor[i, i]
        for j in range(width):
            columns[i, j] *= inverse


@jit_sums
def solve_fixed(
    matrix: FloatArray, rhs: FloatArray, fixed: NDArray[np.bool_], value: FloatArray
) -> FloatArray:
    """Solution of matrix x = rhs over the free entries, the others held at ``value``."""
    n = rhs.shape[0]
    m = matrix.copy()
    x = np.zeros((n, 1))
    for i in range(n):
        x[i, 0] = rhs[i]
    for f in range(n):
        if not fixed[f]:
            continue
        for i in range(n):
            x[i, 0] -= matrix[i, f] * value[f]
            m[i, f] = m[f, i] = 0.0
        m[f, f] = 1.0
    for f in range(n):
        if fixed[f]:
            x[f, 0] = value[f]
    cholesky(m)
    solve_column(m, x, 0)
    return x[:, 0].copy()


@jit_sums
def spread_through(along: FloatArray, level: float, bend: float, m: FloatArray) -> FloatArray:
    """J m J for the symmetric J = level I + bend along along^T, all (3, 3) and ``along`` (3,)."""
    j = np.empty((3, 3))
    for row in range(3):
        for column in range(3):
            j[row, column] = bend * along[row] * along[column]
        j[row, row] += level
    out = np.zeros((3, 3))
    for row in range(3):
        for column in range(3):
            for k in range(3):
                for i in range(3):
                    out[row, column] += j[row, k] * m[k, i] * j[i, column]
    return out
