"""Reference objects: a grid of balls of one radius, and where each is in the image."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.printable import shown
from tactile_core.formats.yaml import number, read_mapping

_RESOLUTION_TOLERANCE = 0.05
_MOST_BINNED = 1e3
_MOST_CIRCLES = 10_000
_LARGEST_MM = 1000.0
_FARTHEST_PX = 1e6
"""A target may be drawn on a larger picture than the one that is measured."""


@dataclass(frozen=True, eq=False)
class BallGrid:
    """Balls of one radius and their circles in an image.

    Attributes
    ----------
    radius_mm : float
    centres_px : (N, 2) float64
        x, y in the camera's pixels.
    mm_per_px : float or None
        The scale of ``centres_px`` as the balls' pitch gives it; None where the file names no
        pitch or no neighbours.
    """

    radius_mm: float
    centres_px: NDArray[np.float64]
    mm_per_px: float | None = None

    def at_scale(self, mm_per_px: float) -> BallGrid:
        """Return the grid in the pixels of an image that shows it at ``mm_per_px``.

        Targets are often drawn on the full picture and used with a binned one. Only a whole number
        of times larger or smaller counts as another resolution; less than 5 % is left alone.

        Raises
        ------
        InputError
            The target was drawn at a scale that fits no binning of this image.
        """
        if self.mm_per_px is None:
            return self
        ratio = mm_per_px / self.mm_per_px
        possible = 1 / _MOST_BINNED < ratio < _MOST_BINNED
        factor = 1.0
        if possible:
            factor = float(round(ratio)) if ratio > 1 else 1 / round(1 / ratio)
        if not possible or abs(ratio / factor - 1) > _RESOLUTION_TOLERANCE:
            raise InputError(
                f"the target's balls are drawn at {self.mm_per_px:.4g} mm per pixel and the image "
                f"has {mm_per_px:.4g}; give the target of this image, or correct 'mm_per_px'"
            )
        if factor == 1:
            return self
        centres = (self.centres_px + 0.5) / factor - 0.5
        return BallGrid(self.radius_mm, centres, self.mm_per_px * factor)


def read_target(path: Path) -> BallGrid:
    """Read a grid of balls.

    Understood are a target file (``radius`` and ``pitch`` in mm, ``shapes`` with ``x, y`` in px and
    grid indices ``gx, gy``) and a ``scan.yaml`` on whose image the circles were drawn
    (``annotations`` of type ``GridCircle``, radius and pitch under ``target`` or as ``calibradius``
    and ``calibspacing``).

    Raises
    ------
    InputError
        The file is missing or describes no grid of balls.
    """
    path = Path(path)
    content = read_mapping(path)
    target = content.get("target")
    told: Mapping[str, Any] = target if isinstance(target, dict) else {}
    radius = told.get("radius", content.get("radius", content.get("calibradius")))
    pitch = told.get("pitch", content.get("pitch", content.get("calibspacing")))
    if radius is None or not number(radius, path, "radius", high=_LARGEST_MM) > 0:
        raise InputError(f"{path}: a ball target needs 'radius', the balls' radius in mm")
    shapes = _circles(content.get("shapes", content.get("annotations")), told.get("circles"), path)
    if not shapes:
        raise InputError(f"{path} shows no circles: 'shapes' must list them with x and y in px")
    if len(shapes) > _MOST_CIRCLES:
        raise InputError(f"{path} has {len(shapes)} circles; {_MOST_CIRCLES} are read at most")
    centres = np.array([[_coordinate(shape, key, path) for key in ("x", "y")] for shape in shapes])
    pitch_mm = number(pitch, path, "pitch", high=_LARGEST_MM) if pitch is not None else 0.0
    return BallGrid(float(radius), centres, _scale(shapes, centres, pitch_mm))


def _circles(shapes: object, ids: object, path: Path) -> Sequence[Mapping[str, Any]]:
    if not isinstance(shapes, list) or not all(isinstance(shape, dict) for shape in shapes):
        return []
    circles = [s for s in shapes if str(s.get("type", "Circle")).endswith("Circle")]
    if isinstance(ids, list):
        circles = [circle for circle in circles if circle.get("id") in ids]
    return circles


def _coordinate(shape: Mapping[str, Any], key: str, path: Path) -> float:
    if key not in shape:
        raise InputError(f"{path}: circle {shown(shape.get('name', ''))} has no {key!r}")
    return number(shape[key], path, key, low=-_FARTHEST_PX, high=_FARTHEST_PX)


def _scale(
    shapes: Sequence[Mapping[str, Any]], centres: NDArray[np.float64], pitch_mm: float
) -> float | None:
    """Millimetres per pixel, by the median distance of balls that are neighbours in the grid."""
    if not pitch_mm > 0 or not all(isinstance(s.get(k), int) for s in shapes for k in ("gx", "gy")):
        return None
    place = {
        (shape["gx"], shape["gy"]): centre for shape, centre in zip(shapes, centres, strict=True)
    }
    steps = [
        float(np.hypot(*(place[x + dx, y + dy] - centre)))
        for (x, y), centre in place.items()
        for dx, dy in ((1, 0), (0, 1))
        if (x + dx, y + dy) in place
    ]
    middle = float(np.median(steps)) if steps else 0.0
    return pitch_mm / middle if middle > 0 else None
