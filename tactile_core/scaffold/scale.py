"""The scale of a sensor's image."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from tactile_core.acquisition.geometry import ImageGeometry, Size
from tactile_core.algorithms.light.sequence import imprint_distance
from tactile_core.algorithms.markers.grid_pitch import measure_pitch
from tactile_core.errors import InputError
from tactile_core.formats.target import read_target
from tactile_core.formats.text import shorten_repr
from tactile_core.interfaces.image import ImageSection
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Pixels
from tactile_core.scaffold.markers import FoundMarkers, PictureFinding

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
            raise InputError(f"--scale {shorten_repr(text)}: {_FORMS}")
        xy = [_number(part, text) for part in re.split(r"[\s,;]+", points.strip())] if at else []
        needed = 2 * _POINTS.get(kind, 0)
        if len(xy) != needed and (xy or kind == "rectangle"):
            wanted = f"give {needed} numbers after '@', x,y of both ends or of four corners"
            found = "it is found in the image; leave '@' and what follows out"
            raise InputError(f"--scale {shorten_repr(text)}: {wanted if needed else found}")
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
        raise InputError(
            f"--scale {shorten_repr(text)}: {shorten_repr(part)} is no number; {_FORMS}"
        )
    if not least < float(part) < np.inf:
        raise InputError(f"--scale {shorten_repr(text)}: a length must be positive and finite")
    return float(part)


@dataclass(frozen=True)
class Scale:
    """Scale of the resulting image.

    Attributes
    ----------
    mm_per_px : float
        The mean of both axes.
    source : str
        Origin of the scale, for messages.
    measured : bool
        Whether it was measured in an image; it is then reported with its uncertainty.
    """

    mm_per_px: float
    source: str
    measured: bool = False

    @classmethod
    def of_target(cls, path: Path, section: ImageSection, camera: Size) -> Scale:
        """Measure the pitch of a grid of balls.

        Targets are often drawn on the full image and used with a binned one. If circles are outside
        the image, the target is therefore downscaled by the smallest whole factor that brings them
        inside.

        Raises
        ------
        InputError
            The file has no pitch.
        """
        grid = read_target(path)
        if grid.mm_per_px is None:
            raise InputError(
                f"{path} has no scale: it needs 'pitch' in mm and circles with grid indices gx, gy"
            )
        factor = int(max(1.0, np.ceil((grid.centres_px.max(axis=0) / camera).max())))
        camera_mm = grid.mm_per_px * factor
        source = f"the pitch of the balls of {path.name}"
        if factor > 1:
            source += f", drawn on an image {factor} times as large"
        return cls(_resulting(camera_mm, section, camera), source)

    @classmethod
    def of_pitch(cls, seen: Pixels, what: str, pitch_mm: float) -> Scale | None:
        """Measure a square pattern along x and along y; None without one."""
        found = measure_pitch(seen)
        if found is None:
            return None
        x_mm, y_mm = pitch_mm / found.x_px, pitch_mm / found.y_px
        mean_mm = (x_mm + y_mm) / 2
        source = (
            f"{what} {pitch_mm:g} mm apart: {x_mm:.4g} along x and {y_mm:.4g} along y, "
            f"± {mean_mm * found.error:.1g}"
        )
        unequal = abs(x_mm / y_mm - 1)
        # [shares] smaller ones are those of a real camera's lens
        if unequal > max(0.01, 3 * found.error) or found.variation > 0.05:
            source += (
                f". Their mean is used although they differ by {unequal:.1%}, and by "
                f"{found.variation:.0%} at a corner: the camera is tilted (--scale "
                f"rectangle:24x32@… rectifies the image), or the pixels are not square (a "
                f"'height_px' {y_mm / x_mm:.3g} times as large makes them so)"
            )
        return cls(mean_mm, source, measured=True)

    @classmethod
    def of_scan(
        cls, camera_mm_per_px: float, name: str, section: ImageSection, camera: Size
    ) -> Scale:
        """Return the scale of a scan, converted from the camera's pixels."""
        return cls(_resulting(camera_mm_per_px, section, camera), f"mmperpixel of {name}")


