"""What the core's calibration models share: a fitted function from change and place to slope."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.colour_table import Axis, ColourTable, bake, to_sines
from tactile_core.algorithms.slope_field import Model, Sampler, SlopeField
from tactile_core.calibration import Calibration, Press
from tactile_core.errors import CalibrationError
from tactile_core.quantities import Bool, Float32, Frame, Gradients, Reference

MOST_SAMPLES = 12_000
"""More pixels cost time and teach nothing: neighbours in a press are alike."""

FEWEST_SAMPLES = 50
SATURATED_FRACTION = 0.988


class SlopeCalibration(Calibration):
    """A calibration that is a model of (relative change, place) → sines, perhaps with a table.

    Subclasses write ``fit``, ``_arrays`` and ``_from_arrays``.
    """

    USE: ClassVar[str]

    def __init__(
        self, model: Model, table: ColourTable | None, shape: tuple[int, int, int]
    ) -> None:
        self._model, self._table, self._shape = model, table, shape
        self._prepared: tuple[Reference, SlopeField] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_prepared": None}

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Slopes of one frame.

        Raises
        ------
        CalibrationError
            The frame has another size or number of channels than the presses had.
        """
        if frame.pixels.shape != self._shape:
            raise CalibrationError(
                f"the calibration was fitted on images of {_size(self._shape)} and this one is "
                f"{_size(frame.pixels.shape)}; calibrate at the size of the input"
            )
        gx, gy = self._field(reference).measure(frame.pixels, frame.marks)
        return Gradients(gx, gy, _valid(frame), frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        arrays: dict[str, Any] = {"shape": np.array(self._shape), **self._arrays()}
        if self._table is not None:
            axis = self._table.axis
            arrays |= {
                "table": self._table.slopes,
                "table_axis": np.array([axis.per_unit, axis.first]),
            }
        np.savez(directory / "model.npz", **arrays)

    @classmethod
    def load(cls, directory: Path) -> SlopeCalibration:
        """Read ``model.npz``."""
        try:
            with np.load(directory / "model.npz", allow_pickle=False) as data:
                arrays = {name: data[name] for name in data}
            h, w, k = (int(n) for n in arrays["shape"])
            table = None
            if "table" in arrays:
                per_unit, first = arrays["table_axis"]
                axis = Axis(float(per_unit), int(first), len(arrays["table"]))
                table = ColourTable(axis, arrays["table"])
            return cls._from_arrays(arrays, table, (h, w, k))
        except (OSError, ValueError, KeyError) as error:
            raise CalibrationError(
                f"{directory / 'model.npz'} does not hold a {cls.USE} model; calibrate again"
            ) from error

    def _arrays(self) -> dict[str, NDArray[Any]]:
        """The model's arrays, by name."""
        raise NotImplementedError

    @classmethod
    def _from_arrays(
        cls,
        arrays: dict[str, NDArray[Any]],
        table: ColourTable | None,
        shape: tuple[int, int, int],
    ) -> SlopeCalibration:
        """Rebuild what ``_arrays`` gave."""
        raise NotImplementedError

    def _field(self, reference: Reference) -> SlopeField:
        if self._prepared is None or self._prepared[0] is not reference:
            field = SlopeField(
                self._model,
                self._table,
                reference.pixels,
                reference.marks,
                reference.full_scale,
            )
            self._prepared = reference, field
        return self._prepared[1]


def samples_of(
    presses: Sequence[Press], reference: Reference, *, most: int = MOST_SAMPLES, seed: int = 0
) -> tuple[Float32, Float32]:
    """Features (N, K + 2) and sines (N, 2) of the presses' pixels, thinned evenly.

    Raises
    ------
    CalibrationError
        There are too few pixels to fit on, or they all rest.
    """
    sampler = Sampler(reference.pixels, reference.marks, reference.full_scale)
    features, sines = [], []
    rng = np.random.default_rng(seed)
    share = max(1, most // max(1, len(presses)))
    for press in presses:
        pick = rng.permutation(len(press.rows))[:share]
        frame, rows, columns = press.frame, press.rows[pick], press.columns[pick]
        features.append(sampler.features(frame.pixels, frame.marks, rows, columns))
        sines.append(to_sines(press.gradients[pick]))
    if sum(map(len, sines)) < FEWEST_SAMPLES or not any(np.any(s) for s in sines):
        raise CalibrationError(
            f"{len(presses)} presses hold too few pixels to fit on; record more presses, or larger "
            f"ones"
        )
    return np.concatenate(features), np.concatenate(sines)


def baked(model: Model, features: Float32) -> ColourTable | None:
    """Table of a model for the colours that were seen; None unless there are three channels."""
    if features.shape[1] != 5:
        return None
    return bake(model, Axis.spanning(features[:, :3]))


def shape_of(presses: Sequence[Press]) -> tuple[int, int, int]:
    """(H, W, K) of the presses' frames."""
    h, w, k = presses[0].frame.pixels.shape
    return h, w, k


def _valid(frame: Frame) -> Bool:
    """Where no channel is saturated and no mark hides the skin."""
    valid: Bool = np.ones(frame.pixels.shape[:2], np.bool_)
    ceiling = SATURATED_FRACTION * frame.full_scale
    # The brightest value is found ten times faster than where it is, and is rarely full.
    if cv2.minMaxLoc(frame.pixels.reshape(len(frame.pixels), -1))[1] >= ceiling:
        valid &= (frame.pixels < ceiling).all(axis=2)
    if frame.marks is not None:
        valid &= ~frame.marks
    return valid


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} × {shape[0]} with {shape[2]} channels"
