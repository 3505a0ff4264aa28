"""A surface with ground truth, as fitting, scoring and the report use it."""

from __future__ import annotations

from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Bool, Float32, Frame, Reference


class MeasuredSphere(NamedTuple):
    """A sphere that was fitted to a measured height map, compared with the ball.

    Attributes
    ----------
    radius_ratio : float
        Its radius over that of the ball; negative if the heights are a hollow.
    offset_px : float
        Distance of its centre from that of the circle that was found in the image.
    """

    radius_ratio: float
    offset_px: float


class TargetSurface(Protocol):
    """Part of a frame with ground truth: a pressed ball, or rows of a height map."""

    @property
    def file(self) -> str:
        """Name of its source, for reports."""

    @property
    def frame(self) -> Frame:
        """The observation that shows it."""

    @property
    def used(self) -> bool:
        """Whether it is good enough to fit on."""

    @property
    def why(self) -> str:
        """Why it is not used; empty if it is."""

    @property
    def centre_px(self) -> tuple[float, float]:
        """Its centre, x and y."""

    @property
    def radius_px(self) -> float:
        """Radius of the contact; for other shapes, of a circle of the same area."""

    @property
    def ball_diameter_mm(self) -> float | None:
        """Diameter of its ball; None for other shapes."""

    def area(self) -> Bool:
        """(H, W) bool: the pixels that it covers."""

    def training(self) -> Press:
        """Pixels to fit on."""

    def scored(self) -> Bool:
        """(H, W) bool: pixels that count in a score."""

    def true_gradients(self, mask: Bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and (N, 2) true slopes of the pixels of a mask."""

    def height_errors_mm(self, height_mm: Float32, mask: Bool) -> np.ndarray:
        """(N,) measured minus true height over a mask, up to what slopes leave undetermined."""

    def sphere(self, height_mm: Float32) -> MeasuredSphere | None:
        """Compare the ball with the sphere in a measured height map; None for other shapes."""

    def lighting(self, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
        """(N, 2) slopes and the (N, K) changes of intensity that they cause, to first order."""


S = TypeVar("S", bound=TargetSurface)
