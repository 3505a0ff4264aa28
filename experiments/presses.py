"""Ball presses: two-fold split into calibration and held-out presses, in both directions."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.press_sets import Presses
from experiments.sphere import radius_px
from experiments.table_row import Row, command
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.press_search import find_presses, light_of, relocate_press
from tactile_core.calibration.presses import FoundPress, angles_deg
from tactile_core.calibration.result import Calibrated
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.quantities import Gradients, HeightMap


@dataclass(frozen=True)
class Half:
    """Errors on held-out presses."""

    errors_deg: NDArray[np.float64]
    flat_deg: NDArray[np.float64]
    sphere: NDArray[np.float64]
    """Radius of a sphere fitted to each press's height map, relative to the ball's radius."""


def rows(data: Path, chosen: Presses, *, folds: bool = True, model: str | None = None) -> list[Row]:
    """Measure each half of the presses with a calibration on the other half.

    ``folds`` adds five-fold cross-validation over all presses.
    """
    folder = data / chosen.folder
    files = sorted(folder.glob(chosen.pattern))
    halves = {
        "even → odd": half(folder, chosen, files[::2], files[1::2], model),
        "odd → even": half(folder, chosen, files[1::2], files[::2], model),
    }
    values = {way: float(h.errors_deg.mean()) for way, h in halves.items()}
    control = {f"predict flat, {way}": float(h.flat_deg.mean()) for way, h in halves.items()}
    also = {f"sphere radius / ball's, {w}": float(np.median(h.sphere)) for w, h in halves.items()}
    if folds:
        also["five folds over all"] = folded_deg(folder, chosen, files, model)
    return [
        Row(
            chosen.name,
            "mean error of the normal within 0.8 of the contact, degrees",
            f"{chosen.folder}: {chosen.what}, ball of {chosen.ball_mm:g} mm",
            f"{len(files)} presses, {len(files[::2])} against {len(files[1::2])}",
            "out of sample: other presses of the same ball on the same unit",
            values,
            max(values.values()),
            control,
            command(chosen.name),
            also,
        )
    ]


def half(
    folder: Path, chosen: Presses, seen: Sequence[Path], unseen: Sequence[Path], model: str | None
) -> Half:
    """Calibrate on some presses like a user, and measure the others with the bundle."""
    made = calibrated(folder, chosen, seen, model, scored=False)
    pipeline = Pipeline(chosen.profile, made.bundle)
    train = [press for press in made.presses if isinstance(press, FoundPress) and press.used]
    light = light_of(train)
    errors, flat, spheres = [], [], []
    for file in unseen:
        (frame,) = read_frames(pipeline.profile, file)
        reading = pipeline.process(frame)
        (start,) = find_presses(
            [file.name], [reading.frame], made.bundle.reference, train[0].ball_radius_px
        )
        press = relocate_press(start, light)
        slopes = reading[Gradients]
        *_, true = press.true_gradients(press.scored_area())
        errors.append(press.normal_errors_deg(slopes))
        flat.append(angles_deg(np.zeros_like(true), true))
        spheres.append(radius_px(reading[HeightMap], press) / press.ball_radius_px)
    return Half(np.concatenate(errors), np.concatenate(flat), np.array(spheres))


def folded_deg(folder: Path, chosen: Presses, files: Sequence[Path], model: str | None) -> float:
    """Cross-validation score that a calibration on all presses reports."""
    score = calibrated(folder, chosen, files, model, scored=True).score
    return float("nan") if score is None else score.mean_deg


def calibrated(
    folder: Path, chosen: Presses, files: Sequence[Path], model: str | None, *, scored: bool
) -> Calibrated:
    """Calibrate on some of the files."""
    with tempfile.TemporaryDirectory() as copies:
        for file in files:
            shutil.copy(file, copies)
        return calibrate(
            chosen.profile,
            Path(copies),
            folder / chosen.reference,
            ball_diameter_mm=chosen.ball_mm,
            model=model,
            scored=scored,
        )
