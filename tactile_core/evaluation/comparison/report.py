"""The table and the page of a comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_core.evaluation.comparison.accuracy import Arrays
from tactile_core.profiles.model import Profile
from tactile_core.quantities.fields import Outline, Surface
from tactile_core.views.html import figure, heading, page, paragraph, table
from tactile_core.views.maps import Overlay, deviation, relief


@dataclass(frozen=True)
class Scored:
    """Accuracy, time and memory of one variant.

    Attributes
    ----------
    name : str
        ``as it is`` for the unchanged profile, or the swap.
    accuracy : dict
        See :meth:`~tactile_core.evaluation.comparison.accuracy.Accuracy.summary`.
    latency_ms : (n,) tuple of float
        Time from frame to reading, one thread, without the first frame (warm-up).
    peak_memory_mib : float or None
        Peak resident memory of a process that only measures this recording, including Python and
        libraries; None if the system does not report it.
    notes : tuple of str
        Notes of the sensor on opening.
    """

    name: str
    accuracy: dict[str, Any]
    latency_ms: tuple[float, ...]
    peak_memory_mib: float | None
    notes: tuple[str, ...] = ()

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        median, p90 = np.percentile(self.latency_ms, [50, 90])
        return {
            "variant": self.name,
            **self.accuracy,
            "latency_ms": {"median": round(float(median), 3), "p90": round(float(p90), 3)},
            "timed_frames": len(self.latency_ms),
            "peak_memory_mib": self.peak_memory_mib and round(self.peak_memory_mib, 1),
            "notes": list(self.notes),
        }


@dataclass(frozen=True, eq=False)
class Comparison:
    """Scores of the variants of a profile on one recording.

    Attributes
    ----------
    profile : Profile
    frames : int
        Number of scored frames.
    variants : tuple of Scored
        The unchanged profile, then one variant per swap.
    shown : str
        Name of the frame with the highest true peak, for figures.
    shown_truth : mapping of name to array
        Ground truth of this frame.
    shown_arrays : tuple of mapping
        Measurements of this frame by each variant.
    """

    profile: Profile
    frames: int
    variants: tuple[Scored, ...]
    shown: str
    shown_truth: Arrays
    shown_arrays: tuple[Arrays, ...]

    def summary(self) -> dict[str, Any]:
        """The output of ``tactile compare --json``."""
        return {
            "profile": self.profile.name,
            "frames": self.frames,
            "variants": [scored.summary() for scored in self.variants],
        }


NOTHING = "–"  # Cell of a score that does not exist

_EXPLAINED = (
    "Normals: angle between measured and true normals, over all pixels and over the true contact. "
    "Height: root mean square error over the same two sets of pixels; peak: mean difference of the "
    "highest points. IoU: intersection over union of measured and true contact. Time: from frame "
    "to reading on one core with one thread, variants interleaved. Memory: peak resident memory of "
    "a process that only measures this recording, including Python and libraries."
)


def comparison_table(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Header, and one row per variant."""
    summaries = [variant.summary() for variant in comparison.variants]
    extra = sorted({name for s in summaries for kind in ("iou", "rmse") for name in s[kind]})
    extra = [name for name in extra if name != "contact"]
    header = [
        "variant",
        "normals, ° (mean / median / p90)",
        "in contact, °",
        "height, µm",
        "in contact, µm",
        "peak, µm",
        "contact IoU",
        *extra,
        "time, ms (median / p90)",
        "memory, MiB",
    ]
    return header, [_row(summary, extra) for summary in summaries]


def comparison_page(comparison: Comparison) -> str:
    """HTML of the table, and figures of the frame with the highest true peak."""
    parts = [
        paragraph(f"{comparison.profile.name}: {comparison.frames} frames."),
        table(*comparison_table(comparison)),
        paragraph(_EXPLAINED),
    ]
    truth = comparison.shown_truth
    if "height_mm" in truth:
        parts.append(heading(f"Frame {comparison.shown}"))
        parts += _figures(comparison, truth)
    return page("Comparison of variants on one recording", parts)


def _figures(comparison: Comparison, truth: Arrays) -> list[str]:
    shown = comparison.shown_arrays
    mm_per_px = next(float(a["mm_per_px"]) for a in shown if "mm_per_px" in a)
    true_map = _map(truth["height_mm"], mm_per_px)
    heights = [_map(a["height_mm"], mm_per_px) if "height_mm" in a else None for a in shown]
    errors = [np.abs(h.mm - true_map.mm) for h in heights if h is not None]
    # one scale for all figures; single pixels do not set it
    # [percent] There the colour scale ends
    most_mm = max((float(np.percentile(error, 99.5)) for error in errors), default=0.0)
    figures = [figure(relief(true_map, _contact(truth)), "truth")]
    for variant, height, arrays in zip(comparison.variants, heights, shown, strict=True):
        figures.append(heading(variant.name))
        if height is None:
            figures.append(paragraph("No height was measured."))
            continue
        figures.append(figure(relief(height, _contact(arrays)), "measured"))
        error = deviation(height, true_map, most_mm=most_mm)
        figures.append(figure(error, "height error (red: too high)"))
    return figures


def _map(height_mm: np.ndarray, mm_per_px: float) -> Surface:
    return Surface(np.asarray(height_mm, np.float32), mm_per_px)


def _contact(arrays: Arrays) -> Overlay:
    return Overlay([Outline(arrays["contact"])] if "contact" in arrays else ())


def _row(summary: dict[str, Any], extra: list[str]) -> list[str]:
    return [
        summary["variant"],
        _several(summary["normal_error_deg"]),
        _several(summary["normal_error_in_contact_deg"]),
        _microns(summary["height_rmse_mm"]),
        _microns(summary["height_rmse_in_contact_mm"]),
        _microns(summary["peak_error_mm"]),
        _format_value(summary["iou"].get("contact"), "{:.3f}"),
        *(_other(summary["iou"].get(name, summary["rmse"].get(name))) for name in extra),
        _several(summary["latency_ms"]),
        _format_value(summary["peak_memory_mib"], "{:.0f}"),
    ]


def _format_value(value: float | None, form: str) -> str:
    return NOTHING if value is None else form.format(value)


def _several(values: dict[str, float] | None) -> str:
    return NOTHING if values is None else " / ".join(f"{value:.2f}" for value in values.values())


def _microns(value_mm: float | None) -> str:
    return NOTHING if value_mm is None else f"{1e3 * value_mm:.1f}"


def _other(value: Any) -> str:
    if value is None:
        return NOTHING
    return " ".join(f"{v:.4g}" for v in (value if isinstance(value, list) else [value]))
