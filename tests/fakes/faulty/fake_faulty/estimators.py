"""Estimators that each do one thing wrong; all of them integrate slopes as the core does."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from tactile_core.builtin.poisson import Poisson
from tactile_core.interfaces.estimator import Estimator
from tactile_core.quantities import FieldSpec, Float32, Gradients, HeightMap, Quantity


@dataclass(frozen=True, eq=False)
class Temperature(Quantity):
    kelvin: Any

    def summary(self) -> dict[str, Any]:
        return {"kelvin": self.kelvin}


def scaled(height: HeightMap, factor: float) -> HeightMap:
    return replace(height, mm=(height.mm * factor).astype(np.float32))


class Sound(Poisson):
    """Does nothing wrong."""


class Unannotated(Poisson):
    def estimate(self, gradients):  # type: ignore[no-untyped-def]
        return super().estimate(gradients)


class NeedsUnknown(Estimator):
    def estimate(self, temperature: Temperature) -> HeightMap:
        raise NotImplementedError


class DoublePrecision(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        height = super().estimate(gradients)
        return replace(height, mm=height.mm.astype(np.float64))


class HalfSize(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        height = super().estimate(gradients)
        return replace(height, mm=height.mm[::2, ::2], valid=height.valid[::2, ::2])


class Writable(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        height = super().estimate(gradients)
        mm = height.mm.copy()
        object.__setattr__(height, "mm", mm)
        return height


class OtherType(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        return gradients  # type: ignore[return-value]


class Timeless(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        return replace(super().estimate(gradients), timestamp_s=0.0)


class InPlace(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        x = gradients.x
        x *= 1.0
        return super().estimate(gradients)


class InPixels(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        return scaled(super().estimate(gradients), 1 / gradients.mm_per_px)


class InMetres(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        return scaled(super().estimate(gradients), 1e-3)


class UpsideDown(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        return scaled(super().estimate(gradients), -1)


class NotJson(Estimator):
    def estimate(self, height: HeightMap) -> Temperature:
        return Temperature(height.mm.max() + np.float32(300))


@dataclass(frozen=True, eq=False)
class Colour(Quantity):
    rgb: Annotated[Float32, FieldSpec(axes=("channel",))]

    def arrays(self) -> dict[str, Float32]:
        return {name: array[::-1] for name, array in super().arrays().items()}


class OneWay(Estimator):
    def estimate(self, height: HeightMap) -> Colour:
        return Colour(np.arange(3, dtype=np.float32))


class Random(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        return scaled(super().estimate(gradients), float(np.random.default_rng().uniform(0.9, 1)))


class Mean(Poisson):
    """Averages with the frame before."""

    stateful = True
    last: HeightMap | None = None

    def estimate(self, gradients: Gradients) -> HeightMap:
        height = super().estimate(gradients)
        mean = height if self.last is None else replace(height, mm=(height.mm + self.last.mm) / 2)
        self.last = height
        return mean

    def reset(self) -> None:
        self.last = None


class NeverForgets(Mean):
    def reset(self) -> None:
        pass


class Undeclared(Mean):
    stateful = False


class Shared(Poisson):
    """Keeps its state in the class."""

    stateful = True
    frames: ClassVar[list[int]] = []

    def estimate(self, gradients: Gradients) -> HeightMap:
        self.frames.append(1)
        return scaled(super().estimate(gradients), 1 + 0.01 * len(self.frames))

    def reset(self) -> None:
        self.frames.clear()


class OneBuffer(Poisson):
    buffer: Any = None

    def estimate(self, gradients: Gradients) -> HeightMap:
        height = super().estimate(gradients)
        if self.buffer is None:
            self.buffer = np.empty_like(height.mm)
        self.buffer[:] = height.mm
        return replace(height, mm=self.buffer)


class ChangesInput(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        height = super().estimate(gradients)
        below = gradients.x.base
        if below is not None:
            below[:2] = 0
        return height


class Locked(Poisson):
    def __init__(self, options: Any, context: Any) -> None:
        super().__init__(options, context)
        self.lock = threading.Lock()


class Breaks(Poisson):
    def estimate(self, gradients: Gradients) -> HeightMap:
        raise RuntimeError("the weights do not fit")
