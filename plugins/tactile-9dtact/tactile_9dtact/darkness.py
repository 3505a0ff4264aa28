"""Depth by how much darker than the reference a pixel is, fitted to one press of a ball.

White light enters a translucent gel in front of a black one [1]_. Where an object presses, the
translucent layer is thinner, sends less light back, and the image darkens. The darkening is
relative, frame over reference, so that it depends neither on the brightness of the LEDs nor on the
vignetting of the lens; :mod:`~tactile_9dtact.depth_curve` has the law.

References
----------
.. [1] C. Lin et al., "9DTact: A Compact Vision-Based Tactile Sensor for Accurate 3D Shape
   Reconstruction and Generalizable 6D Force Estimation", IEEE RA-L 9(2), 2024.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tactile_9dtact.depth_curve import Contact, DepthCurve, fit_curve
from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration, Calibrator, Press
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.slope_models.model_file import (
    arrays_of,
    blur_from,
    part_from,
    stored_model,
    write_model,
)
from tactile_core.interfaces.slope_models.samples import (
    SAMPLES,
    ImageShape,
    check_fitting,
    shape_of,
    too_few,
)
from tactile_core.quantities import Bool, Float32, Frame, HeightMap, Reference

# [ratio] Of the change that channels do not share to the one that they do. Source: white light on
# a real press has 0.18, coloured light on those of four sensors, real and virtual, at least 0.75
_MOST_COLOUR = 0.5
_CELLS = 32, 24  # [count] Columns and rows of the grid on which the drift is estimated
_FAR = 0.2  # [share] Of the image, farthest from the contacts, where the light is compared
_MOST_DRIFT = 0.1  # [ratio] A larger change is no drift: a contact that fills the image


class Darkness(Calibration):
    """Depth by relative darkening, with the deviation that the presses of the fit showed.

    It compensates the drift of the light itself; see :func:`darkening`.

    Parameters
    ----------
    curve : DepthCurve
    shape : (H, W, K)
        Shape of the images.
    blur_px : float
        Standard deviation of the smoothing of frame and reference.
    """

    compensation = "none"

    def __init__(self, curve: DepthCurve, shape: ImageShape, blur_px: float) -> None:
        self.curve, self.shape, self.blur_px = curve, shape, blur_px

    def measure(self, frame: Frame, reference: Reference) -> HeightMap:
        """Return the depth of one frame.

        Raises
        ------
        CalibrationError
            Frame or reference differ in size or channels from the images of the fit.
        """
        check_fitting(frame, reference, self.shape)
        s, nodes = darkening(frame, reference, self.blur_px), self.curve.darkening
        mm, std_mm = (
            np.interp(s, nodes, values).astype(np.float32)
            for values in (self.curve.depth_mm, self.curve.std_mm)
        )
        return HeightMap(
            mm, measurable(frame), frame.mm_per_px, frame.timestamp_s, std_cells_mm=std_mm
        )

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        arrays = {**arrays_of(self.curve), "blur_px": np.array(self.blur_px)}
        write_model(directory, self.shape, arrays)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            The file is missing, damaged or of another model.
        """
        with stored_model(directory) as (shape, arrays):
            curve = part_from(DepthCurve, arrays)
            return cls(curve, shape, blur_from(arrays, shape, "blur_px"))


class DarknessOptions(Options):
    """Options of ``use: ninedtact.darkness`` in a profile."""

    blur_mm: float = Field(
        default=0.1, ge=0, le=2, description="Standard deviation of the smoothing, mm on the gel."
    )


class DarknessCalibrator(Calibrator):
    """Fits the depth to presses of a ball; one is enough.

    The shape of the ball is known, the depth of its press is not: the contact ends where the gel
    leaves the ball, which is hard to see, and how high that is depends on the thickness of the gel.
    So the level of each press is fitted, by a depth of 0 where nothing has changed, and so is a
    displacement of each ball, which an error of its circle would turn into an error of the depth.
    """

    Options = DarknessOptions
    options: DarknessOptions
    compensation = "none"
    fits = "heights"

    def fit(self, presses: Sequence[Press], reference: Reference) -> Darkness:
        """Fit the curve to the pixels on the balls.

        Raises
        ------
        CalibrationError
            The presses hold no pixels of known height, do not darken the image as a ball does, or
            change its colour more than its brightness.
        """
        blur_px = self.smoothing_px(presses[0].frame.mm_per_px) if presses else 0.0
        contacts = [contact for press in presses for contact in _contact(press, reference, blur_px)]
        if not contacts:
            raise too_few(presses)
        return Darkness(fit_curve(contacts), shape_of(reference), blur_px)

    def smoothing_px(self, mm_per_px: float) -> float:
        """Return the standard deviation of the smoothing."""
        return self.options.blur_mm / mm_per_px


