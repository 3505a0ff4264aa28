"""What fitting, scoring and the report need of a surface whose slopes are known."""

from __future__ import annotations

from typing import Protocol, TypeVar

import numpy as np

from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Bool, Float32, Frame, Reference


class KnownSurface(Protocol):
    """Part of a frame in which a known shape touches the skin: a ball, or a height map's rows."""

    @property
    def file(self) -> str:
        """Where it comes from, for people."""

    @property
    def frame(self) -> Frame:
        """The observation that shows it."""

    @property
    def used(self) -> bool:
        """Whether it is good enough to fit on."""

    @property
    def why(self) -> str:
        """Why it is not."""

    @property
    def centre_px(self) -> tuple[float, float]:
        """Its middle, x and y."""

    @property
    def radius_px(self) -> float:
        """Of the contact; of a circle as large, where the contact is no circle."""

    def area(self) -> Bool:
        """(H, W) bool: where it lies."""

    def training(self) -> Press:
        """Pixels to fit on."""

    def scored(self) -> Bool:
        """(H, W) bool: pixels that count in a score."""

    def true_gradients(self, mask: Bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and (N, 2) slopes over a mask."""

    def height_errors_mm(self, height_mm: Float32, mask: Bool) -> np.ndarray:
        """(N,) measured minus true height over a mask, up to what no slope tells."""

    def lighting(self, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
        """(N, 2) slopes and the (N, K) changes of intensity that they cause, to first order."""


S = TypeVar("S", bound=KnownSurface)
