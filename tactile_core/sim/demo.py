"""The main job with no hardware and no files: calibrate, press, measure, compare, report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from tactile_core import html
from tactile_core.calibrating import calibrate
from tactile_core.calibrating.presses import angles_deg
from tactile_core.pictures import relief
from tactile_core.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.progress import Progress
from tactile_core.quantities import ContactMask, Frame, Gradients, HeightMap
from tactile_core.sim.ball import BallPress, render

CALIBRATION_PRESSES = 14
CALIBRATION_BALL_MM = 3.96


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
        _write(folder / "reference" / "untouched.png", _untouched(profile))
        result = calibrate(
            profile,
            folder / "presses",
            folder / "reference",
            ball_diameter_mm=CALIBRATION_BALL_MM,
            progress=progress,
        )
    pipeline = Pipeline(profile, result.bundle)
    rows, parts = [], [html.heading(f"{profile.name}: {profile.description}")]
    score = result.score
    if score is not None:
        parts.append(
            html.paragraph(
                f"Calibrated by {score.presses} presses of a {CALIBRATION_BALL_MM} mm ball; mean "
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
        html.figure(pixels, f"what the camera sees: {name}"),
        html.figure(relief(height, contact), "measured height"),
        html.figure(relief(true_map, None), "true height"),
    ]


def _write_presses(profile: Profile, folder: Path) -> None:
    rng = np.random.default_rng(7)
    image = profile.image
    shape = (image.height_px, image.width_px)
    for number in range(CALIBRATION_PRESSES):
        centre = (
            float(rng.uniform(0.12, 0.88) * image.width_px),
            float(rng.uniform(0.12, 0.88) * image.height_px),
        )
        press = BallPress(centre, CALIBRATION_BALL_MM, float(rng.uniform(0.6, 1.1)))
        pixels = render(profile, press.height_mm(shape, image.mm_per_px), seed=number + 1)
        _write(folder / f"press_{number:02d}.png", pixels)


def _unseen(profile: Profile) -> list[BallPress]:
    w, h = profile.image.width_px, profile.image.height_px
    return [
        BallPress((0.42 * w, 0.55 * h), 3.96, 0.8),
        BallPress((0.6 * w, 0.4 * h), 6.0, 0.6),
    ]


def _untouched(profile: Profile) -> np.ndarray:
    image = profile.image
    return render(profile, np.zeros((image.height_px, image.width_px)), seed=0)


def _write(path: Path, rgb: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), rgb[..., ::-1])
