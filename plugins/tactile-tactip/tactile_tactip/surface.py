"""``tactip.surface``: distance and angle of the surface that the pins show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import FieldSpec, MarkerField, Quantity, TimestampS
from tactile_tactip.regression import PinRegression, fit_regression

LEAST_SEEN = 0.9  # [share of the pins] With fewer, the pose of the surface is not measured

_FILE = "surface.npz"


@dataclass(frozen=True, eq=False)
class SurfacePose(Quantity):
    """Distance and angle of a surface, in the frame of the labels of the unit's calibration.

    Attributes
    ----------
    distance_mm, angle_deg : float
        Axis, sign and zero are those of the labels.
    distance_std_mm, angle_std_deg : float
        Standard deviations.
    notes : tuple of str
        Messages to the user about this frame.
    """

    distance_mm: Annotated[float, FieldSpec("mm")]
    distance_std_mm: Annotated[float, FieldSpec("mm", std_of="SurfacePose.distance_mm")]
    angle_deg: Annotated[float, FieldSpec("deg")]
    angle_std_deg: Annotated[float, FieldSpec("deg", std_of="SurfacePose.angle_deg")]
    timestamp_s: TimestampS = 0.0
    notes: tuple[str, ...] = field(default=())

    def summary(self) -> Mapping[str, Any]:
        """Return the entry ``surface``."""
        return {
            "surface": {
                "distance_mm": self.distance_mm,
                "distance_std_mm": self.distance_std_mm,
                "angle_deg": self.angle_deg,
                "angle_std_deg": self.angle_std_deg,
            }
        }

    def text(self) -> str:
        """Return both with their deviations."""
        return (
            f"distance {self.distance_mm:.3f} ± {self.distance_std_mm:.3f} mm, "
            f"angle {self.angle_deg:.2f} ± {self.angle_std_deg:.2f}°"
        )

    def warnings(self) -> tuple[str, ...]:
        """Return the notes."""
        return self.notes


@dataclass(frozen=True, eq=False)
class SurfaceModel(Quantity, Artefact):
    """Distance and angle of a surface as functions of the displacement of the pins.

    Attributes
    ----------
    pins_px : (N, 2) float64
        The pins of the undeformed sensor, which say which pin is which.
    regression : PinRegression
        Of distance in mm and angle in degrees.
    """

    noun: ClassVar[str] = "surface model"
    command: ClassVar[str] = "calibrate-surface"

    pins_px: Annotated[Float64, FieldSpec("px", ("pin", "xy"))]
    regression: PinRegression

    def __post_init__(self) -> None:
        super().__post_init__()
        numbers = self.regression.values.shape[1]
        if self.pins_px.shape != (len(self.regression.mean) // 2, 2) or numbers != 2:
            raise ValueError("the regression is of other pins or of other numbers")

    @classmethod
    def fit(cls, pins_px: Float64, moved_px: Float64, poses: Float64) -> Self:
        """Fit a model to the displacements (M, N, 2) of M presses and their poses (M, 2).

        Raises
        ------
        CalibrationError
            The presses do not determine the model.
        """
        return cls(pins_px, fit_regression(moved_px.reshape(len(moved_px), -1), poses))

    def poses(self, moved_px: Float64) -> tuple[Float64, Float64]:
        """Return distance and angle (M, 2) of displacements (M, N, 2), and their deviations."""
        return self.regression.predict(moved_px.reshape(len(moved_px), -1))

    def save(self, directory: Path) -> None:
        """Write ``surface.npz``."""
        write_npz(directory / _FILE, {"pins_px": self.pins_px, **self.regression.arrays()})

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``surface.npz``.

        Raises
        ------
        CalibrationError
            The file is missing or damaged.
        """
        path = directory / _FILE
        try:
            arrays = read_npz(path)
            pins_px = np.asarray(arrays["pins_px"], np.float64)
            return cls(pins_px, PinRegression.from_arrays(arrays))
        except (InputError, ValueError, LookupError, TypeError) as error:
            raise CalibrationError(
                f"{path} does not hold a surface model; run 'tactile calibrate-surface' again"
            ) from error


class SurfaceEstimator(Estimator):
    """Measure distance and angle of a flat surface, by a model that labelled presses fitted."""

    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._order = _PinOrder(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, np.intp))

    def estimate(self, model: SurfaceModel, markers: MarkerField) -> SurfacePose:
        """Return the pose; where too few pins are seen, the mean and the spread of the labels.

        Raises
        ------
        InputError
            The model was fitted to other pins.
        """
        seen = int(np.count_nonzero(markers.seen))
        if seen < LEAST_SEEN * len(markers.seen):
            regression = model.regression
            values, std = regression.centre, regression.scale
            notes: tuple[str, ...] = (
                f"{seen} of {len(markers.seen)} pins are too few to measure the surface, so "
                f"distance and angle are the mean of the labels",
            )
        else:
            moved_px = moved_pins(markers)[self._order_of(model, markers)]
            (values,), (std,) = model.poses(moved_px[None])
            notes = _beyond_labels(model, values, std)
        distance, angle = map(float, values)
        distance_std, angle_std = map(float, std)
        return SurfacePose(distance, distance_std, angle, angle_std, markers.timestamp_s, notes)

    def _order_of(self, model: SurfaceModel, markers: MarkerField) -> Any:
        kept = self._order
        if kept.model_px is not model.pins_px or not np.array_equal(kept.px, markers.reference_px):
            index = order_of_pins(model.pins_px, markers.reference_px.astype(np.float64))
            self._order = kept = _PinOrder(model.pins_px, markers.reference_px, index)
        return kept.index


def _beyond_labels(model: SurfaceModel, values: Float64, std: Float64) -> tuple[str, ...]:
    """Say which number is further from all labels than its deviation."""
    names = ("distance", "mm"), ("angle", "°")
    return tuple(
        f"the {name} is {value:.1f} {unit} and the labels end at {low:.1f} and {high:.1f} {unit}, "
        f"beyond which it errs by more than its deviation; label presses there, too"
        for (name, unit), value, one, low, high in zip(
            names, values, std, *model.regression.extremes, strict=True
        )
        if value < low - one or value > high + one
    )


@dataclass(frozen=True, eq=False)
class _PinOrder:
    """Which of the reference's pins is which of the model's."""

    model_px: Float64
    px: Any
    index: Any


def moved_pins(markers: MarkerField) -> Float64:
    """(N, 2) displacement of each pin from the undeformed sensor, px."""
    return markers.px.astype(np.float64) - markers.reference_px


def order_of_pins(wanted_px: Float64, px: Float64) -> Any:
    """Return the index (N,) of the pin that is nearest to each wanted place.

    Raises
    ------
    InputError
        These are other pins, or they are elsewhere.
    """
    from scipy.spatial import KDTree

    index = KDTree(px).query(wanted_px)[1] if len(px) == len(wanted_px) else np.zeros(0, np.intp)
    if len(np.unique(index)) < len(wanted_px):
        raise InputError(
            f"the surface model was fitted to {len(wanted_px)} pins, and the {len(px)} of this "
            f"reference are elsewhere; run 'tactile calibrate-surface' for this unit"
        )
    return index
