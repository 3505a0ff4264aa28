"""The main job with no hardware and no files: calibrate, press, measure, compare, report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core import html
from tactile_core.bundle import Bundle
from tactile_core.calibrating import calibrate
from tactile_core.calibrating.presses import angles_deg
from tactile_core.pictures import deviation, relief
from tactile_core.pictures.field import arrows
from tactile_core.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.progress import Progress
from tactile_core.quantities import ContactMask, Frame, Gradients, HeightMap
from tactile_core.sim.simulation import write_frame
from tactile_core.sim.stage import VirtualStage

CALIBRATION_PRESSES = 14
BALL_SHARE = 0.22
"""Diameter of the ball for calibrating, of the width of the view; thin gels take a smaller one."""

_REACH = 0.38
_COLOURS = 3
_MOST_SHEARS = 20


@dataclass(frozen=True)
class Row:
    """How one press was measured.

    Attributes
    ----------
    normal_error_deg : float
        Mean angle between measured and true normals in the contact.
    height_error_mm : float
        RMS over the whole image.
    depth_mm, measured_depth_mm : float
        Highest point of the truth and of the measurement.
    """

    rig: str
    press: str
    normal_error_deg: float
    height_error_mm: float
    depth_mm: float
    measured_depth_mm: float


@dataclass(frozen=True)
class _Object:
    """Something to press: sizes and depth in diameters of the calibration's ball."""

    words: str
    kind: str
    depth: float
    x: float
    y: float
    sizes: Mapping[str, float] = field(default_factory=dict)
    angle_deg: float = 0.0


_OBJECTS = (
    _Object("larger ball", "sphere", 0.15, -0.1, 0.08, {"diameter_mm": 1.5}),
    _Object("cylinder", "cylinder", 0.12, 0.1, -0.1, {"diameter_mm": 1.2, "length_mm": 1.6}, 30.0),
    _Object("cone", "cone", 0.1, 0.0, 0.1, {"diameter_mm": 1.2}),
)


def demonstrate(profile: Profile, progress: Progress) -> tuple[list[Row], list[str]]:
    """Calibrate a virtual rig by ball presses, press other things, compare with the truth.

    Returns
    -------
    rows : list of Row
    parts : list of str
        HTML for the report.
    """
    stage, ball_mm = VirtualStage(profile), _ball_mm(profile)
    bundle, said = _calibrated(stage, ball_mm, progress)
    pipeline = Pipeline(profile, bundle)
    rows, parts = [], [html.heading(f"{profile.name}: {profile.description}"), said]
    for thing in _OBJECTS:
        _press(stage, thing, ball_mm)
        row, figures = _measured(stage, pipeline, thing.words)
        rows.append(row)
        parts += figures
    return rows, [*parts, *_sheared(stage, ball_mm)]


def _calibrated(stage: VirtualStage, ball_mm: float, progress: Progress) -> tuple[Bundle, str]:
    profile = stage.profile
    rng = np.random.default_rng(7)
    with TemporaryDirectory(prefix="tactile-demo-") as name:
        folder = Path(name)
        write_frame(folder / "reference", stage.frame(), "untouched")
        for number in range(CALIBRATION_PRESSES):
            x, y = rng.uniform(-_REACH, _REACH, 2)
            depth = float(rng.uniform(0.12, 0.22))
            _press(stage, _Object("", "sphere", depth, x, y, {"diameter_mm": 1.0}), ball_mm)
            write_frame(folder / "presses", stage.frame(), f"press_{number:02d}")
        result = calibrate(
            profile,
            folder / "presses",
            folder / "reference",
            ball_diameter_mm=ball_mm,
            progress=progress,
        )
    score = result.score
    told = "" if score is None else f"; mean error of held-out normals {score.mean_deg:.2f}°"
    used = sum(press.used for press in result.presses)
    return result.bundle, html.paragraph(
        f"Calibrated by {used} presses of a {ball_mm:g} mm ball{told}."
    )


def _press(stage: VirtualStage, thing: _Object, ball_mm: float) -> None:
    image = stage.profile.image
    stage.reset()
    stage.indenter(
        thing.kind,
        x_mm=thing.x * image.width_px * image.mm_per_px,
        y_mm=thing.y * image.height_px * image.mm_per_px,
        angle_deg=thing.angle_deg,
        **{name: size * ball_mm for name, size in thing.sizes.items()},
    )
    stage.press(depth_mm=thing.depth * ball_mm)


def _measured(stage: VirtualStage, pipeline: Pipeline, words: str) -> tuple[Row, list[str]]:
    frame, truth = stage.frame(), stage.truth()
    reading = pipeline.process(frame)
    height, slopes = reading[HeightMap], reading[Gradients]
    inside = truth.contact
    error = angles_deg(np.stack([slopes.x, slopes.y], 2)[inside], truth.gradients[inside])
    row = Row(
        stage.profile.name,
        words,
        float(error.mean()),
        float(np.sqrt(np.mean((height.mm - truth.height_mm) ** 2))),
        float(truth.height_mm.max()),
        float(height.mm.max()),
    )
    true_map = HeightMap(truth.height_mm, np.ones_like(inside), height.mm_per_px)
    most_mm = float(np.percentile(np.abs(height.mm - truth.height_mm), 99.5))
    return row, [
        html.figure(_shown(frame), f"what the camera sees: {words}"),
        html.figure(relief(height, reading.get(ContactMask)), "measured height"),
        html.figure(relief(true_map, ContactMask(inside, height.mm_per_px)), "true height"),
        html.figure(
            deviation(height, true_map, most_mm=most_mm),
            f"measured less true; red is too high, full colour {1e3 * most_mm:.0f} µm",
        ),
    ]


def _sheared(stage: VirtualStage, ball_mm: float) -> list[str]:
    """Drag a ball until all of it slips."""
    _press(stage, _Object("", "sphere", 0.15, -0.1, 0.0, {"diameter_mm": 1.2}), ball_mm)
    figures: list[str] = []
    for _ in range(_MOST_SHEARS):
        stage.shear(dx_mm=0.03 * ball_mm, steps=2)
        truth = stage.truth()
        sticking = truth.stick.sum() / max(1, truth.contact.sum())
        slips = truth.contact & ~truth.stick
        if not figures or sticking == 0:
            words = (
                f"dragged by {truth.wrench[0]:.2f} N under {truth.wrench[2]:.2f} N: "
                f"{sticking:.0%} of the contact sticks; where it slips the arrows are red"
            )
            picture = arrows(_shown(stage.frame()), truth.displacement_mm, slips=slips)
            figures.append(html.figure(picture, words))
        if sticking == 0:
            break
    return figures


def _ball_mm(profile: Profile) -> float:
    view_mm = profile.image.width_px * profile.image.mm_per_px
    most_mm = 2 * (profile.gel.thickness_mm or view_mm)
    return round(min(BALL_SHARE * view_mm, most_mm), 2)


def _shown(frame: Frame) -> NDArray[np.uint8]:
    """(H, W, 3): colours as they are, and of lamps in turn three that lie apart."""
    pixels: NDArray[Any] = frame.pixels
    apart = np.arange(_COLOURS) * (pixels.shape[2] // _COLOURS)
    shown = pixels[..., apart].astype(np.float32) * (255 / frame.full_scale)
    return np.ascontiguousarray(shown.astype(np.uint8))
