"""Depth by how much darker than the reference a pixel is, fitted to one press of a ball.

White light enters a translucent gel in front of a black one [1]_. Where an object presses, the
translucent layer is thinner, sends less light back, and the image darkens. The darkening is
relative, frame over reference, so that it depends neither on the brightness of the LEDs nor on the
vignetting of the lens.

How the ratio q of frame to reference depends on the depth is known at two limits. A layer that
absorbs has −log q ∝ depth (Lambert and Beer), a thin layer that scatters 1 − q ∝ depth. The
darkening s = 2 (1 − √q) is the law between them: to second order the first is s + s²/4 and the
second s − s²/4. So the depth is a s + b s², where b is expected within ± a/4, and the presses
decide as far as they determine it.

References
----------
.. [1] C. Lin et al., "9DTact: A Compact Vision-Based Tactile Sensor for Accurate 3D Shape
   Reconstruction and Generalizable 6D Force Estimation", IEEE RA-L 9(2), 2024.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

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
    ImageShape,
    check_fitting,
    shape_of,
    too_few,
)
from tactile_core.quantities import Bool, Float32, Frame, HeightMap, Reference

Float64 = NDArray[np.float64]

_BINS = 16  # [count] Of the darkening; a ball shows each in a ring of some hundred pixels
_BEND = 0.25  # [ratio] Expected b / a, between the limits of absorption and of scattering
# [ratio] Of the residual to the deviation of the heights. Source: 0.07 on a real ball and at most
# 0.05 on virtual ones; 0.5 and 0.8 on a flat end and a bar
_MOST_UNLIKE = 0.3
# [ratio] Of the change that channels do not share to the one that they do. Source: white light on
# a real press has 0.04, coloured light on virtual ones above 1
_MOST_COLOUR = 0.5


@dataclass(frozen=True, eq=False)
class DepthCurve:
    """Depth by darkening, linear between nodes.

    Attributes
    ----------
    darkening : (M,) float32
        Increasing; see :func:`darkening`.
    depth_mm : (M,) float32
        Negative where the image is brighter: gel that is pressed away bulges elsewhere.
    std_mm : (M,) float32
        Deviation of the depth on the balls of the fit.
    """

    darkening: Float32
    depth_mm: Float32
    std_mm: Float32

    def __post_init__(self) -> None:
        """Check that it is a curve; ValueError if not."""
        table = np.stack([self.darkening, self.depth_mm, self.std_mm])
        if table.ndim != 2 or not np.isfinite(table).all() or (np.diff(table[0]) <= 0).any():
            raise ValueError("the nodes of a curve increase")


class Darkness(Calibration):
    """Depth by relative darkening, with the deviation that the presses of the fit showed.

    Parameters
    ----------
    curve : DepthCurve
    shape : (H, W, K)
        Shape of the images.
    blur_px : float
        Standard deviation of the smoothing of frame and reference.
    """

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
    fits = "heights"

    def fit(self, presses: Sequence[Press], reference: Reference) -> Darkness:
        """Fit the law to the pixels on the balls.

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


@dataclass(frozen=True, eq=False)
class Contact:
    """Pixels on one ball.

    Attributes
    ----------
    s : (N,) float64
        Darkening.
    slopes : (N, 2) float64
        True slopes.
    mm : (N,) float64
        True height, up to a constant.
    name : str
        Name of the press, for messages.
    """

    s: Float64
    slopes: Float64
    mm: Float64
    name: str = ""

    @property
    def nuisances(self) -> Float64:
        """(N, 3) change of the height by its unknown level and a displacement along x and y."""
        return np.column_stack([np.ones(len(self.s)), self.slopes])


