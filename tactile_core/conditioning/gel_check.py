"""Check of every frame: whether it shows the gel of the reference under the bundle's light."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.light.appearance import (
    FEWEST_CELLS,
    Appearance,
    agreement,
    fit_smooth_field,
    polynomial,
)
from tactile_core.algorithms.light.drift import DRIFT
from tactile_core.algorithms.light.seam import find_seam
from tactile_core.bundles.manifest import LightRange
from tactile_core.quantities import Frame, Reference, ShownGel
from tactile_core.quantities.observation import Cause

MARGIN = 0.05  # Share of the cells by which a mistake must explain a frame better than none does

# Logarithm of intensity by which a cell may differ from every tilt of the surface.
SURFACE_TOLERANCE = 0.04

SURFACE_SCALES = 0.2, 0.1, 0.05, 0.03, 0.02

FLOOR = 0.004  # Logarithm of intensity that noise and rounding leave in a smooth field


SEAM = 1.5  # Ratio of the step at a line to those around it; presses reach 1.4

# Share of the typical change of a pixel that is left when a roll is undone, at most
UNDONE = 0.95

SAMPLES = 40  # Pixels of a line that a step is averaged over, count: enough against noise


# Share of what a constant leaves that a change of the light explains; a wide contact does not.
EXPLAINED = 0.25


@dataclass(frozen=True)
class LightChange:
    """What of a frame's change no tilt of the surface explains.

    Attributes
    ----------
    slope : (J, 2)
        Of the linear field, per half of the image.
    ramp, field : float
        Root mean square of the linear field beyond the known drift, and of that of third order.
    level, linear, cubic : float
        Shares of the cells that a constant and these two fields explain.
    """

    slope: Array
    ramp: float
    field: float
    level: float
    linear: float
    cubic: float


@dataclass(frozen=True, eq=False)
class GelCheck:
    """Compares frames with a reference.

    Parameters
    ----------
    reference : Reference
        With its markers masked.
    light : LightRange or None
        The unit's; None if it was never calibrated.
    compensated : bool
        A frame is wrong if its brightness differs by more than is compensated.
    view : (3, 3) float or None
        Homography to the camera's image, as an ``Appearance`` takes it.
    """

    reference: Reference
    light: LightRange | None = None
    compensated: bool = False
    view: Array | None = None

    def __call__(self, frame: Frame) -> ShownGel:
        """Say what a conditioned frame shows."""
        cause = self._cause(frame)
        return ShownGel(cause is None, cause, frame.timestamp_s)

    @cached_property
    def _appearance(self) -> Appearance:
        reference = self.reference
        shown = reference.pixels, reference.full_scale, reference.marker_mask
        return Appearance(*shown, self.view)

    def _cause(self, frame: Frame) -> Cause | None:
        look = self._appearance
        log, readable = self._cells(frame)
        change, both = look.change(log, readable)
        seen, shown = np.count_nonzero(look.seen), np.count_nonzero(both)
        if seen < FEWEST_CELLS:  # a few pixels cannot be compared, a black reference is none
            return "unknown" if self.light is not None and len(look.seen) >= FEWEST_CELLS else None
        if shown < max(FEWEST_CELLS, 0.5 * seen):  # [share of the reference's readable cells]
            return "unknown"
        # [share of the reference's readable cells] dark in every channel
        if shown < seen and np.count_nonzero(look.cells.black(log) & look.seen) > 0.12 * seen:
            return "unknown"
        if self._is_rolled(frame):
            return "rolled"
        found: Cause | None = look.cause(log, readable, change, MARGIN)
        if found is None and self._beyond is not None and not self._unsuspicious(change):
            found = self._of_light(self.light_change(change, both))
        return found or ("unknown" if self._too_bright_or_dark(frame) else None)

    def _cells(self, frame: Frame) -> tuple[Array, Bool]:
        pixels, hidden = frame.pixels, frame.marker_mask
        return self._appearance.cells.log(pixels, frame.full_scale, hidden)

    def _too_bright_or_dark(self, frame: Frame) -> bool:
        ratio = frame.light_ratio if self.compensated else None
        return ratio is not None and np.abs(np.log(ratio)).max() > DRIFT.largest_log_gain

    def _is_rolled(self, frame: Frame) -> bool:
        """Whether a seam crosses the image, and the reference agrees better from there on.

        In either direction, because the camera's rows may be turned.
        """
        for axis, undeformed in enumerate(self._undeformed_lines):
            lines = self._lines_of(frame, axis, undeformed)
            change = lines - undeformed
            line, strength = find_seam(change * np.float32(255 / frame.full_scale))
            if strength > SEAM:
                left = np.median(np.abs(np.roll(lines, -line, axis=0) - undeformed))
                if left < UNDONE * np.median(np.abs(change)):
                    return True
        return False

    def _lines_of(self, frame: Frame, axis: int, undeformed: Array) -> Array:
        """Some pixels of each line, with those of the reference at markers."""
        lines = _some_of_lines(frame.pixels, axis).astype(np.float32)
        for mask in (frame.marker_mask, self.reference.marker_mask):
            if mask is not None:
                np.copyto(lines, undeformed, where=_some_of_lines(mask, axis)[..., None])
        return lines

    @cached_property
    def _undeformed_lines(self) -> tuple[Array, Array]:
        pixels = self.reference.pixels.astype(np.float32)
        return _some_of_lines(pixels, 0), _some_of_lines(pixels, 1)

    def change_of(self, frame: Frame) -> LightChange | None:
        """Return what of a conditioned frame's change no tilt explains; None if that is unknown."""
        change, both = self._appearance.change(*self._cells(frame))
        if self._beyond is None or np.count_nonzero(both) < FEWEST_CELLS:
            return None
        return self.light_change(change, both)

    def drift_in_words(self, frame: Frame) -> str:
        """Say how far the light of a conditioned frame has drifted; empty if unknown."""
        said = []
        if frame.light_ratio is not None:
            low, high = (100 * float(limit(frame.light_ratio)) for limit in (np.min, np.max))
            said.append(f"brightness {low:.0f} to {high:.0f} % of the calibration's")
        found = self.change_of(frame)
        if found is not None and self.light is not None:
            ramp, field, _ = self._limits
            share = max(found.ramp / ramp, found.field / field)
            said.append(f"unevenness {share:.0%} of what is taken for this gel")
        return ", ".join(said)

    def light_change(self, change: Array, both: Bool) -> LightChange:
        """Fit smooth fields to what no tilt explains of a change."""
        left = self._beyond @ change[:, both]

        def fit(order: int) -> tuple[Array, float]:
            basis = self._polynomials[order][:, both]
            coefficients = fit_smooth_field(left, basis, SURFACE_SCALES)
            return coefficients, agreement(left - coefficients @ basis, SURFACE_TOLERANCE)

        _, level = fit(0)
        plane, linear = fit(1)
        smooth, cubic = fit(3)
        slope = plane[:, 1:]
        return LightChange(
            slope,
            ramp_size(self.beyond_drift(slope)),
            _rms(smooth @ self._polynomials[3]),
            level,
            linear,
            cubic,
        )

    def _of_light(self, found: LightChange) -> Cause | None:
        ramp, field, least = self._limits
        changed = found.ramp > ramp or found.field > field
        # [share of the cells] enough, however many a constant leaves
        explained = min(EXPLAINED * (1 - found.level), 0.08)
        if changed and found.cubic > found.level + explained:
            return "one_sided_light" if found.linear > found.cubic - 0.04 else "another_unit"
        return "unknown" if found.cubic < least else None

    def _unsuspicious(self, change: Array) -> bool:
        """Whether one weighted fit shows that a robust one finds nothing: true of most frames."""
        left = self._beyond @ change
        square = np.square(left).max(axis=0) / SURFACE_TOLERANCE**2
        weight = np.maximum(1 - square, 0) ** 2
        ramp, field, least = self._limits
        agreed = float(weight.mean())
        smooth = (left * weight) @ self._projection / max(agreed, least)
        size = float(np.sqrt(np.square(smooth @ self._spread).sum()))
        return agreed > least and size < 0.4 * min(ramp, field)

    @cached_property
    def _limits(self) -> tuple[float, float, float]:
        """Largest ramp and field, and least agreement, of a frame of this gel."""
        light = self.light
        if light is None:
            return 0.05, 0.1, 0.1
        return light.ramp + FLOOR, light.field + FLOOR, 0.4 * light.agreement

    @cached_property
    def _projection(self) -> Array:
        """(N, M): least squares of a field of third order."""
        return np.asarray(np.linalg.pinv(self._polynomials[3]), np.float32)

    @cached_property
    def _spread(self) -> Array:
        """(M, M): maps a field's coefficients to a vector as long as its root mean square."""
        basis = self._polynomials[3]
        centred = basis - basis.mean(axis=1, keepdims=True)
        left, values, _ = np.linalg.svd(centred / np.sqrt(basis.shape[1]), full_matrices=False)
        return np.asarray(left * values, np.float32)

    @cached_property
    def _beyond(self) -> Array | None:
        """(J, K): combinations of channels that no tilt changes."""
        channels = len(self.reference.channels)
        if channels < 3:
            return None
        if self.light is None:
            return np.full((1, channels), channels**-0.5, np.float32)
        left, _, _ = np.linalg.svd(np.array(self.light.response), full_matrices=True)
        return np.ascontiguousarray(left[:, 2:].T, np.float32)

    @cached_property
    def _polynomials(self) -> dict[int, Array]:
        return {order: polynomial(self._appearance.cells.shape, order) for order in (0, 1, 3)}

    def beyond_drift(self, slope: Array) -> Array:
        """Return what of a slope the drift of the calibration, or a part of it, leaves."""
        if self.light is None:
            return slope
        drift = np.array(self.light.drift, np.float32)
        square = float(np.square(drift).sum())
        share = float((slope * drift).sum()) / square if square > 0 else 0.0
        return np.asarray(slope - drift * min(max(share, 0.0), 1.0))


def _some_of_lines(image: NDArray[Any], axis: int) -> NDArray[Any]:
    """Return rows (axis 0) or columns (1) first, with some of the pixels of each."""
    lines = np.moveaxis(image, axis, 0)
    return np.ascontiguousarray(lines[:, :: max(1, lines.shape[1] // SAMPLES)])


def _rms(field: Array) -> float:
    """Root mean square over the image of the length of a field's vectors about their mean."""
    centred = field - field.mean(axis=1, keepdims=True)
    return float(np.sqrt(np.square(centred).sum(axis=0).mean()))


def ramp_size(slope: Array) -> float:
    """Return the root mean square over the image of a linear field with this (J, 2) slope."""
    return float(np.sqrt(np.square(slope).sum() / 3))
