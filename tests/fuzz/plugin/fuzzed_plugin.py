"""A plugin whose components fail in the method and the way that their options select."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import model_validator

from tactile_core.interfaces.calibration import Calibration, Calibrator
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import Estimator
from tactile_core.interfaces.hookspecs import hookimpl
from tactile_core.interfaces.illumination import Exposure, Illumination, Light
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.quantities import Gradients, HeightMap, Image, Quantity


class Unprintable(Exception):
    def __str__(self) -> str:
        raise RuntimeError("printing fails")


class FaultyOptions(Options):
    place: str = ""
    way: str = ""

    @model_validator(mode="after")
    def _when_read(self) -> FaultyOptions:
        act(self, "options")
        return self


def act(options: Any, place: str, good: Any = None) -> Any:
    """Apply the selected fault if this is its place; else return the valid result."""
    if options.place != place:
        return good
    return _done(options.way, good)


def _done(way: str, good: Any) -> Any:
    raised = getattr(__builtins__, way, None) if not isinstance(__builtins__, dict) else None
    raised = raised or (__builtins__.get(way) if isinstance(__builtins__, dict) else None)
    if way == "UnicodeDecodeError":
        b"\xff".decode()
    elif way == "RecursionError":
        return _done(way, good)
    elif isinstance(raised, type) and issubclass(raised, BaseException):
        raise raised(*(() if way in ("KeyError", "StopIteration") else ("a fault on purpose",)))
    elif way in ("Exit", "Abort"):
        import typer

        raise getattr(typer, way)
    elif way == "unprintable":
        raise Unprintable
    return _returned(way, good)


def _returned(way: str, good: Any) -> Any:
    if way == "prints":
        print("a plugin's own words")
    elif way == "warns":
        warnings.warn("a plugin's warning", stacklevel=2)
    elif way == "noise":
        os.write(1, b"noise\n")
    elif way == "endless":
        time.sleep(0.2)
    elif way in ("none", "text", "scalar"):
        return {"none": None, "text": "a height", "scalar": 1.0}[way]
    elif isinstance(good, Gradients | HeightMap | Image):
        return _misshapen(way, good)
    return good


def _misshapen(way: str, good: Any) -> Any:
    """Return the quantity with another shape, type or content, bypassing its validation."""
    name = {"Gradients": "x", "HeightMap": "mm", "Image": "pixels"}[type(good).__name__]
    array = getattr(good, name)
    wrong = {
        "shape": lambda: array[::2],
        "dtype": lambda: array.astype(np.complex64),
        "integers": lambda: array.astype(np.int64),
        "gaps": lambda: np.full(array.shape, np.nan, np.float32),
        "empty": lambda: array[:0],
        "huge": lambda: np.full(array.shape, 1e30, np.float32),
    }.get(way)
    if wrong is not None:
        object.__setattr__(good, name, wrong())
    return good


@dataclass(frozen=True, eq=False)
class Peak(Quantity):
    mm: float


class PeakStep(Estimator):
    Options = FaultyOptions

    def __init__(self, options: Any, context: Any) -> None:
        super().__init__(options, context)
        act(options, "init")

    def estimate(self, height: HeightMap) -> Peak:
        return act(self.options, "estimate", Peak(float(height.mm.max())))

    def reset(self) -> None:
        act(self.options, "reset")

    def tare(self, result: Peak) -> Peak:
        return act(self.options, "tare", result)


class FlatCalibrator(Calibrator):
    Options = FaultyOptions

    def fit(self, presses: Any, reference: Any) -> Any:
        return act(self.options, "fit", Flat(self.options))

    def smoothing_px(self, mm_per_px: float) -> Any:
        return act(self.options, "smoothing", 0.0)


class Flat(Calibration):
    def __init__(self, options: Any) -> None:
        self.options = options

    def measure(self, frame: Any, reference: Any) -> Any:
        level = np.zeros(frame.pixels.shape[:2], np.float32)
        good = Gradients(level, level.copy(), level == 0, frame.mm_per_px, frame.timestamp_s)
        return act(self.options, "measure", good)

    def save(self, directory: Path) -> None:
        np.savez(directory / "flat.npz", nothing=np.zeros(1))
        act(self.options, "save")

    @classmethod
    def load(cls, directory: Path) -> Any:
        return cls(FaultyOptions())


class Still(Camera):
    Options = FaultyOptions

    def __init__(self, options: Any) -> None:
        super().__init__(options)
        act(options, "init")

    def _open(self) -> None:
        act(self.options, "open")

    def _close(self) -> None:
        act(self.options, "close")

    def _read(self, timeout_s: float) -> Any:
        return act(self.options, "read", Image(np.full((60, 80, 3), 128, np.uint8)))


class FaultyLights(Illumination):
    Options = FaultyOptions

    def __init__(self, options: Any) -> None:
        super().__init__(options)
        act(options, "init")

    @property
    def channels(self) -> Any:
        return act(self.options, "channels", ("red", "green", "blue"))

    def exposures(self) -> Any:
        return act(self.options, "exposures", (Exposure({"ring": 1.0}, ("red", "green", "blue")),))

    @property
    def lights(self) -> Any:
        return act(self.options, "lights", (Light("ring", 0, 30),))


class Box(LightDriver):
    Options = FaultyOptions

    def __init__(self, options: Any) -> None:
        super().__init__(options)
        act(options, "init")

    def attach(self, camera: Camera) -> None:
        act(self.options, "attach")

    def _open(self) -> None:
        act(self.options, "open")

    def _close(self) -> None:
        act(self.options, "close")

    def _set(self, levels: Mapping[str, float]) -> None:
        act(self.options, "set")


_PLACE, _, _WAY = os.environ.get("FUZZED", "").partition(":")
if _PLACE == "module":
    _done(_WAY, None)


def _hook(good: Any) -> Any:
    return _done(_WAY, good) if _PLACE == "hooks" else good


@hookimpl
def tactile_cameras() -> Any:
    return _hook({"camera": "fuzzed_plugin:Still"})


@hookimpl
def tactile_illuminations() -> Any:
    return _hook({"illumination": "fuzzed_plugin:FaultyLights"})


@hookimpl
def tactile_light_drivers() -> Any:
    return _hook({"driver": "fuzzed_plugin:Box"})


@hookimpl
def tactile_calibrators() -> Any:
    return _hook({"calibration": "fuzzed_plugin:FlatCalibrator"})


@hookimpl
def tactile_artefacts() -> Any:
    return _hook({"calibration": "fuzzed_plugin:Flat"})


@hookimpl
def tactile_estimators() -> Any:
    return _hook({"estimators": "fuzzed_plugin:PeakStep"})
