"""What the core's calibration models share: a fitted function from change and place to slope."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tactile_core import device
from tactile_core.algorithms.colour_table import Axis, ColourTable, bake
from tactile_core.algorithms.intensity import CEILING, FLOOR
from tactile_core.algorithms.photometric import skin_of
from tactile_core.algorithms.sines import to_sines
from tactile_core.algorithms.slope_field import Model, Sampler, SlopeField, takes_table
from tactile_core.algorithms.validity import two_within
from tactile_core.calibration import Calibration, Press
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz
from tactile_core.quantities import Bool, Float32, Frame, Gradients, Reference

MOST_SAMPLES = 12_000
"""More pixels cost time and teach nothing: neighbours in a press are alike."""

FEWEST_SAMPLES = 50
POINTS = (1_200, 4_800, 19_200)
"""Points of the coarse grid that are tried, one after another."""

FAITHFUL_SINE = 0.0175
"""Largest mean distance of table and model, 1°: half of what the best models err."""

_PRESSES_COMPARED = 4

Arrays = Mapping[str, NDArray[Any]]


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
        shape: tuple[int, int, int],
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
        arrays: dict[str, Any] = {
            "shape": np.array(self._shape),
            "blur_px": np.array(self._blur_px),
            **self._arrays(),
        }
        if self._table is not None:
            axis = self._table.axis
            arrays |= {
                "table": self._table.sines,
                "table_axis": np.array([axis.per_unit, axis.first]),
                "table_points": np.array(self._table.points),
            }
        np.savez(directory / "model.npz", **arrays)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            It is missing, broken or of another model.
        """
        path = directory / "model.npz"
        try:
            arrays = read_npz(path)
            height, width, channels = (int(n) for n in arrays["shape"])
            blur_px = float(arrays["blur_px"])
            if min(height, width, channels) < 1 or not 0 <= blur_px <= max(height, width):
                raise ValueError("no image has such a size, or is smoothed so")
            table = _table_from(arrays) if "table" in arrays else None
            model = cls._model_from(arrays, table)
            if not np.isfinite(model(np.zeros((1, channels + 2), np.float32))).all():
                raise ValueError("the model gives no numbers")
        except (InputError, ValueError, LookupError, TypeError, OverflowError) as error:
            raise CalibrationError(
                f"{path} does not hold a {cls.USE} model; calibrate again"
            ) from error
        return cls(model, table, (height, width, channels), blur_px)

    def _arrays(self) -> dict[str, NDArray[Any]]:
        """The model's arrays, by name."""
        raise NotImplementedError

    @classmethod
    def _model_from(cls, arrays: Arrays, table: ColourTable | None) -> Model:
        """Rebuild what ``_arrays`` gave."""
        raise NotImplementedError

    def _prepare(self, reference: Reference) -> Prepared:
        """What measures whole images against one reference."""
        return SlopeField(
            self._model,
            self._table,
            reference.pixels,
            reference.marks,
            full_scale=reference.full_scale,
            blur_px=self._blur_px,
        )


def blur_of(options: SlopeOptions, samples: Sequence[Press]) -> float:
    """Smoothing in px at the scale of the presses."""
    return options.blur_at(samples[0].frame.mm_per_px) if samples else options.blur_px


def samples_of(
    presses: Sequence[Press],
    reference: Reference,
    *,
    blur_px: float,
    most: int = MOST_SAMPLES,
    seed: int = 0,
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
    sampler = Sampler(
        reference.pixels, reference.marks, full_scale=reference.full_scale, blur_px=blur_px
    )
    features, sines = [], []
    rng = np.random.default_rng(seed)
    share = max(1, most // max(1, len(presses)))
    for press in presses:
        frame = press.frame
        if frame.pixels.shape != reference.pixels.shape:
            raise CalibrationError(
                f"press {press.name!r} is {_size(frame.pixels.shape)} and the reference "
                f"{_size(reference.pixels.shape)}; record both alike"
            )
        pick = rng.permutation(len(press.rows))[:share]
        rows, columns = press.rows[pick], press.columns[pick]
        features.append(sampler.features(frame.pixels, frame.marks, rows, columns))
        sines.append(to_sines(press.gradients[pick]))
    if sum(map(len, sines)) < FEWEST_SAMPLES or not any(np.any(s) for s in sines):
        raise CalibrationError(
            f"{len(presses)} presses hold too few pixels to fit on; record more presses, or larger "
            f"ones"
        )
    return np.concatenate(features), np.concatenate(sines)


def baked(
    model: Model,
    features: Float32,
    presses: Sequence[Press],
    reference: Reference,
    blur_px: float,
) -> ColourTable | None:
    """Table of a model for the colours that were seen; None where none is needed."""
    height, width, channels = reference.pixels.shape
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
    sampler = Sampler(
        reference.pixels, reference.marks, full_scale=reference.full_scale, blur_px=blur_px
    )
    some = presses[:: max(1, len(presses) // _PRESSES_COMPARED)][:_PRESSES_COMPARED]
    for points in POINTS:
        candidate = replace(table, points=points)
        field = SlopeField(
            model,
            candidate,
            reference.pixels,
            reference.marks,
            full_scale=reference.full_scale,
            blur_px=blur_px,
        )
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


def check_fitting(frame: Frame, reference: Reference, shape: tuple[int, int, int]) -> None:
    """Refuse a frame or a reference that a model of (H, W, K) images was not fitted for.

    Raises
    ------
    CalibrationError
        One has another size or number of channels, or they have another full scale than each other.
    """
    for what, pixels in (("frame", frame.pixels), ("reference", reference.pixels)):
        if pixels.shape != shape:
            raise CalibrationError(
                f"the calibration was fitted on images of {_size(shape)} and this {what} "
                f"is {_size(pixels.shape)}; calibrate at the size of the input"
            )
    if frame.full_scale != reference.full_scale:
        raise CalibrationError(
            f"the frame's full scale is {frame.full_scale:g} and the reference's "
            f"{reference.full_scale:g}; record both with the same bit depth"
        )


def shape_of(reference: Reference) -> tuple[int, int, int]:
    """(H, W, K) of the images that are measured."""
    height, width, channels = reference.pixels.shape
    return height, width, channels


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


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} × {shape[0]} with {shape[2]} channels"
