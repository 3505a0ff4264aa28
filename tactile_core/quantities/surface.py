"""Shape of the gel surface: slopes, heights and the contact area."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from tactile_core.algorithms.arrays.types import Bool, Float32, from_middle
from tactile_core.quantities.fields import FieldSpec, Layer, MmPerPx, Outline, Surface, TimestampS
from tactile_core.quantities.quantity import Quantity, grid_of, none

_YX = ("y", "x")


@dataclass(frozen=True, eq=False)
class Gradients(Quantity):
    """Slopes of the height map, dimensionless (mm per mm).

    Like heights, slopes are relative to the undeformed surface: on a domed gel the slopes of the
    dome are subtracted.

    Attributes
    ----------
    x, y : (H, W) float32
        ∂z/∂x (x right) and ∂z/∂y (y down) of :class:`HeightMap`.
    valid : (H, W) bool
        False where the value is filled in (markers, saturation).
    std_cells : (h, w) float32 or None
        Standard deviation of a component, one value per cell; equal cells tile the image. None if
        the calibration was not scored.
    gain_std : float or None
        Relative standard deviation of a factor that all slopes of a frame have in common.
    correlation_mm : float or None
        Errors of slopes are correlated within this distance.
    calibrated_slope : float or None
        Steepest slope that presses of the calibration have tested.
    """

    x: Annotated[Float32, FieldSpec("mm/mm", _YX, saved_as="gradients")]
    y: Annotated[Float32, FieldSpec("mm/mm", _YX, saved_as="gradients")]
    valid: Annotated[Bool, FieldSpec(axes=_YX, saved_as="gradients_valid", validity=True)]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0
    std_cells: Annotated[
        Float32 | None,
        FieldSpec("mm/mm", _YX, saved_as="gradients_std", std_of="gradients", coarse=True),
    ] = field(default_factory=none)
    gain_std: Annotated[float | None, FieldSpec(saved_as="gradients_gain_std")] = None
    correlation_mm: Annotated[
        float | None, FieldSpec("mm", saved_as="gradients_correlation_mm")
    ] = None
    calibrated_slope: Annotated[float | None, FieldSpec("mm/mm", saved_as="calibrated_slope")] = (
        None
    )

    @property
    def std(self) -> Float32 | None:
        """(H, W) standard deviation of a component of the slope; None if it is unknown."""
        return None if self.std_cells is None else np.asarray(self.full("std_cells"), np.float32)

    @property
    def normals(self) -> Float32:
        """(H, W, 3) unit normals of the height map, +z towards the viewer (the camera)."""
        n = np.dstack([-self.x, -self.y, np.ones_like(self.x)])
        return np.asarray(n / np.linalg.norm(n, axis=2, keepdims=True), np.float32)

    def layers(self) -> tuple[Layer, ...]:
        """Return no layers: the shading of the height map shows the slopes."""
        return ()

    def warnings(self) -> tuple[str, ...]:
        """Return that walls are steeper than any slope of the calibration."""
        if self.calibrated_slope is None:
            return ()
        # [pixels] every fourth is enough for shares
        slope = np.hypot(*(grid_of(self, name).cells[::2, ::2] for name in ("x", "y")))
        # [slope] flatter pixels are hardly pressed; [ratio] beyond the error of a slope
        walls = np.count_nonzero(slope > 0.1)
        beyond = np.count_nonzero(slope > 1.15 * self.calibrated_slope)
        # [share of the walls] the rim of a ball, as deep as in the calibration, is up to 24 %
        if beyond <= 0.25 * walls:
            return ()
        limit_deg = math.degrees(math.atan(self.calibrated_slope))
        return (
            f"{beyond / walls:.0%} of the walls are steeper than the {limit_deg:.0f}° that the "
            f"calibration has seen, so their height is extrapolated; calibrate with a smaller ball "
            f"or deeper presses",
        )


@dataclass(frozen=True, eq=False)
class ReferenceGradients(Quantity):
    """Slopes that a calibration measures on the reference: its errors where nothing touches.

    The pipeline provides them to steps that take them; they are no part of a reading.

    Attributes
    ----------
    x, y : (H, W) float32
        ∂z/∂x and ∂z/∂y, dimensionless.
    """

    x: Annotated[Float32, FieldSpec("mm/mm", _YX)]
    y: Annotated[Float32, FieldSpec("mm/mm", _YX)]


@dataclass(frozen=True, eq=False)
class HeightMap(Quantity):
    """Height of the gel surface above its undeformed shape, towards the camera.

    Attributes
    ----------
    mm : (H, W) float32
        Height in mm; positive where the gel is indented, 0 where it is undeformed, for flat and
        domed gels.
    valid : (H, W) bool
        False where the slopes were filled in.
    rest_mm : (H, W) float32 or None
        z of the undeformed surface in the sensor frame, 0 at a dome's apex; None for a flat gel.
    std_cells_mm : (h, w) float32 or None
        Standard deviation of the height, one value per cell; equal cells tile the image. None if
        that of the slopes is unknown.
    """

    mm: Annotated[Float32, FieldSpec("mm", _YX, saved_as="height_mm")]
    valid: Annotated[Bool, FieldSpec(axes=_YX, saved_as="valid", validity=True)]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0
    rest_mm: Annotated[Float32 | None, FieldSpec("mm", _YX, saved_as="rest_mm")] = None
    std_cells_mm: Annotated[
        Float32 | None,
        FieldSpec("mm", _YX, saved_as="height_std_mm", std_of="height_mm", coarse=True),
    ] = field(default_factory=none)

    @property
    def std_mm(self) -> Float32 | None:
        """(H, W) standard deviation of the height; None if it is unknown."""
        if self.std_cells_mm is None:
            return None
        return np.asarray(self.full("std_cells_mm"), np.float32)

    @property
    def points_mm(self) -> Float32:
        """(H, W, 3) points of the gel surface in the sensor frame: x, y and z = rest − height."""
        y, x = (from_middle(n) * self.mm_per_px for n in self.mm.shape)
        points = np.empty((*self.mm.shape, 3), np.float32)
        points[..., 0] = x
        points[..., 1] = y[:, None]
        points[..., 2] = -self.mm if self.rest_mm is None else self.rest_mm - self.mm
        return points

    def layers(self) -> tuple[Layer, ...]:
        """Return the surface."""
        return (Surface(self.mm, self.mm_per_px),)

    def summary(self) -> Mapping[str, Any]:
        """Return the largest height."""
        return {"max_height_mm": float(self.mm.max())}


@dataclass(frozen=True, eq=False)
class ContactMask(Quantity):
    """The contact area.

    Attributes
    ----------
    mask : (H, W) bool
        True where the object touches the gel.
    """

    mask: Annotated[Bool, FieldSpec(axes=_YX, saved_as="contact")]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0

    @property
    def area_mm2(self) -> float:
        """Contact area in mm²."""
        return float(np.count_nonzero(self.mask)) * self.mm_per_px**2

    def layers(self) -> tuple[Layer, ...]:
        """Return the outline of the contact."""
        return (Outline(self.mask, "contact"),)

    def summary(self) -> Mapping[str, Any]:
        """Return the contact area."""
        return {"contact_area_mm2": self.area_mm2}

    def warnings(self) -> tuple[str, ...]:
        """Return that no undeformed gel is left, relative to which anything was measured."""
        covered = np.count_nonzero(self.mask) / self.mask.size
        if covered <= 0.9:  # [share of the view] Plates that fill it leave more at rest
            return ()
        return (
            f"the contact covers {covered:.0%} of the view, which leaves no undeformed gel to "
            f"measure from; press on a smaller area, or check that the reference is of this gel",
        )
