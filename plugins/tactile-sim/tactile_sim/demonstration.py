"""The demo: a virtual fingertip, calibrated and compared with its truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.presses import angles_deg
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.interfaces.illumination import COLOUR
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.workers import Workers, answer_each
from tactile_core.plugins.options import calibrator_of, smoothing_px_of
from tactile_core.profiles.model import Profile
from tactile_core.quantities import ContactMask, Frame, Gradients, HeightMap
from tactile_core.quantities.fields import Outline, Surface, VectorMap
from tactile_core.views import html
from tactile_core.views.maps import Overlay, deviation, relief
from tactile_core.views.pictures import draw_on_frame
from tactile_sim.simulation import ball_diameter_mm, press_balls, put_object
from tactile_sim.stage import VirtualStage


@dataclass(frozen=True)
class DemoRow:
    """Accuracy of one press.

    Attributes
    ----------
    normal_error_deg : float
        Mean angle between measured and true normals in the contact.
    height_error_mm : float
        RMS over the whole image.
    depth_mm, measured_depth_mm : float
        Peak of the true and of the measured height map.
    resolved : bool
        Whether the camera resolves the object's peak. The smoothing of the image rounds a cone's
        tip, however accurate the calibration is.
    """

    rig: str
    press: str
    normal_error_deg: float
    height_error_mm: float
    depth_mm: float
    measured_depth_mm: float
    resolved: bool = True

    @property
    def depth_ratio(self) -> float:
        """Measured depth over true depth."""
        return self.measured_depth_mm / self.depth_mm


@dataclass(frozen=True)
class _Object:
    """An object to press; sizes and depth in diameters of the calibration ball."""

    label: str
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


Demonstration = tuple[list[DemoRow], list[str]]  # Figures of one rig, and HTML for the report


def demonstrate(profile: Profile) -> Demonstration:
    """Calibrate a virtual sensor by ball presses, then measure other objects against the truth."""
    stage = VirtualStage(profile)
    bundle, summary = _calibrate_stage(profile, stage)
    pipeline = Pipeline(profile, bundle)
    rows, parts = [], [html.heading(f"{profile.name}: {profile.description}"), summary]
    for pressed in _OBJECTS:
        _press(stage, pressed)
        row, figures = _measure_stage(stage, pipeline, pressed.label)
        rows.append(row)
        parts.append(html.row(figures))
    return rows, [*parts, *_shear_ball(stage)]


def _calibrate_stage(profile: Profile, stage: VirtualStage) -> tuple[Bundle, str]:
    with TemporaryDirectory(prefix="tactile-demo-") as name:
        folder = Path(name)
        ball_mm = press_balls(stage, folder, count=12)
        result = calibrate(
            profile,
            folder / "presses",
            folder / "reference",
            ball_diameter_mm=ball_mm,
            scored=False,  # other objects test the calibration better than held-out ball presses
            progress=Silent(),
        )
    used = sum(press.used for press in result.presses)
    return result.bundle, html.paragraph(
        f"{result.bundle.manifest.model}, calibrated on {used} presses of a {ball_mm:g} mm ball. "
        f"The objects below were not part of the calibration."
    )


def _press(stage: VirtualStage, pressed: _Object) -> None:
    ball_mm = ball_diameter_mm(stage.profile)
    sizes_mm = {name: size * ball_mm for name, size in pressed.sizes.items()}
    put_object(stage, pressed.kind, pressed.x, pressed.y, pressed.angle_deg, **sizes_mm)
    stage.press(depth_mm=pressed.depth * ball_mm)


def _measure_stage(
    stage: VirtualStage, pipeline: Pipeline, label: str
) -> tuple[DemoRow, list[str]]:
    frame, truth = stage.frame(), stage.truth()
    reading = pipeline.process(frame)
    height, slopes = reading[HeightMap], reading[Gradients]
    inside = truth.contact
    error = angles_deg(np.stack([slopes.x, slopes.y], 2)[inside], truth.gradients[inside])
    row = DemoRow(
        stage.profile.name,
        label,
        float(error.mean()),
        float(np.sqrt(np.mean((height.mm - truth.height_mm) ** 2))),
        float(truth.height_mm.max()),
        float(height.mm.max()),
        is_resolved(truth.height_mm, pipeline.profile),
    )
    near, scale = _around(inside), height.mm_per_px
    contact = reading.get(ContactMask)
    measured, true = (Surface(mm[near], scale) for mm in (height.mm, truth.height_mm))
    measured_contact = None if contact is None else Overlay([Outline(contact.mask[near])])
    span_mm = (min(0.0, float(true.mm.min())), float(max(true.mm.max(), measured.mm.max())))
    most_mm = float(np.percentile(np.abs(measured.mm - true.mm), 99.5))
    drawn = [
        (_draw_frame(frame)[near], f"{label}: camera image"),
        (relief(measured, measured_contact, span_mm=span_mm), "measured height"),
        (relief(true, Overlay([Outline(inside[near])]), span_mm=span_mm), "true height"),
        (
            deviation(measured, true, most_mm=most_mm),
            f"height error (red: too high); mean normal error {row.normal_error_deg:.1f}°",
        ),
    ]
    return row, [html.figure(picture, caption, photo=True) for picture, caption in drawn]


def is_resolved(height_mm: NDArray[np.float32], profile: Profile) -> bool:
    """Whether the peak of a true height map withstands the smoothing of the calibration."""
    blur_px = smoothing_px_of(calibrator_of(profile.calibration), profile.image.mm_per_px)
    smooth = cv2.GaussianBlur(height_mm, (0, 0), max(blur_px, 1e-3))
    return bool(smooth.max() >= 0.98 * height_mm.max())  # the accuracy wanted of a peak is 2 %


def _shear_ball(stage: VirtualStage) -> list[str]:
    """Shear a ball until gross slip, and show stages of partial slip."""
    ball_mm = ball_diameter_mm(stage.profile)
    _press(stage, _Object("", "sphere", 0.15, -0.1, 0.0, {"diameter_mm": 1.2}))
    figures: list[str] = []
    stick_shares = [1.0, 0.66, 0.33, 0.0]  # full stick, partial slip twice, gross slip
    for _ in range(40):
        stage.shear(dx_mm=0.02 * ball_mm, steps=2)
        truth = stage.truth()
        sticking = truth.stick.sum() / max(1, truth.contact.sum())
        if sticking > stick_shares[0]:
            continue
        stick_shares = [share for share in stick_shares if share < sticking]
        near = _around(truth.contact)
        frame = stage.frame()
        frame = replace(frame, pixels=frame.pixels[near], marker_mask=None)
        slips = Outline((truth.contact & ~truth.stick)[near])
        moved = VectorMap(truth.displacement_mm[near], None, "mm")
        picture = draw_on_frame(frame, Overlay([slips], vectors=moved))
        force = f"shear force {truth.wrench[0]:.2f} N, normal force {truth.wrench[2]:.2f} N"
        state = f"{sticking:.0%} of the contact sticks" if sticking else "gross slip"
        figures.append(html.figure(picture, f"{force}: {state}", photo=True))
        if not stick_shares:
            break
    caption = (
        "A ball is sheared to the right until it slips. Arrows show the displacement of the gel "
        "surface; the slip region is outlined."
    )
    return [html.paragraph(caption), html.row(figures)]


def _around(contact: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Section of the image around a contact, with the image's aspect ratio."""
    height, width = contact.shape
    rows, columns = np.nonzero(contact)
    size = max(np.ptp(columns) / width, np.ptp(rows) / height, 0.02)
    share = min(1.0, 3.5 * size)  # the section is as wide as 3.5 contacts
    return _span(rows, share * height, height), _span(columns, share * width, width)


