"""Compare calibrations, own and imported, on presses of a ball."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.bundles.bundle import Bundle
from tactile_core.bundles.places import find_place
from tactile_core.calibration.fitted_bundle import conditioning_for
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.targets import balls, undeformed_sensor
from tactile_core.errors import InputError
from tactile_core.evaluation.comparison import Variant, variants_of
from tactile_core.evaluation.comparison.report import NOTHING
from tactile_core.evaluation.own_resources import one_thread
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import played_back, read_frames, recorded_session
from tactile_core.plugins.options import calibrator_of
from tactile_core.quantities import ContactMask, Float32, Gradients, HeightMap
from tactile_core.recordings.session_files import taken_reference


@dataclass
class BallScore:
    """What one variant measures of the presses.

    Attributes
    ----------
    variant : Variant
    bundle : Bundle
    errors_deg : list of (N,) float
        Angles between measured and true normals, of the scored pixels of each press.
    sphere_ratios, depth_ratios : list of float
        Radius of the sphere in the height map over the ball's; largest height over the depth to
        which theory presses the ball into the gel where the contact has its size.
    contacts : list of bool
        Whether the contact that is found covers the middle of the true one.
    latency_ms : list of float
        Time from frame to reading, one thread.
    """

    variant: Variant
    bundle: Bundle
    errors_deg: list[np.ndarray] = field(default_factory=list)
    sphere_ratios: list[float] = field(default_factory=list)
    depth_ratios: list[float] = field(default_factory=list)
    contacts: list[bool] = field(default_factory=list)
    latency_ms: list[float] = field(default_factory=list)

    def add(self, press: FoundPress, reading: Reading) -> None:
        """Score a reading of a press."""
        gradients = reading.get(Gradients)
        height, contact = reading.get(HeightMap), reading.get(ContactMask)
        if contact is not None:
            x, y = press.centre_px
            self.contacts.append(bool(contact.mask[round(y), round(x)]))
        if gradients is None and height is not None:
            gradients = _slopes_of(height)
        if gradients is not None:
            self.errors_deg.append(press.normal_errors_deg(gradients))
        if height is not None:
            sphere = press.sphere(height.mm)
            if sphere is not None:
                self.sphere_ratios.append(sphere.radius_ratio)
            self.depth_ratios.append(_depth_ratio(press, height.mm))
        self.latency_ms.append(reading.latency_ms)

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        errors = np.concatenate(self.errors_deg) if self.errors_deg else np.empty(0)
        return {
            "variant": self.variant.name,
            "model": self.bundle.manifest.model,
            "imported": self.bundle.manifest.imported is not None,
            "normal_error_deg": {
                "mean": round(float(errors.mean()), 4),
                "median": round(float(np.median(errors)), 4),
                "p90": round(float(np.quantile(errors, 0.9)), 4),
            }
            if errors.size
            else None,
            "sphere_radius_ratio": _spread(self.sphere_ratios),
            "depth_ratio": _spread(self.depth_ratios),
            "contact_found": float(np.mean(self.contacts)) if self.contacts else None,
            "latency_ms": _spread(self.latency_ms),
        }


@dataclass(frozen=True)
class BallComparison:
    """Scores of calibrations on the same presses.

    Attributes
    ----------
    profile : str
    presses, used : int
        Number of presses, and of those whose circle was found.
    ball_diameters_mm : tuple of float
    scores : tuple of BallScore
    """

    profile: str
    presses: int
    used: int
    ball_diameters_mm: tuple[float, ...]
    scores: tuple[BallScore, ...]
    notes: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """The output of ``tactile compare --presses --json``."""
        return {
            "profile": self.profile,
            "presses": self.presses,
            "used": self.used,
            "ball_diameters_mm": list(self.ball_diameters_mm),
            "variants": [score.summary() for score in self.scores],
            "notes": list(self.notes),
        }

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Header, and one row per variant."""
        header = [
            "variant",
            "model",
            "normals, ° (mean / median / p90)",
            "sphere / ball (median, IQR)",
            "depth / theory (median, IQR)",
            "time, ms",
        ]
        return header, [_row(score.summary()) for score in self.scores]