def _contact(press: Press, reference: Reference, blur_px: float) -> list[Contact]:
    """Return the pixels of a press that are on the ball, if there are enough."""
    on_ball = press.gradients.any(axis=1)
    if press.heights_mm is None or np.count_nonzero(on_ball) < SAMPLES.fewest:
        return []
    at = press.rows[on_ball], press.columns[on_ball]
    _check_white(press, reference, blur_px, at)
    s, slopes, mm = (
        part.astype(np.float64)
        for part in (
            darkening(press.frame, reference, blur_px)[at],
            press.gradients[on_ball],
            press.heights_mm[on_ball],
        )
    )
    return [Contact(s, slopes, mm, press.name)]


def _check_white(
    press: Press,
    reference: Reference,
    blur_px: float,
    at: tuple[NDArray[np.int32], NDArray[np.int32]],
) -> None:
    """Check that the channels change alike, as under white light."""
    each = np.stack(
        [
            _ratio(*planes, blur_px, press.frame.full_scale)[at]
            for planes in zip(
                np.moveaxis(press.frame.pixels, 2, 0),
                np.moveaxis(reference.pixels, 2, 0),
                strict=True,
            )
        ]
    )
    shared = each.mean(axis=0)
    apart = float(np.std(each - shared)) / max(float(np.std(shared)), 1e-9)
    if apart > _MOST_COLOUR:
        raise CalibrationError(
            f"the colours of {press.name or 'a press'} change more than its brightness, so its "
            "light is not white; take a model for coloured lights, as --model core.automatic"
        )


def darkening(frame: Frame, reference: Reference, blur_px: float) -> Float32:
    """Return s = 2 (1 − √q) of the ratio q of frame to reference, (H, W) float32.

    It is 0 where nothing has changed, positive where the frame is darker, and at most 2. The drift
    of the light is compensated.
    """
    mean = frame.pixels.astype(np.float32).mean(axis=2)
    ratio = _ratio(mean, reference.pixels.mean(axis=2), blur_px, frame.full_scale)
    return np.asarray(2 - 2 * np.sqrt(ratio / _light_gain(ratio)), np.float32)


def _ratio(
    pixels: NDArray[np.float32], rest: NDArray[np.float32], blur_px: float, full_scale: float
) -> Float32:
    """Return the ratio q of two planes (H, W), smoothed."""
    floor = np.float32(LEVELS.dark_share * full_scale)
    smooth = [
        cv2.GaussianBlur(plane.astype(np.float32), (0, 0), blur_px) if blur_px else plane
        for plane in (pixels, rest)
    ]
    seen, undeformed = (np.maximum(plane, floor) for plane in smooth)
    return np.asarray(seen / undeformed, np.float32)


def _light_gain(ratio: Float32) -> np.float32:
    """Return how much brighter the light has become since the reference.

    It shows far from any contact. Nearer the gel bulges, over an area that may be larger than what
    is left of the image, so that the most frequent change is no change of the light.
    """
    cells = cv2.resize(ratio, _CELLS, interpolation=cv2.INTER_AREA)
    usual = np.median(cells)
    free = (usual - cells < (usual - cells.min()) / 2).astype(np.uint8)
    distance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    gain = np.median(cells[distance >= np.quantile(distance, 1 - _FAR)])
    return np.float32(gain if abs(gain - 1) < _MOST_DRIFT else 1)


def measurable(frame: Frame) -> Bool:
    """Return (H, W) bool: no channel is saturated, and not all are dark."""
    lit = frame.pixels.max(axis=2) > LEVELS.dark_share * frame.full_scale
    return np.asarray(lit & ~frame.saturated.any(axis=2))
