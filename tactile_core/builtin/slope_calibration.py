"""What the core's calibration models share: a fitted function from change and place to slope."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tactile_core.algorithms.colour_table import Axis, ColourTable
from tactile_core.algorithms.intensity import CEILING, FLOOR
from tactile_core.algorithms.photometric import skin_of
from tactile_core.algorithms.slope_field import Model, SlopeField
from tactile_core.algorithms.validity import two_within
from tactile_core.builtin.image_shape import ImageShape, check_fitting
from tactile_core.builtin.model_file import Arrays, stored_model, write_model
from tactile_core.interfaces import device
from tactile_core.interfaces.calibration import Calibration
from tactile_core.quantities import Bool, Float32, Frame, Gradients, Reference


class SlopeOptions(device.Options):
    """Options of every model that reads slopes from light."""

    blur_px: float = Field(
        default=2.0,
        ge=0,
        le=20,
        description="Smoothing against the grain of the coating, standard deviation.",
    )
    blur_mm: float | None = Field(
        default=None, ge=0, description="The same on the gel, for cameras of other scales."
    )

    @model_validator(mode="after")
    def _one_blur(self) -> Self:
        if {"blur_px", "blur_mm"} <= self.model_fields_set and self.blur_mm is not None:
            raise ValueError("give blur_px or blur_mm, not both")
        return self

    def blur_at(self, mm_per_px: float) -> float:
        """Standard deviation in px of an image of this scale, 20 at the most."""
        return self.blur_px if self.blur_mm is None else min(20.0, self.blur_mm / mm_per_px)


class Prepared(Protocol):
    """A model prepared for one reference."""

    def measure(
        self, pixels: NDArray[Any], marks: Bool | None
    ) -> tuple[Float32, Float32, Bool | None]:
        """Slopes along x and y of (H, W, K) pixels, and where they are sure, if that is known."""
        ...


class SlopeCalibration(Calibration):
    """A calibration that is a model of (relative change, place) → sines, perhaps with a table.

    Subclasses write ``fit``, ``_arrays`` and ``_model_from``, and ``_prepare`` where they have a
    faster way over a whole image.
    """

    USE: ClassVar[str]

    def __init__(
        self,
        model: Model,
        table: ColourTable | None,
        shape: ImageShape,
        blur_px: float,
    ) -> None:
        self._model, self._table = model, table
        self._shape, self._blur_px = shape, blur_px
        self._prepared: tuple[Reference, Prepared] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_prepared": None}

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Slopes of one frame.

        A slope is valid where no mark hides the skin and two channels are neither saturated nor
        dark: it has two components, and such a channel only bounds them.

        Raises
        ------
        CalibrationError
            The frame or the reference has another size or number of channels than the presses had,
            or they have another full scale than each other.
        """
        check_fitting(frame, reference, self._shape)
        if self._prepared is None or self._prepared[0] is not reference:
            self._prepared = reference, self._prepare(reference)
        gx, gy, sure = self._prepared[1].measure(frame.pixels, frame.marks)
        valid = _measurable(frame)
        if sure is not None:
            valid &= sure
        return Gradients(gx, gy, valid, frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        arrays: dict[str, Any] = {"blur_px": np.array(self._blur_px), **self._arrays()}
        if self._table is not None:
            axis = self._table.axis
            arrays |= {
                "table": self._table.sines,
                "table_axis": np.array([axis.per_unit, axis.first]),
                "table_points": np.array(self._table.points),
            }
        write_model(directory, self._shape, arrays)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            It is missing, broken or of another model.
        """
        with stored_model(directory, cls.USE) as (shape, arrays):
            blur_px = float(arrays["blur_px"])
            if not 0 <= blur_px <= max(shape[:2]):
                raise ValueError("no image is smoothed so")
            table = _table_from(arrays) if "table" in arrays else None
            model = cls._model_from(arrays, table)
            if not np.isfinite(model(np.zeros((1, shape[2] + 2), np.float32))).all():
                raise ValueError("the model gives no numbers")
        return cls(model, table, shape, blur_px)

    def _arrays(self) -> dict[str, NDArray[Any]]:
        """The model's arrays, by name."""
        raise NotImplementedError

    @classmethod
    def _model_from(cls, arrays: Arrays, table: ColourTable | None) -> Model:
        """Rebuild what ``_arrays`` gave."""
        raise NotImplementedError

    def _prepare(self, reference: Reference) -> Prepared:
        """What measures whole images against one reference."""
        return slope_field(self._model, self._table, reference, self._blur_px)


def slope_field(
    model: Model, table: ColourTable | None, reference: Reference, blur_px: float
) -> SlopeField:
    """Prepare a model for one reference."""
    return SlopeField(
        model,
        table,
        reference.pixels,
        reference.marks,
        full_scale=reference.full_scale,
        blur_px=blur_px,
    )


def _table_from(arrays: Arrays) -> ColourTable:
    per_unit, first = arrays["table_axis"]
    sines = np.asarray(arrays["table"], np.complex64)
    if sines.ndim != 3 or len(set(sines.shape)) != 1:
        raise ValueError("a table is a cube")
    axis = Axis(float(per_unit), int(first), len(sines))
    return ColourTable(axis, sines, int(arrays["table_points"]))


def _measurable(frame: Frame) -> Bool:
    """Where two channels are neither saturated nor dark, and no mark hides the skin."""
    valid = two_within(frame.pixels, FLOOR * frame.full_scale, CEILING * frame.full_scale)
    if frame.marks is not None:
        valid &= skin_of(frame.marks)
    return valid.view(np.bool_)
