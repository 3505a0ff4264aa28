"""Parts of a sensor that each do one deed, at the moment that their options name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import BaseModel, field_validator

from fake_unruly.deeds import do
from tactile_core.interfaces.calibration import Calibration, Calibrator, Press
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import Estimator
from tactile_core.interfaces.illumination import Exposure, Illumination, Light
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.quantities import Frame, Gradients, HeightMap, Image, Quantity, Reference

SHAPE = 6, 8


class Deed(Options):
    """``does`` it ``when``."""

    does: str = ""
    when: str = ""

    @field_validator("does")
    @classmethod
    def _is_judged(cls, does: str) -> str:
        if does == "bad validator":
            raise KeyError(does)
        return does


class _Unruly:
    Options: ClassVar[type[BaseModel]] = Deed
    options: Any

    def at(self, moment: str) -> str:
        """Do the deed if this is the moment; return what it is."""
        if self.options.when in ("", moment):
            do(self.options.does)
            return str(self.options.does)
        return ""


class UnrulyCamera(_Unruly, Camera):
    def _open(self) -> None:
        self.at("open")

    def _close(self) -> None:
        if self.options.when == "close":
            self.at("close")

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        return None if self.at("arm") == "nothing" else super()._arm(exposures)  # type: ignore[return-value]

    def _read(self, timeout_s: float) -> Image:
        deed = self.at("read")
        pixels = np.full((*SHAPE, 3), 100, np.uint8)
        if deed == "floats":
            return Image(pixels.astype(np.float64))
        if deed == "another exposure":
            return Image(pixels, exposure_index=3)
        return [pixels] if deed == "a list" else Image(pixels)  # type: ignore[return-value]


class UnrulyLights(_Unruly, Illumination):
    def __init__(self, options: BaseModel) -> None:
        super().__init__(options)
        self.at("made")

    @property
    def channels(self) -> tuple[str, ...]:
        return ("red", "green", "blue")

    @property
    def lights(self) -> tuple[Light, ...]:
        deed = self.at("lights")
        return ("above", "below") if deed == "words" else ()  # type: ignore[return-value]

    def exposures(self) -> tuple[Exposure, ...]:
        if self.options.does == "no exposure":
            return ()
        if self.options.does == "words for exposures":
            return "one by one"  # type: ignore[return-value]
        return (Exposure({"all": 1.0}, self.channels),)


class UnrulyBox(_Unruly, LightDriver):
    def __init__(self, options: BaseModel) -> None:
        super().__init__(options)
        self.at("made")

    def attach(self, camera: Camera) -> None:
        self.at("attach")

    def _open(self) -> None:
        self.at("open")

    def _close(self) -> None:
        if self.options.when == "close":
            self.at("close")

    def _set(self, levels: Mapping[str, float]) -> None:
        self.at("set")


class UnrulyCalibration(_Unruly, Calibration):
    def __init__(self, options: BaseModel) -> None:
        self.options = options

    def measure(self, frame: Frame, reference: Reference) -> Gradients | HeightMap:
        deed = self.at("measure")
        flat = np.zeros(frame.pixels.shape[:2], np.float32)
        measured = Gradients(flat, flat, flat == 0, frame.mm_per_px)
        if deed == "a list":
            return [measured]  # type: ignore[return-value]
        return replace(measured, x=flat * np.nan) if deed == "nan" else measured

    def save(self, directory: Path) -> None:
        self.at("save")

    @classmethod
    def load(cls, directory: Path) -> Self:
        return cls(Deed())


class UnrulyCalibrator(_Unruly, Calibrator):
    def fit(self, presses: Sequence[Press], reference: Reference) -> Calibration:
        self.at("fit")
        return UnrulyCalibration(self.options)

    def from_lights(self, lights: Sequence[Light]) -> Calibration | None:
        self.at("from_lights")
        return UnrulyCalibration(self.options)

    def smoothing_px(self, mm_per_px: float) -> float:
        return float("nan") if self.at("smoothing") == "nan" else 0.0


@dataclass(frozen=True, eq=False)
class UnrulyQuantity(Quantity):
    """Is well only where it is made."""

    does: str

    def summary(self) -> dict[str, Any]:
        return {"kelvin": np.float32(300)} if self.does == "summary" else {}

    def arrays(self) -> dict[str, Any]:
        return {"kelvin": 1 / 0} if self.does == "arrays" else {}

    def warnings(self) -> tuple[str, ...]:
        return (str(1 / 0),) if self.does == "warnings" else ()


class UnrulyMeasure(_Unruly, Estimator):
    def estimate(self, frame: Frame) -> UnrulyQuantity:
        return UnrulyQuantity(self.options.does)


class UnrulyStep(_Unruly, Estimator):
    def __init__(self, options: BaseModel, context: Any) -> None:
        super().__init__(options, context)
        if self.options.when == "made":
            self.at("made")

    def estimate(self, frame: Frame) -> HeightMap:
        deed = self.at("estimate")
        mm = np.ones(frame.pixels.shape[:2], np.float32)
        height = HeightMap(mm, mm > 0, frame.mm_per_px)
        wrong: Mapping[str, Any] = {
            "nothing": None,
            "slopes": Gradients(mm, mm, mm > 0, frame.mm_per_px),
            "integers": replace(height, mm=mm.astype(np.int32)),
            "half": replace(height, mm=mm[::2], valid=height.valid[::2]),
            "nan": replace(height, mm=mm * np.nan),
            "infinity": replace(height, mm=mm * np.inf),
            "array": mm,
        }
        return wrong.get(deed, height)
