"""The main job with no hardware and no files: calibrate, press, measure, compare, report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from tactile_core import html
from tactile_core.calibrating import calibrate
from tactile_core.calibrating.presses import angles_deg
from tactile_core.formats.images import write_png
from tactile_core.pictures import relief
from tactile_core.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.progress import Progress
from tactile_core.quantities import ContactMask, Frame, Gradients, HeightMap
from tactile_core.sim.ball import BallPress, render

CALIBRATION_PRESSES = 14
BALL_SHARE = 0.22
"""Diameter of the ball for calibrating, of the width of the view; thin gels take a smaller one."""

COLOURS = 3


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


def demonstrate(profile: Profile, progress: Progress) -> tuple[list[Row], list[str]]:
    """Calibrate a virtual rig by ball presses, press other balls, compare with the truth.

    Returns
    -------
    rows : list of Row
    parts : list of str
        HTML for the report.
    """
    with TemporaryDirectory(prefix="tactile-demo-") as name:
        folder = Path(name)
        _write_presses(profile, folder / "presses")
        _write(folder / "reference", "untouched", _untouched(profile))
        result = calibrate(
            profile,
            folder / "presses",
            folder / "reference",
            ball_diameter_mm=_ball_mm(profile),
            progress=progress,
        )
    pipeline = Pipeline(profile, result.bundle)
    rows, parts = [], [html.heading(f"{profile.name}: {profile.description}")]
    score = result.score
    if score is not None:
        parts.append(
            html.paragraph(
                f"Calibrated by {score.presses} presses of a {_ball_mm(profile):g} mm ball; mean "
                f"error of held-out normals {score.mean_deg:.2f}°."
            )
        )
    for number, press in enumerate(_unseen(profile)):
        row, figures = _measure(pipeline, press, seed=1000 + number)
        rows.append(row)
        parts += figures
    return rows, parts


def _measure(pipeline: Pipeline, press: BallPress, seed: int) -> tuple[Row, list[str]]:
    profile = pipeline.profile
    image = profile.image
    truth = press.height_mm((image.height_px, image.width_px), image.mm_per_px)
    pixels = render(profile, truth, seed=seed)
    channels = pipeline.reference.channels if pipeline.reference is not None else ()
    reading = pipeline.process(Frame(pixels, channels, image.mm_per_px, source="demo"))
    height, slopes = reading[HeightMap], reading[Gradients]
    contact = reading.get(ContactMask)
    gy, gx = (np.asarray(g) for g in np.gradient(truth, image.mm_per_px))
    inside = truth > truth.max() - press.depth_mm
    found = np.stack([slopes.x[inside], slopes.y[inside]], 1)
    error = angles_deg(found, np.stack([gx[inside], gy[inside]], 1))
    name = f"ball of {press.diameter_mm:g} mm, {press.depth_mm:g} mm deep"
    row = Row(
        profile.name,
        name,
        float(error.mean()),
        float(np.sqrt(np.mean((height.mm - truth) ** 2))),
        float(truth.max()),
        float(height.mm.max()),
    )
    true_map = HeightMap(truth.astype(np.float32), height.valid, image.mm_per_px)
    return row, [
        html.figure(_shown(pixels), f"what the camera sees: {name}"),
        html.figure(relief(height, contact), "measured height"),
        html.figure(relief(true_map, None), "true height"),
    ]


def _write_presses(profile: Profile, folder: Path) -> None:
    rng = np.random.default_rng(7)
    image = profile.image
    shape = (image.height_px, image.width_px)
    ball_mm = _ball_mm(profile)
    for number in range(CALIBRATION_PRESSES):
        centre = (
            float(rng.uniform(0.12, 0.88) * image.width_px),
            float(rng.uniform(0.12, 0.88) * image.height_px),
        )
        press = BallPress(centre, ball_mm, float(rng.uniform(0.15, 0.28)) * ball_mm)
        pixels = render(profile, press.height_mm(shape, image.mm_per_px), seed=number + 1)
        _write(folder, f"press_{number:02d}", pixels)


def _unseen(profile: Profile) -> list[BallPress]:
    w, h = profile.image.width_px, profile.image.height_px
    ball_mm = _ball_mm(profile)
    return [
        BallPress((0.42 * w, 0.55 * h), ball_mm, 0.2 * ball_mm),
        BallPress((0.6 * w, 0.4 * h), 1.5 * ball_mm, 0.15 * ball_mm),
    ]


def _ball_mm(profile: Profile) -> float:
    view_mm = profile.image.width_px * profile.image.mm_per_px
    most_mm = 2 * (profile.gel.thickness_mm or view_mm)
    return round(min(BALL_SHARE * view_mm, most_mm), 2)


def _untouched(profile: Profile) -> NDArray[np.uint8]:
    image = profile.image
    return render(profile, np.zeros((image.height_px, image.width_px)), seed=0)


def _write(folder: Path, name: str, pixels: NDArray[np.uint8]) -> None:
    """One colour image, or a folder with one grey image per lamp."""
    inside = folder if pixels.shape[2] == COLOURS else folder / name
    inside.mkdir(parents=True, exist_ok=True)
    if inside == folder:
        write_png(folder / f"{name}.png", pixels)
        return
    for k in range(pixels.shape[2]):
        write_png(folder / name / f"{k:02d}.png", pixels[..., k])


def _shown(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(H, W, 3): colours as they are, and of lamps in turn three that lie apart."""
    apart = np.arange(COLOURS) * (pixels.shape[2] // COLOURS)
    return np.ascontiguousarray(pixels[..., apart])