def _span(places: NDArray[np.int_], length: float, whole: int) -> slice:
    start = round(float(np.clip(places.mean() - length / 2, 0, whole - length)))
    return slice(start, start + round(length))


def _draw_frame(frame: Frame) -> NDArray[np.uint8]:
    """(H, W, 3) image: the colours, or three evenly spaced channels of sequential lights."""
    pixels: NDArray[Any] = frame.pixels
    channels = np.arange(COLOUR) * (pixels.shape[2] // COLOUR)
    shown = pixels[..., channels].astype(np.float32) * (255 / frame.full_scale)
    return np.ascontiguousarray(shown.astype(np.uint8))


def demonstrate_rigs(
    profiles: Sequence[Profile], progress: Progress, *, processes: int
) -> list[Demonstration]:
    """Demonstrate rigs in several processes, each rig in one of them.

    The results do not depend on the number of processes. An exception ends all of them.

    Parameters
    ----------
    profiles : sequence of Profile
    progress : Progress
    processes : int

    Returns
    -------
    list of Demonstration
        In the order of the profiles.

    Raises
    ------
    TactileError
        Of the first rig that cannot be demonstrated.
    """
    progress.stage(f"calibrating and measuring {len(profiles)} virtual sensors", 1.0)
    with Workers(min(processes, len(profiles)), answer_each, demonstrate) as crew:
        tasks = [crew.ask(profile) for profile in profiles]
        for count, task in enumerate(as_completed(tasks), 1):
            task.result()
            progress.fraction(count / len(tasks))
    return [task.result() for task in tasks]
