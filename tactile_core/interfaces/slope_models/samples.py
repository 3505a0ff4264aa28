"""Training samples: features of pixels, and their normals' x and y components as targets."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tactile_core.algorithms.normal_xy import to_normal_xy
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.slope_models.fields import sampler_of
from tactile_core.interfaces.slope_models.image_shape import in_words
from tactile_core.quantities import Float32, Reference


class SAMPLES:
    """Parameters of sampling training pixels. Nothing sets them from outside."""

    # [count] Training pixels of all presses together, at most. Neighbouring pixels of a press are
    # redundant, so that more cost time without improving the fit.
    most = 12_000
    fewest = 50  # [count] A fit needs at least this many pixels


def scale_of(presses: Sequence[Press]) -> float:
    """Return the scale of the presses in mm per px.

    Raises
    ------
    CalibrationError
        There are no presses.
    """
    if not presses:
        raise too_few(presses)
    return presses[0].frame.mm_per_px


def samples_of(
    presses: Sequence[Press],
    reference: Reference,
    *,
    blur_px: float,
    most: int = SAMPLES.most,
) -> tuple[Float32, Float32]:
    """Return features (N, K + 2) and normal_xy (N, 2) of the presses' pixels, thinned randomly.

    Saturated pixels are kept. The model then learns slopes of clipped channels from examples,
    which on real balls is more accurate than extrapolation.

    Raises
    ------
    CalibrationError
        Too few pixels to fit on, only undeformed pixels, or a press of another size than the
        reference.
    """
    for press in presses:
        if press.frame.pixels.shape != reference.pixels.shape:
            raise CalibrationError(
                f"press {press.name!r} is {in_words(press.frame.pixels.shape)} and the reference "
                f"{in_words(reference.pixels.shape)}; record both at the same size"
            )
    if not presses:
        raise too_few(presses)
    features, normal_xy = thinned(presses, sampler_of(reference, blur_px).features, most=most)
    if len(normal_xy) < SAMPLES.fewest or not normal_xy.any():
        raise too_few(presses)
    return features, normal_xy


def thinned(
    presses: Sequence[Press], features_of: Callable[..., Float32], *, most: int
) -> tuple[Float32, Float32]:
    """Return features (N, F) and normal_xy (N, 2) of randomly drawn pixels of each press.

    Parameters
    ----------
    presses : sequence of Press
        At least one.
    features_of : callable
        Called with pixels (H, W, K), marker mask, and N rows and columns, like
        :meth:`Sampler.features`.
    most : int
        Pixels of all presses together, at most.
    """
    features, normal_xy = [], []
    rng = np.random.default_rng(0)
    share = max(1, most // len(presses))
    for press in presses:
        pick = rng.permutation(len(press.rows))[:share]
        at = press.rows[pick], press.columns[pick]
        features.append(features_of(press.frame.pixels, press.frame.marker_mask, *at))
        normal_xy.append(to_normal_xy(press.gradients[pick]))
    return np.concatenate(features), np.concatenate(normal_xy)


def too_few(presses: Sequence[Press]) -> CalibrationError:
    """Return the error for presses with too few usable pixels."""
    return CalibrationError(
        f"{len(presses)} presses hold too few pixels to fit on; record more presses, or larger ones"
    )
