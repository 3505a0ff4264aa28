"""A table for Taxim from one of our bundles: the light model solved for the colour of each slope.

The model says which slope a change of colour means. Many changes mean the same slope, since colours
have three components and slopes two. From no change at all, each direction is followed in small
steps of tilt, always by the least change that reaches the next one. Beyond the steepest slope of
the calibration the last change is repeated, as Taxim does beyond what its presses have shown.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_core.algorithms.light.photometric import place, smooth_background
from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import InputError
from tactile_core.interfaces.slope_models.slope_model import SlopeCalibration, SlopeFunction
from tactile_core.quantities import Float32, Reference
from tactile_imports.polynomial_table import (
    FULL_SCALE,
    Float64,
    PolynomialTable,
    bin_angles,
    place_terms,
)
from tactile_imports.slope_image import COLOURS

BINS = 125  # As in the tables that Taxim comes with

_STEEPEST_DEG = 35.0  # Of a model that does not say up to which slope it was calibrated
_PLACES = (
    7,
    9,
)  # [count] Rows and columns of places that a polynomial of second order is fitted to
_STEP = np.float32(0.01)  # [relative change] Of the derivatives of the model
_ROUNDS = 2  # [count] Of Newton's method at each tilt; a step is less than a degree

# [sine per relative change, squared] Of the damping: a slope that hardly any colour causes is not
# worth a large one
_DAMPING = 1e-3


def table_of(bundle: Bundle) -> PolynomialTable:
    """Return the changes of colour that the light model of a bundle expects of each slope.

    Raises
    ------
    InputError
        The bundle has no reference, another kind of model, or another number of colours.
    """
    model, reference = bundle.calibration, bundle.reference
    if not isinstance(model, SlopeCalibration):
        kind = bundle.manifest.artefacts.get("light", "none")
        raise InputError(
            f"the light model of this bundle, {kind}, does not say which colours a slope has; give "
            "a bundle of 'tactile calibrate'"
        )
    if reference is None:
        raise InputError("this bundle has no reference, whose light a table is of; calibrate again")
    if reference.pixels.shape[2] != COLOURS:
        raise InputError(
            f"Taxim renders {COLOURS} colours and this sensor has {reference.pixels.shape[2]} "
            "lights; give the bundle of a sensor with a colour image"
        )
    errors = bundle.errors
    steepest = np.tan(np.radians(_STEEPEST_DEG)) if errors is None else errors.slopes[-1]
    x_px, y_px = _places(reference)
    light = smooth_background(reference.pixels, reference.marker_mask)[y_px, x_px]
    relative = _changes(
        model.slopes.function,
        place(reference.pixels.shape[:2])[y_px, x_px],
        float(np.arctan(steepest)),
    )
    change = relative * light * (FULL_SCALE / reference.full_scale)
    fit = np.linalg.pinv(place_terms(x_px, y_px))  # (6, P)
    return PolynomialTable(np.einsum("tp,adpc->adct", fit, change))


def _places(reference: Reference) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]:
    """Return x and y in px of places all over the image, (P,) each."""
    sides = zip(reference.pixels.shape[:2], _PLACES, strict=True)
    y, x = np.meshgrid(
        *(np.linspace(0, side - 1, count).round().astype(np.intp) for side, count in sides),
        indexing="ij",
    )
    return x.ravel(), y.ravel()


def _changes(function: SlopeFunction, at: Float32, steepest: float) -> Float64:
    """Return relative changes (B, B, P, 3) by tilt, direction and place (P, 2)."""
    tilts, directions = bin_angles(BINS)
    towards = np.stack([np.cos(directions), np.sin(directions)], axis=1)
    towards = np.repeat(towards, len(at), axis=0)
    where = np.tile(at, (BINS, 1))

    def normals(change: Float64) -> Float64:
        features = np.concatenate([change, where], axis=1).astype(np.float32)
        return np.asarray(function(features), float)

    change = np.zeros((len(where), COLOURS))
    level = normals(change)  # of the undeformed surface, which is subtracted from every measurement
    found = np.empty((BINS, BINS, len(at), COLOURS))
    for number, tilt in enumerate(tilts):
        if tilt <= steepest:
            for _ in range(_ROUNDS):
                change = change + _step(normals, change, level + np.sin(tilt) * towards)
        found[number] = change.reshape(BINS, len(at), COLOURS)
    return found


def _step(normals: Callable[[Float64], Float64], change: Float64, wanted: Float64) -> Float64:
    """Return the least further change (N, 3) that leads to the wanted normals (N, 2)."""
    derivatives = np.stack(
        [
            (normals(change + _STEP * axis) - normals(change - _STEP * axis)) / (2 * _STEP)
            for axis in np.eye(COLOURS)
        ],
        axis=2,
    )
    across = derivatives.transpose(0, 2, 1)
    missing = (wanted - normals(change))[..., None]
    solved = np.linalg.solve(derivatives @ across + _DAMPING * np.eye(2), missing)
    return np.asarray((across @ solved)[..., 0])
