"""Calibration targets: a grid of balls of one radius, with the position of each in the image."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.text import number, shorten_repr
from tactile_core.formats.yaml_tree import read_mapping

_MAX_CIRCLES = 10_000  # Largest number of circles in a file, count

_MAX_MM = 1000.0  # Largest radius and pitch of the balls, mm

# Largest coordinate, px. A target can be drawn on a larger image than the one that is measured.
_MAX_PX = 1e6


@dataclass(frozen=True, eq=False)
class BallGrid:
    """Balls of one radius and their circles in an image.

    Attributes
    ----------
    radius_mm : float
    centres_px : (N, 2) float64
        x, y in the camera's pixels.
    mm_per_px : float or None
        Scale of ``centres_px``, from the pitch of the balls; None if the file has no pitch or no
        adjacent balls.
    """

    radius_mm: float
    centres_px: NDArray[np.float64]
    mm_per_px: float | None = None

    def at_scale(self, mm_per_px: float) -> BallGrid:
        """Return the grid in the pixels of an image of another resolution.

        Targets are often drawn on the full image and used with a binned one. The two scales must
        differ by an integer factor, within 5 %. A factor of 1 leaves the grid unchanged.

        Raises
        ------
        InputError
            The scale of the target does not match any binning of this image.
        """
        if self.mm_per_px is None:
            return self
        ratio = mm_per_px / self.mm_per_px
        possible = 1e-3 < ratio < 1e3  # [ratio] no camera bins more
        factor = 1.0
        if possible:
            factor = float(round(ratio)) if ratio > 1 else 1 / round(1 / ratio)
        if not possible or abs(ratio / factor - 1) > 0.05:  # [ratio] off a binning factor
            raise InputError(
                f"the target's balls are drawn at {self.mm_per_px:.4g} mm per pixel, but the image "
                f"has {mm_per_px:.4g}; give the target of this image, or correct 'mm_per_px'"
            )
        if factor == 1:
            return self
        centres = (self.centres_px + 0.5) / factor - 0.5
        return BallGrid(self.radius_mm, centres, self.mm_per_px * factor)


def read_target(path: Path) -> BallGrid:
    """Read a grid of balls.

    The file is either a target (``radius`` and ``pitch`` in mm, ``shapes`` with ``x, y`` in px and
    grid indices ``gx, gy``) or a ``scan.yaml`` with circles drawn on its image (``annotations`` of
    type ``GridCircle``, radius and pitch under ``target`` or as ``calibradius`` and
    ``calibspacing``).

    Raises
    ------
    InputError
        The file is missing or does not describe a grid of balls.
    """
    path = Path(path)
    content = read_mapping(path)
    target = content.get("target")
    section: Mapping[str, Any] = target if isinstance(target, dict) else {}
    radius = section.get("radius", content.get("radius", content.get("calibradius")))
    pitch = section.get("pitch", content.get("pitch", content.get("calibspacing")))
    if radius is None or not number(radius, path, "radius", high=_MAX_MM) > 0:
        raise InputError(f"{path}: a ball target needs 'radius', the balls' radius in mm")
    drawn = content.get("shapes", content.get("annotations"))
    shapes = _circles(drawn, section.get("circles"), path)
    if not shapes:
        raise InputError(f"{path} has no circles: 'shapes' must list them with x and y in px")
    if len(shapes) > _MAX_CIRCLES:
        raise InputError(f"{path} has {len(shapes)} circles; the limit is {_MAX_CIRCLES}")
    centres = np.array([[_coordinate(shape, key, path) for key in ("x", "y")] for shape in shapes])
    pitch_mm = number(pitch, path, "pitch", high=_MAX_MM) if pitch is not None else 0.0
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
        raise InputError(f"{path}: circle {shorten_repr(shape.get('name', ''))} has no {key!r}")
    return number(shape[key], path, key, low=-_MAX_PX, high=_MAX_PX)


def _scale(
    shapes: Sequence[Mapping[str, Any]], centres: NDArray[np.float64], pitch_mm: float
) -> float | None:
    """Millimetres per pixel, from the median distance of adjacent balls in the grid."""
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
