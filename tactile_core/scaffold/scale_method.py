"""How the scale of a new sensor is measured: what ``--scale`` says."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from tactile_core.errors import InputError
from tactile_core.formats.printable import shown

Point = tuple[float, float]

_FORMS = (
    "give mm per pixel (0.065), calliper:10, balls:6, grid:2, markers:1.5, "
    "rectangle:24x32@x,y,x,y,x,y,x,y or the YAML of a ball grid"
)
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
# Methods whose positions can be given, and how many positions that takes.
_POINTS = {"calliper": 2, "balls": 2, "rectangle": 4}


@dataclass(frozen=True)
class ScaleMethod:
    """What has which size, and where it is in the camera's image if that is given.

    Attributes
    ----------
    kind : str
        ``given``, ``calliper``, ``balls``, ``grid``, ``markers``, ``rectangle`` or ``target``.
    size_mm : tuple of float
        Distance or pitch; width and height of a rectangle; for ``given`` the mm per pixel.
    points_px : tuple of (x, y)
        Both ends; or the corners top left, top right, bottom right, bottom left.
    target : Path or None
        YAML of a ball grid.
    """

    kind: str
    size_mm: tuple[float, ...] = ()
    points_px: tuple[Point, ...] = ()
    target: Path | None = None

    @property
    def needs_image(self) -> bool:
        """Whether an image of its own has to show it."""
        return self.kind == "grid" or (self.kind in ("calliper", "balls") and not self.points_px)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Parse what ``--scale`` takes.

        Raises
        ------
        InputError
            The text has another form.
        """
        if re.fullmatch(_NUMBER, text.strip()):
            return cls("given", (_number(text, text, least=0.0),))
        if text.lower().endswith((".yaml", ".yml")):
            return cls("target", target=Path(text))
        kind, _, rest = text.partition(":")
        size, at, points = rest.partition("@")
        sides = size.replace("×", "x").split("x")
        if kind not in (*_POINTS, "grid", "markers") or len(sides) != 1 + (kind == "rectangle"):
            raise InputError(f"--scale {shown(text)}: {_FORMS}")
        xy = [_number(part, text) for part in re.split(r"[\s,;]+", points.strip())] if at else []
        needed = 2 * _POINTS.get(kind, 0)
        if len(xy) != needed and (xy or kind == "rectangle"):
            wanted = f"give {needed} numbers after '@', x,y of both ends or of four corners"
            found = "it is found in the image; leave '@' and what follows out"
            raise InputError(f"--scale {shown(text)}: {wanted if needed else found}")
        size_mm = tuple(_number(side, text, least=0.0) for side in sides)
        made = cls(kind, size_mm, tuple(zip(xy[::2], xy[1::2], strict=True)))
        made._check_points()
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
                f"--scale: a point is outside the image of {size_px[0]} × {size_px[1]} px"
            )

    def _check_points(self) -> None:
        xy = np.asarray(self.points_px)
        if len(xy) == 2 and np.hypot(*(xy[1] - xy[0])) < 1:
            raise InputError("--scale: both ends are at the same position; give two points")
        if len(xy) == 4:
            sides = np.roll(xy, -1, axis=0) - xy
            after = np.roll(sides, -1, axis=0)
            if not (sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0] > 1).all():
                raise InputError(
                    "--scale: give the four corners clockwise in the image, from the top left"
                )


def _number(part: str, text: str, least: float = -np.inf) -> float:
    if not re.fullmatch(_NUMBER, part.strip()):
        raise InputError(f"--scale {shown(text)}: {shown(part)} is no number; {_FORMS}")
    if not least < float(part) < np.inf:
        raise InputError(f"--scale {shown(text)}: a length must be positive and finite")
    return float(part)
