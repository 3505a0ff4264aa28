"""Contact circle of a ball."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Circle:
    """Contact circle of a ball.

    Attributes
    ----------
    centre_px : (x, y)
        0-based, integers at pixel centres.
    contact_radius_px : float
    used : bool
        Whether it is good enough to calibrate on.
    why : str
        Reason for excluding it; "" when used.
    confidence : float
        0 to 1.
    centre_std_px : float
        Standard deviation of each coordinate of the centre; NaN for a circle that was given.
    radius_std_px : float
        Standard deviation of the radius; NaN for a circle that was given.
    """

    centre_px: tuple[float, float]
    contact_radius_px: float
    used: bool = True
    why: str = ""
    confidence: float = 1.0
    centre_std_px: float = float("nan")
    radius_std_px: float = float("nan")
