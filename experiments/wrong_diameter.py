"""Which wrong diameters of the ball a calibration notices.

``python experiments/wrong_diameter.py [DATA]`` calibrates with diameters that are wrong by a factor
and prints for each whether the presses are ``refused``, the result is ``doubted``, or ``silent``;
``few`` is a doubt that only says that most presses of a size cannot be used. With a folder of
recordings on their balls; always on virtual units with a ball, and with two balls of which the
smaller is declared wrongly.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from experiments.press_sets import HERE, SETS
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.calibration.fitting import calibrate
from tactile_core.errors import CalibrationError
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim.optics.rig import render

FACTORS = (0.5, 0.63, 0.7, 0.8, 1.0, 1.25, 1.4, 1.6, 2.0)
RIGS = ("hex_fingertip_unmarked", str(HERE / "mini_virtual.yaml"))
MOST = 24
"""Presses of a recording; more take longer and say the same."""
_MM_PER_PX = 0.055


def judged(
    profile: Profile, files: Mapping[Path, float], reference: Path, *, scored: bool = False
) -> str:
    """Calibrate with the declared diameter of each file."""
    with TemporaryDirectory() as place:
        rows = ["file,diameter_mm"]
        for file, diameter_mm in files.items():
            shutil.copy(file, place)
            rows.append(f"{file.name},{diameter_mm}")
        (Path(place) / "catalog.csv").write_text("\n".join(rows) + "\n")
        try:
            made = calibrate(profile, Path(place), reference, scored=scored)
        except CalibrationError:
            return "refused"
    doubts = made.bundle.manifest.doubts
    if any(
        "wide" in doubt or "deep in" in doubt or "diameter of each" in doubt for doubt in doubts
    ):
        return "doubted"
    return "few" if any("can be used" in doubt for doubt in doubts) else "silent"


def virtual(
    rig: str, place: Path, balls_mm: tuple[float, ...], depth: float
) -> tuple[Profile, dict[Path, float], Path]:
    """Press each ball ten times on a virtual unit; depths are up to a share of its diameter."""
    size = {"width_px": 320, "height_px": 240, "mm_per_px": _MM_PER_PX}
    profile = load_profile(rig, overrides={"image": size})
    random = np.random.default_rng(0)
    files = {}
    for number in range(10 * len(balls_mm)):
        ball_mm = balls_mm[number % len(balls_mm)]
        place_px = float(random.uniform(80, 240)), float(random.uniform(70, 170))
        press = BallPress(place_px, ball_mm, float(depth * ball_mm * random.uniform(0.7, 1)))
        height_mm = press.height_mm((240, 320), _MM_PER_PX)
        file = place / f"press_{number:02d}.png"
        cv2.imwrite(str(file), render(profile, height_mm, seed=number)[..., ::-1])
        files[file] = ball_mm
    reference = place / "reference.png"
    cv2.imwrite(str(reference), render(profile, np.zeros((240, 320)), seed=99)[..., ::-1])
    return profile, files, reference


def line(
    name: str, profile: Profile, files: Mapping[Path, float], reference: Path, small_mm: float = 0
) -> None:
    """Print the verdicts; with ``small_mm`` only that ball is declared wrongly."""
    words = []
    for factor in FACTORS:
        wrong = {f: d * (factor if small_mm in (0, d) else 1) for f, d in files.items()}
        words.append(judged(profile, wrong, reference, scored=bool(small_mm)))
    print(f"{name:34}", *(f"{word:8}" for word in words), flush=True)


def main(data: Path | None) -> None:
    """Print a line for each set of presses."""
    print(f"{'declared over true diameter':34}", *(f"{factor:<8g}" for factor in FACTORS))
    for chosen in () if data is None else SETS:
        files = sorted((data / chosen.folder).glob(chosen.pattern))[:MOST]
        profile = load_profile(chosen.profile)
        reference = data / chosen.folder / chosen.reference
        line(chosen.name, profile, dict.fromkeys(files, chosen.ball_mm), reference)
    for rig in RIGS:
        for depth in (0.2, 0.1):
            with TemporaryDirectory() as place:
                line(
                    f"{Path(rig).stem}, {depth:g} D deep", *virtual(rig, Path(place), (4.0,), depth)
                )
        with TemporaryDirectory() as place:
            two = virtual(rig, Path(place), (3.5, 6.0), 0.12)
            line(f"{Path(rig).stem}, of two balls one", *two, small_mm=3.5)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
