"""Pixels of known slope, as features and sines that a model is fitted to."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tactile_core.algorithms.normal_xy import to_normal_xy
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.slope_models.fields import sampler_of
from tactile_core.interfaces.slope_models.image_shape import in_words
from tactile_core.quantities import Float32, Reference

MOST_SAMPLES = 12_000
"""More pixels cost time and teach nothing: neighbours in a press are alike."""

FEWEST_SAMPLES = 50


def scale_of(presses: Sequence[Press]) -> float:
    """Millimetres per pixel of the presses.

    Raises
    ------
    CalibrationError
        There are none.
    """
    if not presses:
        raise too_few(presses)
    return presses[0].frame.mm_per_px


def samples_of(
    presses: Sequence[Press],
    reference: Reference,
    *,
    blur_px: float,
    most: int = MOST_SAMPLES,
) -> tuple[Float32, Float32]:
    """Features (N, K + 2) and sines (N, 2) of the presses' pixels, thinned evenly.

    Saturated pixels stay: what a clipped channel looks like on a slope is learnt as it will be
    seen, which on real balls is better than leaving it to extrapolation.

    Raises
    ------
    CalibrationError
        There are too few pixels to fit on, they all rest, or a press has another size than the
        reference.
    """
    for press in presses:
        if press.frame.pixels.shape != reference.pixels.shape:
            raise CalibrationError(
                f"press {press.name!r} is {in_words(press.frame.pixels.shape)} and the reference "
                f"{in_words(reference.pixels.shape)}; record both alike"
            )
    if not presses:
        raise too_few(presses)
    features, normal_xy = thinned(presses, sampler_of(reference, blur_px).features, most=most)
    if len(normal_xy) < FEWEST_SAMPLES or not normal_xy.any():
        raise too_few(presses)
    return features, normal_xy


def thinned(
    presses: Sequence[Press], features_of: Callable[..., Float32], *, most: int
) -> tuple[Float32, Float32]:
    """Features (N, F) and sines (N, 2) of some pixels of each of the presses.

    Parameters
    ----------
    presses : sequence of Press
        One at least.
    features_of : callable
        Of pixels (H, W, K), markers, and N rows and columns; as :meth:`Sampler.features`.
    most : int
        So many pixels of all presses together.
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
    """Return the refusal of presses in which hardly a pixel is of use."""
    return CalibrationError(
        f"{len(presses)} presses hold too few pixels to fit on; record more presses, or larger ones"
    )
