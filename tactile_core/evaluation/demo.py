"""The main job with no hardware and no files: calibrate, press, measure, compare, report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.presses import angles_deg
from tactile_core.interfaces.progress import Progress
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.quantities import ContactMask, Frame, Gradients, HeightMap
from tactile_core.quantities.layers import Outline, Surface
from tactile_core.sim.simulation import write_frame
from tactile_core.sim.stage import VirtualStage
from tactile_core.views import html
from tactile_core.views.arrows import arrows
from tactile_core.views.maps import Overlay, deviation, relief

CALIBRATION_PRESSES = 12
BALL_SHARE = 0.22
"""Diameter of the ball for calibrating, of the width of the view; thin gels take a smaller one."""

_REACH = 0.38
_COLOURS = 3
_MOST_SHEARS = 40
_STICKING = (1.0, 0.66, 0.33, 0.0)
"""Shares of the contact that stick when a picture is taken of a drag."""

_NODES_BLUR = 0.05
_VIEW_CONTACTS = 3.5
"""How many widths of the contact a picture shows."""


@dataclass(frozen=True)
class DemoRow:
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


def demonstrate(profile: Profile, progress: Progress) -> tuple[list[DemoRow], list[str]]:
    """Calibrate a virtual rig by ball presses, press other things, compare with the truth.

    Returns
    -------
    rows : list of DemoRow
    parts : list of str
        HTML for the report.
    """
    stage, ball_mm = VirtualStage(profile), _ball_mm(profile)
    bundle, said = _calibrated(profile, stage, ball_mm, progress)
    pipeline = Pipeline(profile, bundle)
    rows, parts = [], [html.heading(f"{profile.name}: {profile.description}"), said]
    for thing in _OBJECTS:
        _press(stage, thing, ball_mm)
        row, figures = _measured(stage, pipeline, thing.words)
        rows.append(row)
        parts.append(html.row(figures))
    return rows, [*parts, *_sheared(stage, ball_mm)]


def _calibrated(
    profile: Profile, stage: VirtualStage, ball_mm: float, progress: Progress
) -> tuple[Bundle, str]:
    rng = np.random.default_rng(7)
    with TemporaryDirectory(prefix="tactile-demo-") as name:
        folder = Path(name)
        write_frame(folder / "reference", stage.frame(), "undeformed")
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
            scored=False,  # what follows tells more than held-out presses of the same ball
            progress=progress,
        )
    used = sum(press.used for press in result.presses)
    return result.bundle, html.paragraph(
        f"Calibrated on {used} presses of a {ball_mm:g} mm ball by {result.bundle.manifest.model}; "
        f"then other things are pressed, which it has never seen."
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


def _measured(stage: VirtualStage, pipeline: Pipeline, words: str) -> tuple[DemoRow, list[str]]:
    frame, truth = stage.frame(), stage.truth()
    reading = pipeline.process(frame)
    height, slopes = reading[HeightMap], reading[Gradients]
    inside = truth.contact
    error = angles_deg(np.stack([slopes.x, slopes.y], 2)[inside], truth.gradients[inside])
    row = DemoRow(
        stage.profile.name,
        words,
        float(error.mean()),
        float(np.sqrt(np.mean((height.mm - truth.height_mm) ** 2))),
        float(truth.height_mm.max()),
        float(height.mm.max()),
    )
    near, scale = _around(inside), height.mm_per_px
    touched = reading.get(ContactMask)
    found, real = (Surface(mm[near], scale) for mm in (height.mm, truth.height_mm))
    measured_contact = None if touched is None else _outlined(touched.mask, near)
    span_mm = (min(0.0, float(real.mm.min())), float(max(real.mm.max(), found.mm.max())))
    most_mm = float(np.percentile(np.abs(found.mm - real.mm), 99.5))
    drawn = [
        (_shown(frame)[near], f"{words}: what the camera sees"),
        (relief(found, measured_contact, span_mm=span_mm), "measured"),
        (relief(real, _outlined(inside, near), span_mm=span_mm), "true"),
        (
            deviation(found, real, most_mm=most_mm),
            f"measured less true, red is too high: normals {row.normal_error_deg:.1f}° off",
        ),
    ]
    return row, [html.figure(picture, caption, photo=True) for picture, caption in drawn]


def _sheared(stage: VirtualStage, ball_mm: float) -> list[str]:
    """Drag a ball until all of it slips, and show some moments of it."""
    _press(stage, _Object("", "sphere", 0.15, -0.1, 0.0, {"diameter_mm": 1.2}), ball_mm)
    figures: list[str] = []
    moments = list(_STICKING)
    for _ in range(_MOST_SHEARS):
        stage.shear(dx_mm=0.02 * ball_mm, steps=2)
        truth = stage.truth()
        sticking = truth.stick.sum() / max(1, truth.contact.sum())
        if sticking > moments[0]:
            continue
        moments = [moment for moment in moments if moment < sticking]
        near = _around(truth.contact)
        slips = (truth.contact & ~truth.stick)[near]
        picture = arrows(_shown(stage.frame())[near], truth.displacement_mm[near], slips=slips)
        words = f"dragged by {truth.wrench[0]:.2f} N under {truth.wrench[2]:.2f} N: " + (
            f"{sticking:.0%} of the contact sticks" if sticking else "all of it slips"
        )
        figures.append(html.figure(picture, words, photo=True))
        if not moments:
            break
    told = (
        "A ball is dragged to the right until it slips. Arrows are how the skin is displaced, the "
        "longest as long in every picture; red where it slides along the ball."
    )
    return [html.paragraph(told), html.row(figures)]


def _around(contact: NDArray[np.bool_]) -> tuple[slice, slice]:
    """The part of the image that is worth a look: some widths of the contact, shaped like it."""
    height, width = contact.shape
    rows, columns = np.nonzero(contact)
    share = min(1.0, _VIEW_CONTACTS * max(np.ptp(columns) / width, np.ptp(rows) / height, 0.02))
    return _span(rows, share * height, height), _span(columns, share * width, width)


def _span(places: NDArray[np.int_], length: float, whole: int) -> slice:
    start = round(float(np.clip(places.mean() - length / 2, 0, whole - length)))
    return slice(start, start + round(length))


def _outlined(contact: NDArray[np.bool_], near: tuple[slice, slice]) -> Overlay:
    """The contact with a smooth border: a fast simulation gives it by whole nodes."""
    blur_px = _NODES_BLUR * np.sqrt(contact.sum())
    smooth = cv2.GaussianBlur(contact.astype(np.float32), (0, 0), blur_px)
    return Overlay([Outline(smooth[near] > 0.5)])


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
