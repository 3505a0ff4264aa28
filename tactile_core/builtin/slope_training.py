"""Fitting a slope model: pixels of known slope, and a table that is as good as the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tactile_core.algorithms.colour_table import Axis, ColourTable, bake
from tactile_core.algorithms.sines import to_sines
from tactile_core.algorithms.slope_field import Model, Sampler, takes_table
from tactile_core.builtin.image_shape import in_words, shape_of
from tactile_core.builtin.slope_calibration import SlopeOptions, slope_field
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Float32, Reference

MOST_SAMPLES = 12_000
"""More pixels cost time and teach nothing: neighbours in a press are alike."""

FEWEST_SAMPLES = 50
POINTS = (1_200, 4_800, 19_200)
"""Points of the coarse grid that are tried, one after another."""

FAITHFUL_SINE = 0.0175
"""Largest mean distance of table and model, 1°: half of what the best models err."""

_PRESSES_COMPARED = 4


def blur_of(options: SlopeOptions, samples: Sequence[Press]) -> float:
    """Smoothing in px at the scale of the presses."""
    return options.blur_at(samples[0].frame.mm_per_px) if samples else options.blur_px


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
    features, sines = thinned(presses, _sampler(reference, blur_px).features, most=most)
    if len(sines) < FEWEST_SAMPLES or not sines.any():
        raise too_few(presses)
    return features, sines


def thinned(
    presses: Sequence[Press], features_of: Callable[..., Float32], *, most: int
) -> tuple[Float32, Float32]:
    """Features (N, F) and sines (N, 2) of some pixels of each of the presses.

    Parameters
    ----------
    presses : sequence of Press
        One at least.
    features_of : callable
        Of pixels (H, W, K), marks, and N rows and columns; as :meth:`Sampler.features`.
    most : int
        So many pixels of all presses together.
    """
    features, sines = [], []
    rng = np.random.default_rng(0)
    share = max(1, most // len(presses))
    for press in presses:
        pick = rng.permutation(len(press.rows))[:share]
        at = press.rows[pick], press.columns[pick]
        features.append(features_of(press.frame.pixels, press.frame.marks, *at))
        sines.append(to_sines(press.gradients[pick]))
    return np.concatenate(features), np.concatenate(sines)


def too_few(presses: Sequence[Press]) -> CalibrationError:
    """Return the refusal of presses in which hardly a pixel is of use."""
    return CalibrationError(
        f"{len(presses)} presses hold too few pixels to fit on; record more presses, or larger ones"
    )


def baked(
    model: Model,
    features: Float32,
    presses: Sequence[Press],
    reference: Reference,
    blur_px: float,
) -> ColourTable | None:
    """Table of a model for the colours that were seen; None where none is needed."""
    height, width, channels = shape_of(reference)
    if not takes_table((height, width, channels)):
        return None
    table = bake(model, Axis.spanning(features[:, :3]), aspect=height / width)
    return faithful(table, model, presses, reference, blur_px)


def faithful(
    table: ColourTable,
    model: Model,
    presses: Sequence[Press],
    reference: Reference,
    blur_px: float,
) -> ColourTable | None:
    """The table with as many points as keep it near its model on some presses; None if none do.

    How fast the light varies over the gel, and how large the presses are, decides.
    """
    sampler = _sampler(reference, blur_px)
    some = presses[:: max(1, len(presses) // _PRESSES_COMPARED)][:_PRESSES_COMPARED]
    for points in POINTS:
        candidate = replace(table, points=points)
        field = slope_field(model, candidate, reference, blur_px)
        apart = []
        for press in some:
            at = press.rows, press.columns
            gx, gy, _ = field.measure(press.frame.pixels, press.frame.marks)
            exact = model(sampler.features(press.frame.pixels, press.frame.marks, *at))
            fast = to_sines(np.stack([gx[at], gy[at]], axis=1))
            apart.append(np.linalg.norm(fast - exact, axis=1))
        if np.concatenate(apart).mean() < FAITHFUL_SINE:
            return candidate
    return None


def _sampler(reference: Reference, blur_px: float) -> Sampler:
    return Sampler(
        reference.pixels, reference.marks, full_scale=reference.full_scale, blur_px=blur_px
    )
