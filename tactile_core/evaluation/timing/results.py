"""What was measured, and how it is told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Cost:
    """What one stage costs.

    Attributes
    ----------
    stage : str
    median_ms, p90_ms : float
    """

    stage: str
    median_ms: float
    p90_ms: float

    @property
    def per_second(self) -> float:
        """How many frames a second one core would take through this stage alone."""
        return 1e3 / self.median_ms

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "stage": self.stage,
            "median_ms": round(self.median_ms, 4),
            "p90_ms": round(self.p90_ms, 4),
            "fps": round(self.per_second, 1),
        }


@dataclass(frozen=True)
class Bench:
    """The costs of one profile at one size.

    Attributes
    ----------
    profile, model : str
        The profile's name, and the calibration that was fitted.
    size_px : (width, height)
    stages : tuple of Cost
        In the order of a frame's way; the last is the whole of it, measured by itself.
    rounds : int
        How often each was measured.
    peak_memory_mib : float or None
        Largest resident memory of a process that only streams, Python and libraries included.
    two_process_ratio : float or None
        Frames a second of two such processes at once over those of one; None on one core.
    uses_numba : bool
        Whether the ``fast`` extra took part.
    """

    profile: str
    model: str
    size_px: tuple[int, int]
    stages: tuple[Cost, ...]
    rounds: int
    peak_memory_mib: float | None
    two_process_ratio: float | None
    uses_numba: bool

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        ratio, peak = self.two_process_ratio, self.peak_memory_mib
        return {
            "profile": self.profile,
            "model": self.model,
            "size_px": list(self.size_px),
            "stages": [cost.summary() for cost in self.stages],
            "rounds": self.rounds,
            "peak_memory_mib": None if peak is None else round(peak, 1),
            "two_process_ratio": None if ratio is None else round(ratio, 3),
            "fast": self.uses_numba,
        }


@dataclass(frozen=True)
class Benches:
    """What was measured, and on what.

    Attributes
    ----------
    machine : dict
        See :func:`~tactile_core.evaluation.timing.machine.machine`.
    benches : tuple of Bench
    left_out : tuple of str
        The profiles that could not be built, each with the reason.
    """

    machine: dict[str, Any]
    benches: tuple[Bench, ...]
    left_out: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """What ``tactile bench --json`` prints."""
        fast = {
            "installed": self.machine["versions"]["numba"] is not None,
            "used": any(bench.uses_numba for bench in self.benches),
        }
        return {
            "machine": self.machine,
            "fast": fast,
            "benches": [bench.summary() for bench in self.benches],
            "left_out": list(self.left_out),
        }
