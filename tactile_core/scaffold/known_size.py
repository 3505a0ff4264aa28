"""A known length (by its ends) or rectangle (by its corners) on the gel."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Self

import numpy as np

from tactile_core.errors import InputError

Point = tuple[float, float]

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"


@dataclass(frozen=True)
class KnownSize:
    """A length or a rectangle of known size, and its position in the camera's image.

    Attributes
    ----------
    size_mm : (length,) or (width, height)
    points_px : two or four (x, y)
        Both ends; or the corners top left, top right, bottom right, bottom left.
    """

    size_mm: tuple[float, ...]
    points_px: tuple[Point, ...]

    @property
    def is_rectangle(self) -> bool:
        """Whether it is a rectangle."""
        return len(self.points_px) == 4

    @classmethod
    def parse(cls, size: str | None, points: str | None) -> Self | None:
        """Parse ``10`` and ``x0,y0,x1,y1``, or ``24x32`` and eight numbers; None if both are None.

        Raises
        ------
        InputError
            A text has another form, or only one is given.
        """
        if size is None and points is None:
            return None
        if size is None or points is None:
            raise InputError(
                "--known-mm and --known-px belong together: a size, and its position in the image"
            )
        size_mm = tuple(float(part) for part in _numbers(size, r"\s*[x×]\s*", "--known-mm"))
        xy = _numbers(points, r"[\s,;]+", "--known-px")
        if len(size_mm) not in (1, 2) or not min(size_mm) > 0 or len(xy) != 4 * len(size_mm):
            raise InputError(
                "--known-mm 10 needs --known-px x0,y0,x1,y1, the ends of that length; --known-mm "
                "24x32 the four corners of that rectangle, clockwise from the top left"
            )
        made = cls(size_mm, tuple(zip(xy[::2], xy[1::2], strict=True)))
        made._check()
        return made

    def check_within(self, size_px: tuple[int, int]) -> None:
        """Check that all points are inside an image of this width and height.

        Raises
        ------
        InputError
            A point is outside.
        """
        xy = np.asarray(self.points_px)
        if (xy < -0.5).any() or (xy > np.asarray(size_px) - 0.5).any():
            raise InputError(
                f"--known-px: a point is outside the image of {size_px[0]} × {size_px[1]} px"
            )

    def _check(self) -> None:
        xy = np.asarray(self.points_px)
        if not self.is_rectangle:
            if np.hypot(*(xy[1] - xy[0])) < 1:
                raise InputError("--known-px: both ends are at the same position; give two points")
            return
        sides = np.roll(xy, -1, axis=0) - xy
        after = np.roll(sides, -1, axis=0)
        turns = sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0]
        if not (turns > 1).all():
            raise InputError(
                "--known-px: give the four corners clockwise in the image, from the top left"
            )


def _numbers(text: str, separator: str, option: str) -> list[float]:
    parts = re.split(separator, text.strip())
    if not all(re.fullmatch(_NUMBER, part) for part in parts):
        raise InputError(f"{option} {text!r}: give numbers only")
    return [float(part) for part in parts]
