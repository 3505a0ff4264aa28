"""What the variants reached, and how it is told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_core.evaluation.comparison.truth import Arrays
from tactile_core.profiles.model import Profile


@dataclass(frozen=True)
class Scored:
    """What one variant reached.

    Attributes
    ----------
    name : str
        ``as it is``, or the swap.
    accuracy : dict
        See :meth:`~tactile_core.evaluation.comparison.accuracy.Accuracy.summary`.
    latency_ms : (n,) tuple of float
        From frame to reading, one thread; the first of a pass, which prepares tables, is left out.
    peak_memory_mib : float or None
        Largest resident memory of a process that only measures this recording, Python and
        libraries included; None where the system does not tell.
    notes : tuple of str
        What the sensor said when it was opened.
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
    """The variants of a profile, measured on one recording.

    Attributes
    ----------
    profile : Profile
    frames : int
        How many were scored.
    variants : tuple of Scored
        The profile as it is, then one for each swap.
    shown : str
        The frame with the highest truth, for pictures.
    shown_truth : mapping of name to array
    shown_arrays : tuple of mapping
        What each variant measured of it.
    """

    profile: Profile
    frames: int
    variants: tuple[Scored, ...]
    shown: str
    shown_truth: Arrays
    shown_arrays: tuple[Arrays, ...]

    def summary(self) -> dict[str, Any]:
        """What ``tactile compare --json`` prints."""
        return {
            "profile": self.profile.name,
            "frames": self.frames,
            "variants": [scored.summary() for scored in self.variants],
        }
