"""A few linear equations in plain numbers: numpy takes longer to check them than to solve them."""

from __future__ import annotations

from tactile_core.algorithms.arrays.types import Array


def solved(matrix: Array, right: Array, ridge: float = 0.0) -> list[float]:
    """Solve ``(matrix + ridge · 1) x = right`` by a Cholesky factorisation without roots [1]_.

    Parameters
    ----------
    matrix : (N, N)
        Symmetric and positive definite, such as that of a least-squares fit; N is 3 or 4.
    right : (N,)
    ridge : float
        Added to the diagonal.

    Returns
    -------
    list of float
        x.

    References
    ----------
    .. [1] G. H. Golub and C. F. Van Loan, "Matrix Computations", 4th ed., Johns Hopkins University
       Press, 2013, section 4.1.
    """
    rows: list[list[float]] = matrix.tolist()
    x: list[float] = right.tolist()
    count = len(x)
    for k, pivot in enumerate(rows):
        pivot[k] += ridge
        for i in range(k + 1, count):
            factor, row = pivot[i] / pivot[k], rows[i]
            for j in range(i, count):
                row[j] -= factor * pivot[j]
            x[i] -= factor * x[k]
    for k in range(count - 1, -1, -1):
        row = rows[k]
        for j in range(k + 1, count):
            x[k] -= row[j] * x[j]
        x[k] /= row[k]
    return x
