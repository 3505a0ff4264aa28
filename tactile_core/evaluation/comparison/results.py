"""Results of a comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_core.evaluation.comparison.truth import Arrays
from tactile_core.profiles.model import Profile


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
