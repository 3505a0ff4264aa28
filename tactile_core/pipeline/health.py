"""The health of a sensor: what is measured of its camera, lights and markers, and advice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

from tactile_core.formats.json import plain

Verdict = Literal["ok", "warning", "unknown"]


@dataclass(frozen=True)
class Finding:
    """One property of a sensor's health.

    Attributes
    ----------
    value, expected : float or None
        As measured, and as it should be; None if unknown.
    unit : str
        Empty for counts and ratios.
    verdict : {"ok", "warning", "unknown"}
    message : str
        For a warning what is wrong and what to do, for "unknown" why; both are one sentence. Empty
        if all is well.
    """

    value: float | None = None
    expected: float | None = None
    unit: str = ""
    verdict: Verdict = "ok"
    message: str = ""

    @classmethod
    def judged(cls, value: float, expected: float | None, unit: str, problem: str) -> Finding:
        """Make a finding: a warning if there is a problem, which says what to do."""
        return cls(value, expected, unit, "warning" if problem else "ok", problem)

    @classmethod
    def unknown(cls, reason: str, value: float | None = None, unit: str = "") -> Finding:
        """Make the finding of a property that cannot be judged."""
        return cls(value, None, unit, "unknown", reason)


@dataclass(frozen=True)
class Health:
    """Health of an open sensor, from its recent readings.

    Attributes
    ----------
    rate : Finding
        Images that arrive each second, Hz, as a median over the last ten seconds; expected is the
        rate that the camera is set to, or the highest such median since it was opened.
    latency : Finding
        Time from mid-exposure to the reading, ms, as a median; expected is the longest that is
        usual for the exposures, the frame period and the time that measuring takes.
    dropped, torn, repeated : Finding
        Images in the last ten seconds that were not read, are damaged, or repeat the one before.
    exposure_time : Finding
        As read back from the camera, s; expected is that of the first observation.
    lights : mapping of channel to Finding
        Brightness on the undeformed surface over that in the reference, expected 1.
    saturated : Finding
        Share of the latest frame's intensities that are saturated.
    markers : Finding
        Markers that are seen, as a median; expected is their number in the reference.
    """

    rate: Finding
    latency: Finding
    dropped: Finding
    torn: Finding
    repeated: Finding
    exposure_time: Finding
    lights: Mapping[str, Finding]
    saturated: Finding
    markers: Finding

    def findings(self) -> Iterator[tuple[str, Finding]]:
        """Yield each property by name; that of a light is ``light red``."""
        for one in fields(self):
            value = getattr(self, one.name)
            if isinstance(value, Finding):
                yield one.name, value
            else:
                yield from ((f"light {name}", found) for name, found in value.items())

    @property
    def verdict(self) -> Verdict:
        """``warning`` if there is one, ``unknown`` if nothing is known, else ``ok``."""
        verdicts = {found.verdict for _, found in self.findings()}
        order: tuple[Verdict, ...] = ("warning", "ok")
        return next((one for one in order if one in verdicts), "unknown")

    @property
    def warnings(self) -> tuple[str, ...]:
        """The sentences of all warnings."""
        return tuple(found.message for _, found in self.findings() if found.verdict == "warning")

    def summary(self) -> dict[str, Any]:
        """Return the line of ``tactile doctor --watch --json``: strict JSON."""
        found = {
            name: {key: plain(value) for key, value in vars(one).items()}
            for name, one in self.findings()
        }
        return {"verdict": self.verdict, **found}