def compare_on_presses(
    profile: str | Path,
    *,
    presses: Path,
    ball_diameter_mm: float | None,
    swaps: Iterable[tuple[str, str]] = (),
    bundle: Path | None = None,
    reference: Path | str | None = None,
    serial: str | None = None,
    progress: Progress | None = None,
) -> BallComparison:
    """Measure presses of a ball with several calibrations, and score each against the ball.

    The circles are found once, by a fit of the light to all presses, for all variants alike. A
    calibration that was fitted to these presses is scored in sample.

    Parameters
    ----------
    profile : str or Path
        A profile's name or the path of its YAML file.
    presses : Path
        A recording of the ball, pressed somewhere else in each observation.
    ball_diameter_mm : float or None
        Diameter of the ball; None where a ``catalog.csv`` in the folder lists it.
    swaps : iterable of (step, use)
        Each is one variant, as of :func:`~tactile_core.evaluation.comparison.compare`.
    bundle : Path, optional
        Calibration of all variants that do not swap it. Default: the unit's own.
    reference : Path or "median", optional
        Recording of the undeformed sensor. Default: that in the recording of the presses.
    serial : str, optional
        Serial number of the unit.
    progress : Progress, optional

    Raises
    ------
    InputError, ProfileError, PluginError, CalibrationError
        An input cannot be used; the message names it and the remedy.
    """
    progress = progress or Silent()
    variants = variants_of(profile, swaps, bundle)
    base, notes, _, _ = played_back(variants[0].profile, presses)
    frames = list(read_frames(base, presses))
    session = recorded_session(presses)
    own = None if session is None or reference else taken_reference(session, presses)
    undeformed, doubts = undeformed_sensor(base, frames, reference, None, own)
    condition = conditioning_for(base, undeformed, calibrator_of(base.calibration, None))
    found = balls(
        base, presses, frames, condition, ball_diameter_mm=ball_diameter_mm, progress=progress
    )
    scores = _with_bundles(variants, serial)
    pipelines = [Pipeline(score.variant.profile, score.bundle, undeformed) for score in scores]
    progress.stage("comparing", 0.5)
    with one_thread():
        for number, (press, frame) in enumerate(zip(found.surfaces, frames, strict=True)):
            for score, pipeline in zip(scores, pipelines, strict=True):
                if press.used:
                    score.add(press, pipeline.process(frame))
            progress.fraction((number + 1) / len(frames))
    used = sum(press.used for press in found.surfaces)
    sizes = tuple(found.ball_diameters_mm)
    return BallComparison(base.name, len(frames), used, sizes, tuple(scores), (*notes, *doubts))


def _with_bundles(variants: Sequence[Variant], serial: str | None) -> list[BallScore]:
    """Pair each variant with its calibration; one without any is left out if others have one."""
    scores = []
    for variant in variants:
        place = variant.bundle or find_place(variant.profile, serial)
        if place is not None:
            scores.append(BallScore(variant, Bundle.load(place)))
    if not scores:
        raise InputError(
            "there is no calibration to compare; give --bundle or --swap calibration=FOLDER"
        )
    return scores


def _slopes_of(height: HeightMap) -> Gradients:
    """Slopes of a height map that was measured directly."""
    gy, gx = (np.asarray(g, np.float32) for g in np.gradient(height.mm, height.mm_per_px))
    return Gradients(gx, gy, height.valid, height.mm_per_px, height.timestamp_s)


def _depth_ratio(press: FoundPress, height_mm: Float32) -> float:
    x, y = press.centre_px
    true_mm = press.true_heights_mm(np.array([round(y)]), np.array([round(x)]))[0]
    return float(height_mm[press.area()].max() / true_mm)


def _spread(values: Sequence[float]) -> dict[str, float] | None:
    if not values:
        return None
    low, median, high = np.percentile(values, (25, 50, 75))
    return {"median": round(float(median), 4), "iqr": round(float(high - low), 4)}


def _row(summary: Mapping[str, Any]) -> list[str]:
    errors = summary["normal_error_deg"]
    cells = [NOTHING if errors is None else " / ".join(f"{value:.2f}" for value in errors.values())]
    for name in ("sphere_radius_ratio", "depth_ratio"):
        spread = summary[name]
        cells.append(NOTHING if spread is None else f"{spread['median']:.3f}, {spread['iqr']:.3f}")
    model = f"{summary['model']}{' (imported)' if summary['imported'] else ''}"
    return [summary["variant"], model, *cells, f"{summary['latency_ms']['median']:.1f}"]
