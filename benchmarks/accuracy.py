"""Accuracy on real recordings: ``python benchmarks/accuracy.py [DATA] [--only NAME]``.

Five-fold over presses: light, circles and model of a fold know nothing of the presses that they are
scored on. Prints one row per sensor and model.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tactile_core.acquisition import average
from tactile_core.calibrating.presses import FoundPress, find_presses, light_of, relocated, used
from tactile_core.calibration import Calibration
from tactile_core.marks import MarkFinder
from tactile_core.plugins import resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Gradients, HeightMap, Reference
from tactile_core.sensor import read_frames

ROOT = Path(__file__).resolve().parents[1]
FOLDS = 5
MODELS = ("core.automatic", "core.mlp", "core.polynomial", "core.lookup_table")


@dataclass(frozen=True)
class Set:
    """Presses of one sensor."""

    profile: Profile
    frames: list[Frame]
    reference: Reference
    ball_radius_mm: float
    labels_px: NDArray[np.float64]
    """(N, 3) centre and radius as a person drew them."""

    @property
    def ball_px(self) -> float:
        return self.ball_radius_mm / self.profile.image.mm_per_px


def objectfolder(data: Path) -> Set:
    folder = data / "three_colour" / "objectfolder"
    with (folder / "presses.csv").open() as rows:
        labels = {
            Path(row["file"]).stem: [
                float(row[key]) for key in ("centre_x_px", "centre_y_px", "contact_radius_px")
            ]
            for row in csv.DictReader(rows)
        }
    profile = load_profile(ROOT / "examples" / "objectfolder.yaml")
    return _set(profile, folder / "presses", folder / "reference.png", 2.0, labels)


def wedge(data: Path) -> Set:
    folder = data / "three_colour" / "wedge"
    labels = {
        path.stem: np.loadtxt(path).tolist() for path in (folder / "ball_position").glob("*.txt")
    }
    profile = load_profile(ROOT / "examples" / "wedge" / "wedge.yaml")
    return _set(profile, folder, folder / "bg-0.jpg", 2.42, labels)


def _set(
    profile: Profile,
    presses: Path,
    untouched: Path,
    radius_mm: float,
    labels: dict[str, list[float]],
) -> Set:
    reference = average(list(read_frames(profile, untouched)))
    frames = [f for f in read_frames(profile, presses) if f.source in labels]
    marks = MarkFinder.of(profile)
    if marks is not None:
        reference = replace(reference, marks=marks.find(reference.pixels))
        frames = [replace(frame, marks=marks.find(frame.pixels)) for frame in frames]
    drawn = np.array([labels[frame.source] for frame in frames])
    return Set(profile, frames, reference, radius_mm, drawn)


def circles(data: Set, subset: list[int]) -> list[FoundPress]:
    return find_presses(
        [data.frames[i].source for i in subset],
        [data.frames[i] for i in subset],
        data.reference,
        data.ball_px,
    )


def say_circles(name: str, data: Set) -> list[FoundPress]:
    everything = circles(data, list(range(len(data.frames))))
    accepted = sum(press.circle.used for press in everything)
    halves = []
    for half in (0, 1):
        members = used(circles(data, list(range(half, len(data.frames), 2))))
        light = light_of(members)
        again = [relocated(press, light).circle for press in everything]
        halves.append(np.array([[*c.centre_px, c.contact_radius_px] for c in again]))
    off = halves[0] - halves[1]
    print(
        f"{name}: accepted {accepted} of {len(everything)}; circles from disjoint halves differ by "
        f"{np.median(np.hypot(off[:, 0], off[:, 1])):.2f} px (centre), "
        f"{np.median(np.abs(off[:, 2])):.2f} px (contact radius)",
        flush=True,
    )
    return everything


def fitted(use: str, presses: list[FoundPress], reference: Reference) -> Calibration:
    cls = resolve("calibration", use)
    return cls.fit([press.training() for press in presses], reference, cls.Options())


def score(name: str, data: Set, found: list[FoundPress], use: str) -> None:
    height_step = resolve("estimator", data.profile.estimators["height"].use)
    from tactile_core.estimator import SensorContext

    step = height_step(
        height_step.Options(), SensorContext(data.profile.image, data.profile.gel, data.reference)
    )
    refined, labelled, spheres, far = [], [], [], []
    for fold in range(FOLDS):
        train = [p for i, p in enumerate(found) if i % FOLDS != fold and p.circle.used]
        model, light = fitted(use, train, data.reference), light_of(train)
        for i in range(fold, len(found), FOLDS):
            press = relocated(found[i], light)
            slopes = model.measure(press.frame, data.reference)
            assert isinstance(slopes, Gradients)
            refined.append(press.normal_errors_deg(slopes))
            x, y, radius = data.labels_px[i]
            drawn = replace(press.circle, centre_px=(x, y), contact_radius_px=radius)
            labelled.append(replace(press, circle=drawn).normal_errors_deg(slopes))
            height = step.estimate(slopes)
            spheres.append(abs(sphere_radius_px(height, press) / data.ball_px - 1))
            far.append(far_rms(height, press))
    errors = np.concatenate(refined)
    print(
        f"{name} {use:18s} normals {errors.mean():.2f}° (median {np.median(errors):.2f}, 90 % "
        f"{np.percentile(errors, 90):.2f}); against raw labels "
        f"{np.concatenate(labelled).mean():.2f}°; "
        f"sphere radius off {100 * np.median(spheres):.1f} %; far from contact "
        f"{100 * np.median(far):.1f} % of the depth",
        flush=True,
    )


def sphere_radius_px(height: HeightMap, press: FoundPress) -> float:
    """Radius of the sphere through the height inside the contact."""
    mask = press.skin(0.65 * press.ball_radius_px)
    rows, columns = np.nonzero(mask)
    x0, y0 = press.circle.centre_px
    x, y = columns - x0, rows - y0
    z = height.mm[mask] / height.mm_per_px
    ball = press.ball_radius_px

    def residual(t: NDArray[np.float64]) -> NDArray[np.float64]:
        square = t[3] ** 2 - (x - t[0]) ** 2 - (y - t[1]) ** 2
        return np.asarray(t[2] + np.sqrt(np.maximum(square, 1e-3)) - z)

    start = [0.0, 0.0, float(z.max()) - ball, ball]
    return float(least_squares(residual, start, loss="soft_l1", f_scale=0.3).x[3])


def far_rms(height: HeightMap, press: FoundPress) -> float:
    """RMS of the height beyond three ball radii, as a share of the depth."""
    far = ~press.disc(3 * press.ball_radius_px)
    near = press.disc(0.3 * press.ball_radius_px)
    if not far.any() or not near.any():
        return float("nan")
    return float(np.sqrt(np.mean(height.mm[far] ** 2)) / height.mm[near].max())


def few(data: Set, found: list[FoundPress], count: int = 5, draws: int = 6) -> None:
    errors = []
    for seed in range(draws):
        pick = np.random.default_rng(seed).choice(len(found), count, replace=False)
        train = circles(data, sorted(int(i) for i in pick))
        model, light = fitted("core.automatic", used(train), data.reference), light_of(used(train))
        for i in set(range(len(found))) - set(pick.tolist()):
            press = relocated(found[i], light)
            slopes = model.measure(press.frame, data.reference)
            assert isinstance(slopes, Gradients)
            errors.append(press.normal_errors_deg(slopes))
    print(f"{count} presses only, {draws} draws: normals {np.concatenate(errors).mean():.2f}°")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("data", nargs="?", default=ROOT.parent / "shared" / "data", type=Path)
    parser.add_argument("--only", choices=("objectfolder", "wedge"))
    options = parser.parse_args()
    for name, load in (("objectfolder", objectfolder), ("wedge", wedge)):
        if options.only in (None, name):
            data = load(options.data)
            found = say_circles(name, data)
            for use in MODELS:
                score(name, data, found, use)
            if name == "objectfolder":
                few(data, found)


if __name__ == "__main__":
    main()
