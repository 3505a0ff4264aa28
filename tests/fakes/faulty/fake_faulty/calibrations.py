"""A sound linear model, and others that each do one thing wrong."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.algorithms.poisson import integrate
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration, Calibrator
from tactile_core.quantities import Frame, Gradients, HeightMap


class Linear(Calibration):
    """Slopes as a linear function of the relative change of the channels."""

    def __init__(self, weights: Any, shape: tuple[int, ...]) -> None:
        self.weights, self.shape = weights, shape

    @staticmethod
    def features(frame: Frame, reference: Any) -> Any:
        return (frame.pixels / reference.pixels - 1).astype(np.float32)

    def slopes(self, frame: Frame, reference: Any) -> Any:
        return self.features(frame, reference) @ self.weights

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


class Nameless(Linear):
    """Registered by no plugin."""


class Uncompensated(Linear):
    compensation = "none"


class Deep(Linear):
    """Height as a linear function of the channels' changes, integrated along x and along y."""

    @staticmethod
    def features(frame: Frame, reference: Any) -> Any:
        parts = []
        for change in np.moveaxis(Linear.features(frame, reference), -1, 0):
            for slopes in ((change, 0 * change), (0 * change, change)):
                height = integrate(*slopes, mm_per_px=frame.mm_per_px)
                parts.append(height - np.median(height))
        return np.stack(parts, axis=-1)

    def measure(self, frame: Frame, reference: Any) -> Any:
        self.check(frame)
        mm = self.heights(self.slopes(frame, reference)[..., 0].copy())
        return HeightMap(mm, mm == mm, frame.mm_per_px, frame.timestamp_s)

    def heights(self, mm: Any) -> Any:
        return mm


class Sunken(Deep):
    def heights(self, mm: Any) -> Any:
        return mm + np.float32(5)


class Metres(Deep):
    def heights(self, mm: Any) -> Any:
        return mm / 1000


class LinearCalibrator(Calibrator):
    """Fits a linear model, by least squares."""

    model: type[Linear] = Linear

    def fit(self, presses: Any, reference: Any) -> Any:
        rows = [self.model.features(p.frame, reference)[p.rows, p.columns] for p in presses]
        known = np.concatenate([self.known(p) for p in presses])
        weights = np.linalg.lstsq(np.concatenate(rows), known, rcond=None)[0]
        return self.model(weights.astype(np.float32), reference.pixels.shape)

    def known(self, press: Any) -> Any:
        return press.gradients


class DeepCalibrator(LinearCalibrator):
    model = Deep

    def known(self, press: Any) -> Any:
        return press.heights_mm[:, None]


class Unfittable(LinearCalibrator):
    def fit(self, presses: Any, reference: Any) -> Any:
        raise CalibrationError("too few presses")


class Unseeded(LinearCalibrator):
    def fit(self, presses: Any, reference: Any) -> Any:
        fitted = super().fit(presses, reference)
        fitted.weights += np.random.default_rng().normal(0, 1e-3, fitted.weights.shape)
        return fitted


def calibrator_of(model: type[Linear]) -> type[LinearCalibrator]:
    """A calibrator that fits this model."""
    base = DeepCalibrator if issubclass(model, Deep) else LinearCalibrator
    return type(f"{model.__name__}Calibrator", (base,), {"model": model})


DoublesCalibrator = calibrator_of(Doubles)
GapsCalibrator = calibrator_of(Gaps)
DentedCalibrator = calibrator_of(Dented)
ExchangedCalibrator = calibrator_of(Exchanged)
DegreesCalibrator = calibrator_of(Degrees)
TiltedCalibrator = calibrator_of(Tilted)
RoundedCalibrator = calibrator_of(Rounded)
LoadsNothingCalibrator = calibrator_of(LoadsNothing)
AnySizeCalibrator = calibrator_of(AnySize)
ChangesFrameCalibrator = calibrator_of(ChangesFrame)
LockedCalibrator = calibrator_of(Locked)
NamelessCalibrator = calibrator_of(Nameless)
UncompensatedCalibrator = calibrator_of(Uncompensated)
SunkenCalibrator = calibrator_of(Sunken)
MetresCalibrator = calibrator_of(Metres)
