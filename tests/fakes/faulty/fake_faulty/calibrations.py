"""A sound linear model, and others that each do one thing wrong."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration
from tactile_core.quantities import Frame, Gradients


class Linear(Calibration):
    """Slopes as a linear function of the relative change of the channels."""

    def __init__(self, weights: Any, shape: tuple[int, ...]) -> None:
        self.weights, self.shape = weights, shape

    @classmethod
    def fit(cls, samples: Any, reference: Any, options: Any) -> Any:
        rows = [
            (p.frame.pixels / reference.pixels - 1)[p.rows, p.columns].astype(np.float32)
            for p in samples
        ]
        slopes = np.concatenate([p.gradients for p in samples])
        weights = np.linalg.lstsq(np.concatenate(rows), slopes, rcond=None)[0]
        return cls(weights.astype(np.float32), reference.pixels.shape)

    def slopes(self, frame: Frame, reference: Any) -> Any:
        return ((frame.pixels / reference.pixels - 1) @ self.weights).astype(np.float32)

    def check(self, frame: Frame) -> None:
        if frame.pixels.shape != self.shape:
            raise CalibrationError("this frame has another size than the presses had")

    def measure(self, frame: Frame, reference: Any) -> Any:
        self.check(frame)
        x, y = np.moveaxis(self.slopes(frame, reference), -1, 0)
        sure = np.ones(x.shape, np.bool_)
        return Gradients(x, y, sure, frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        np.savez(directory / "linear.npz", weights=self.weights, shape=self.shape)

    @classmethod
    def load(cls, directory: Path) -> Any:
        try:
            with np.load(directory / "linear.npz") as data:
                return cls(data["weights"], tuple(int(n) for n in data["shape"]))
        except OSError as error:
            raise CalibrationError(f"{directory} holds no linear model") from error


class Unfittable(Linear):
    @classmethod
    def fit(cls, samples: Any, reference: Any, options: Any) -> Any:
        raise CalibrationError("too few presses")


class Unseeded(Linear):
    @classmethod
    def fit(cls, samples: Any, reference: Any, options: Any) -> Any:
        fitted = super().fit(samples, reference, options)
        fitted.weights += np.random.default_rng().normal(0, 1e-3, fitted.weights.shape)
        return fitted


class Doubles(Linear):
    def slopes(self, frame: Frame, reference: Any) -> Any:
        return super().slopes(frame, reference).astype(np.float64)


class Gaps(Linear):
    def slopes(self, frame: Frame, reference: Any) -> Any:
        slopes = super().slopes(frame, reference)
        slopes[0, 0] = np.nan
        return slopes


class Dented(Linear):
    def slopes(self, frame: Frame, reference: Any) -> Any:
        return -super().slopes(frame, reference)


class Exchanged(Linear):
    def slopes(self, frame: Frame, reference: Any) -> Any:
        return super().slopes(frame, reference)[..., ::-1]


class Degrees(Linear):
    def slopes(self, frame: Frame, reference: Any) -> Any:
        return np.degrees(super().slopes(frame, reference))


class Tilted(Linear):
    def slopes(self, frame: Frame, reference: Any) -> Any:
        return super().slopes(frame, reference) + np.float32(0.15)


class Rounded(Linear):
    def save(self, directory: Path) -> None:
        np.savez(directory / "linear.npz", weights=np.round(self.weights, 2), shape=self.shape)


class LoadsNothing(Linear):
    @classmethod
    def load(cls, directory: Path) -> Any:
        with np.load(directory / "linear.npz") as data:
            return cls(data["weights"], tuple(int(n) for n in data["shape"]))


class AnySize(Linear):
    def check(self, frame: Frame) -> None:
        pass


class ChangesFrame(Linear):
    def slopes(self, frame: Frame, reference: Any) -> Any:
        slopes = super().slopes(frame, reference)
        if frame.pixels.base is not None:
            frame.pixels.base[:2] = 0
        return slopes


class Locked(Linear):
    def __init__(self, weights: Any, shape: tuple[int, ...]) -> None:
        super().__init__(weights, shape)
        self.lock = threading.Lock()