def measure_scale(
    method: ScaleMethod,
    section: ImageSection,
    camera: Size,
    seen: Pixels,
    rest: Pixels,
    markers: FoundMarkers | None,
) -> Scale:
    """Measure the scale as the user said.

    Parameters
    ----------
    method : ScaleMethod
    section : ImageSection
    camera : (width, height)
        Size of the camera's images.
    seen, rest : (H, W, K)
        All exposures of what has a known size, and of the undeformed gel, in the resulting image.
    markers : FoundMarkers or None
        The markers of the undeformed gel.

    Raises
    ------
    InputError
        The image does not show it.
    """
    if method.target is not None:
        return Scale.of_target(method.target, section, camera)
    size_mm = method.size_mm[0]
    if method.kind == "given":
        return Scale(size_mm, "--scale")
    if method.kind == "rectangle":
        source = "a rectangle of {:g} × {:g} mm".format(*method.size_mm)
        return Scale(size_mm / section.width_px, source)
    if method.kind in ("grid", "markers"):
        what = "a grid of lines, checks or dots" if method.kind == "grid" else "markers"
        scale = Scale.of_pitch(seen, what, size_mm)
        if scale is None and method.kind == "markers" and markers is not None:
            source = f"markers {size_mm:g} mm = {markers.pitch_px:.1f} px from the nearest other"
            return Scale(size_mm / markers.pitch_px, source, measured=True)
        if scale is None:
            what = what.removeprefix("a ")
            remedy = "an even, sharp image in which it repeats six times or more in each direction"
            if method.kind == "markers":
                remedy = "a sharper image of the undeformed gel, or another --scale"
            raise InputError(f"--scale {method.kind}: the image shows no {what}; give {remedy}")
        return scale
    if method.points_px:
        ends = ImageGeometry(section).map_points(method.points_px, camera)
        dx, dy = ends[1] - ends[0]
    else:
        apart = imprint_distance(seen, rest)
        if apart is None:
            raise InputError(
                f"--scale {method.kind}: --scale-image shows no two equal imprints; press both "
                f"equally deep, or give their positions: --scale {method.kind}:{size_mm:g}@x,y,x,y"
            )
        dx, dy = apart
    length_px = float(np.hypot(dx, dy))
    both = "two balls" if method.kind == "balls" else "both tips of a calliper"
    source = f"{both}, {size_mm:g} mm = {length_px:.1f} px apart"
    if not method.points_px:
        # [px] two imprints differ in light and depth
        error_mm = size_mm / length_px * 1.5 / length_px
        source += (
            f" at {np.degrees(np.arctan2(dy, dx)):.0f}° from x, ± {error_mm:.1g}; another image, "
            f"turned by 90°, shows whether the pixels are square"
        )
    return Scale(size_mm / length_px, source, measured=not method.points_px)


def agree_on_scale(scales: list[Scale]) -> Scale | None:
    """Return the first scale if the others agree with it; None for an empty list.

    Raises
    ------
    InputError
        Two scales contradict each other.
    """
    for other in scales[1:]:
        ratio = other.mm_per_px / scales[0].mm_per_px
        if abs(ratio - 1) > 0.03:  # [share] the accuracy of printed markers (ADR 17)
            raise InputError(
                f"{scales[0].source} gives {scales[0].mm_per_px:.4g} mm per pixel and "
                f"{other.source} {other.mm_per_px:.4g}; give only the one that is right"
            )
    return scales[0] if scales else None


def scale_finding(scale: Scale | None, parent: Profile, width_px: int) -> PictureFinding:
    """Return the finding for the profile; without a scale it assumes the parent's field of view."""
    if scale is not None:
        comment = f"Millimetres per pixel on the gel, from {scale.source}."
        values = {"mm_per_px": round_scale(scale.mm_per_px)}
        return PictureFinding("image", comment, values, noted=scale.measured)
    view_mm = parent.image.mm_per_px * parent.image.width_px
    guess = round_scale(view_mm / width_px)
    comment = (
        f"NOT MEASURED: {guess:g} is right if the image is {view_mm:.3g} mm wide like "
        f"{parent.name}'s. All heights and areas depend on it: measure it by something of known "
        f"size on the gel: --scale grid:2, calliper:10, balls:6 or markers:1.5."
    )
    return PictureFinding("image", comment, {"mm_per_px": guess}, noted=True)


def round_scale(mm_per_px: float) -> float:
    """Round to five significant digits, more than any length is measured to."""
    return float(f"{mm_per_px:.5g}")


def _resulting(camera_mm_per_px: float, section: ImageSection, camera: Size) -> float:
    unit = section.model_copy(update={"mm_per_px": 1.0})
    return camera_mm_per_px / ImageGeometry(unit).camera_mm_per_px(camera)