def fit_curve(contacts: Sequence[Contact]) -> DepthCurve:
    """Fit the depth by least squares, with the level and the displacement of each contact.

    First a s + b s². What it does not know – the ball is seen in perspective, and light scatters
    sideways – is alike over a whole contact. So each contact counts as one observation against the
    expected bend; its variance is estimated from the residuals, in some rounds. Then the mean
    residual of each bin of the darkening corrects the curve, where the balls have darkened it.

    Parameters
    ----------
    contacts : sequence of Contact
        At least one.

    Raises
    ------
    CalibrationError
        The image does not darken with depth, or in some contact not as on a ball.
    """
    unknowns = 2 + 3 * len(contacts)
    normal, right = np.zeros((unknowns, unknowns)), np.zeros(unknowns)
    for number, contact in enumerate(contacts):
        columns = np.zeros((len(contact.s), unknowns))
        columns[:, 0], columns[:, 1] = contact.s, contact.s**2
        columns[:, _own(number)] = contact.nuisances
        normal += columns.T @ columns / len(contact.s)
        right += columns.T @ contact.mm / len(contact.s)
    normal += 1e-9 * np.eye(unknowns)  # slopes in a single direction leave a displacement open
    variance, a, b, errors = np.inf, 1.0, 0.0, list[Float64]()
    for _ in range(6):  # [count] rounds, from a straight line on; they converge in four
        expected = np.zeros((unknowns, unknowns))
        expected[1, 1] = min(variance / (a * _BEND) ** 2, 1e9)
        solved = np.linalg.solve(normal + expected, right)
        a, b = float(solved[0]), float(solved[1])
        if a <= 0:
            raise CalibrationError(
                "the image does not darken where the ball presses; exchange --presses and "
                "--reference if they are mixed up, or take a model for light from the sides, as "
                "--model core.automatic"
            )
        errors = [
            contact.s * (a + b * contact.s) + contact.nuisances @ solved[_own(k)] - contact.mm
            for k, contact in enumerate(contacts)
        ]
        variance = float(np.mean([np.mean(error**2) for error in errors]))
    for contact, error in zip(contacts, errors, strict=True):
        if float(np.std(error)) > _MOST_UNLIKE * float(np.std(contact.mm)):
            raise CalibrationError(
                f"{contact.name or 'a press'} does not darken like a ball of this diameter; press "
                "the ball alone, or correct its diameter"
            )
    return _corrected(a, b, np.concatenate([c.s for c in contacts]), np.concatenate(errors))


def _own(number: int) -> slice:
    """Return where the unknowns of a contact are, its level and displacement."""
    return slice(2 + 3 * number, 5 + 3 * number)


def _corrected(a: float, b: float, s: Float64, error: Float64) -> DepthCurve:
    """Return the curve less its mean error in bins of the darkening.

    A bin without pixels has no node. Beyond the bins the slope is that of a s + b s² there.
    """
    edges = np.linspace(s.min(), s.max(), _BINS + 1)
    which = np.clip(np.searchsorted(edges, s, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(which, minlength=_BINS)
    some = count > 0
    middle, bias, square = (
        np.bincount(which, values, _BINS)[some] / count[some] for values in (s, error, error**2)
    )
    mm = np.maximum.accumulate(np.maximum(middle * (a + b * middle) - bias, 0))
    std_mm = np.sqrt(square)
    # 1.25 times brighter than the reference, the reference, and black
    ends = mm[-1] + (2 - middle[-1]) * max(a + 2 * b * middle[-1], 0)
    keep = middle > 0
    nodes = np.concatenate([[-0.25, 0], middle[keep], [2]])
    depth_mm = np.concatenate([[-0.25 * a, 0], mm[keep], [ends]])
    spread_mm = np.concatenate([std_mm[:1], std_mm[:1], std_mm[keep], std_mm[-1:]])
    return DepthCurve(*(part.astype(np.float32) for part in (nodes, depth_mm, spread_mm)))


def _contact(press: Press, reference: Reference, blur_px: float) -> list[Contact]:
    """Return the pixels of a press that are on the ball, if there are enough."""
    on_ball = press.gradients.any(axis=1)
    if press.heights_mm is None or np.count_nonzero(on_ball) < _BINS:
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
            _relative(*planes, blur_px, press.frame.full_scale)[at]
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

    It is 0 where nothing has changed, positive where the frame is darker, and at most 2.
    """
    mean = frame.pixels.astype(np.float32).mean(axis=2)
    return _relative(mean, reference.pixels.mean(axis=2), blur_px, frame.full_scale)


def _relative(
    pixels: NDArray[np.float32], rest: NDArray[np.float32], blur_px: float, full_scale: float
) -> Float32:
    floor = np.float32(LEVELS.dark_share * full_scale)
    smooth = [
        cv2.GaussianBlur(plane.astype(np.float32), (0, 0), blur_px) if blur_px else plane
        for plane in (pixels, rest)
    ]
    seen, undeformed = (np.maximum(plane, floor) for plane in smooth)
    return np.asarray(2 - 2 * np.sqrt(seen / undeformed), np.float32)


def measurable(frame: Frame) -> Bool:
    """Return (H, W) bool: no channel is saturated, and not all are dark."""
    lit = frame.pixels.max(axis=2) > LEVELS.dark_share * frame.full_scale
    return np.asarray(lit & ~frame.saturated.any(axis=2))
