"""Three linear equations in plain numbers: numpy takes longer to check them than to solve them."""

from __future__ import annotations

from tactile_core.algorithms.arrays.types import Array

Three = tuple[float, float, float]


def solved(matrix: Array, right: Array, ridge: float = 0.0) -> Three:
    """Solve ``(matrix + ridge · 1) x = right``.

    Parameters
    ----------
    matrix : (3, 3)
        Symmetric and positive definite, such as that of a least-squares fit.
    right : (3,)
    ridge : float
        Added to the diagonal.

    Returns
    -------
    (float, float, float)
        x, by Cholesky's factorisation without square roots [1]_.

    References
    ----------
    .. [1] G. H. Golub and C. F. Van Loan, "Matrix Computations", 4th ed., Johns Hopkins University
       Press, 2013, section 4.1.
    """
    (a, b, c), (_, d, e), (_, _, f) = matrix.tolist()
    p, q, r = right.tolist()
    a, d, f = a + ridge, d + ridge, f + ridge
    b_a, c_a = b / a, c / a
    d, e, f = d - b_a * b, e - b_a * c, f - c_a * c
    q, r = q - b_a * p, r - c_a * p
    e_d = e / d
    z = (r - e_d * q) / (f - e_d * e)
    y = (q - e * z) / d
    return (p - b * y - c * z) / a, y, z
