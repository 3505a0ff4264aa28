"""Least-squares integration where only a part of the image was measured."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_core.algorithms.arrays.filling import fill_unknown
from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.poisson.screened import Boundary, laplacian


class MASKED:
    """Parameters of the iterative solution. Nothing sets them: they decide its time alone."""

    tolerance = 1e-9  # [ratio] Norm of the residual over that of the right-hand side
    most_rounds = 150  # [count] Iterations after which the equations are solved directly


def solve_masked(gx: Array, gy: Array, boundary: Boundary, mask: Bool) -> Array:
    """Integrate slopes inside a mask, and continue the height smoothly outside it.

    Conjugate gradients [1]_ are preconditioned by the inverse Laplacian of the whole image, which
    differs only by the faces at the border of the mask, and converge in some tens of iterations.
    Masks like sieves or mazes converge slowly, but have few faces and are solved directly.

    Parameters
    ----------
    gx, gy : (H, W)
        Finite inside the mask.
    boundary : "neumann" or "dirichlet"
        Condition at the border of the image.
    mask : (H, W) bool
        True on at least one pixel.

    Returns
    -------
    (H, W) float64
        Height in px.

    References
    ----------
    .. [1] M. R. Hestenes and E. Stiefel, "Methods of conjugate gradients for solving linear
       systems", Journal of Research of the National Bureau of Standards 49(6), 1952.
    """
    domain = _Domain(mask, boundary)
    rhs = domain.rise(gx, gy)
    height = _conjugate_gradients(domain, rhs)
    if height is None:
        height = _direct(domain, rhs)
    return np.asarray(fill_unknown(_without_free_constants(domain, height), mask))


class _Domain:
    """Faces between measured pixels, and their Laplacian."""

    def __init__(self, mask: Bool, boundary: Boundary) -> None:
        self.mask = mask
        self.boundary = boundary
        self.across = mask[:, 1:] & mask[:, :-1]
        self.down = mask[1:] & mask[:-1]
        self.tied = np.zeros(mask.shape)
        """Number of faces of each pixel towards the fixed 0 outside the image."""
        if boundary == "dirichlet":
            for lines in (self.tied, self.tied.T):
                lines[0] += 1
                lines[-1] += 1
            self.tied *= mask

    def rise(self, gx: Array, gy: Array) -> Array:
        """Divergence of the slopes; equals :meth:`apply` of the height with these slopes."""
        gx, gy = (np.where(self.mask, g, 0.0) for g in (gx, gy))
        total = np.zeros(self.mask.shape)
        _accumulate(total, 0.5 * (gx[:, 1:] + gx[:, :-1]) * self.across)
        _accumulate(total.T, (0.5 * (gy[1:] + gy[:-1]) * self.down).T)
        if self.boundary == "dirichlet":
            self._add_border(total, gy, self.down)
            self._add_border(total.T, gx.T, self.across.T)
        return total * self.mask

    def _add_border(self, total: Array, slopes: Array, faces: Bool) -> None:
        # the slope half a step outside extrapolates the last two pixels, or repeats a single one
        first, last = slopes[0].copy(), slopes[-1].copy()
        if len(slopes) > 1:
            first += 0.5 * (slopes[0] - slopes[1]) * faces[0]
            last += 0.5 * (slopes[-1] - slopes[-2]) * faces[-1]
        total[0] -= first
        total[-1] += last

    def apply(self, height: Array) -> Array:
        """Σ (neighbour − height) over the faces of each pixel."""
        total = -self.tied * height
        _accumulate(total, (height[:, 1:] - height[:, :-1]) * self.across)
        _accumulate(total.T, ((height[1:] - height[:-1]) * self.down).T)
        return np.asarray(total)


def _accumulate(total: Array, flow: Array) -> None:
    total[:, :-1] += flow
    total[:, 1:] -= flow


def _conjugate_gradients(domain: _Domain, rhs: Array) -> Array | None:
    from scipy.sparse.linalg import LinearOperator, cg

    shape, whole = rhs.shape, laplacian(rhs.shape, domain.boundary, np.float64)

    def of_images(function: Callable[[Array], Array]) -> LinearOperator:
        def of_vector(vector: Array) -> Array:
            return function(vector.reshape(shape)).ravel()

        return LinearOperator((rhs.size, rhs.size), of_vector, dtype=np.float64)

    matrix = of_images(domain.apply)
    inverse = of_images(lambda residual: whole.solve(residual.copy()) * domain.mask)
    height, unsolved = cg(
        matrix, rhs.ravel(), rtol=MASKED.tolerance, maxiter=MASKED.most_rounds, M=inverse
    )
    return None if unsolved else np.asarray(height.reshape(shape))


def _direct(domain: _Domain, rhs: Array) -> Array:
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import spsolve

    index = np.cumsum(domain.mask).reshape(domain.mask.shape) - 1
    pairs = np.hstack(
        [
            (index[:, :-1][domain.across], index[:, 1:][domain.across]),
            (index[:-1][domain.down], index[1:][domain.down]),
        ]
    )
    n = int(domain.mask.sum())
    one_way = coo_array((np.ones(pairs.shape[1]), tuple(pairs)), shape=(n, n)).tocsr()
    links = one_way + one_way.T
    tied = domain.tied[domain.mask]
    # one tied pixel fixes the constant of each free part; the sum of the right-hand side over
    # the part is 0, so it changes no difference
    part, _ = _parts(domain.mask)
    inside = part[domain.mask]
    label, first = np.unique(inside, return_index=True)
    tied[first[~np.isin(label, inside[tied > 0])]] += 1
    matrix = diags_array(links.sum(axis=1) + tied) - links
    height = np.zeros(domain.mask.shape)
    height[domain.mask] = spsolve(matrix.tocsc(), -rhs[domain.mask])
    return height


def _without_free_constants(domain: _Domain, height: Array) -> Array:
    part, n = _parts(domain.mask)
    size = np.bincount(part.ravel(), minlength=n + 1)
    mean = np.bincount(part.ravel(), height.ravel(), n + 1) / np.maximum(size, 1)
    mean[0] = 0
    mean[np.unique(part[domain.tied > 0])] = 0
    return np.asarray(height - mean[part])


def _parts(mask: Bool) -> tuple[Array, int]:
    """Label the 4-connected parts from 1, and count them; 0 outside the mask."""
    import cv2

    n, part = cv2.connectedComponents(mask.view(np.uint8), connectivity=4)
    return part, n - 1
