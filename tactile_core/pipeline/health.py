"""The health of a sensor: findings, and what is said about gel and lights."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from statistics import median
from typing import Any, Literal

import numpy as np

from tactile_core.algorithms.light.drift import DRIFT
from tactile_core.formats.text import plain
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Frame, MarkerField, Quantity, Reference

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
    def from_value(cls, value: float, expected: float | None, unit: str, problem: str) -> Finding:
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


# Share of a frame's intensities: fewer saturated or dark ones are filled without a warning.
_RELEVANT_SHARE = 0.01


def exposure_warnings(frame: Frame, reference: Reference | None) -> tuple[str, ...]:
    """Return the warnings about saturated and dark intensities of a frame as acquired.

    What is dark in the reference too, such as the corners of a lens, needs no longer exposure.
    """
    # a thresholded image has no exposure: all of its intensities are 0 or full scale
    shares = frame.saturated_share, frame.too_dark_share
    if min(shares) > 0 and sum(shares) > 1 - 1e-6:
        return ()
    saturation = saturation_warning(frame)
    warnings = [saturation] if saturation else []
    always = 0.0 if reference is None else reference.too_dark_share
    # [share] More dark ones in the reference are no corners but a wrong exposure
    if frame.too_dark_share > min(always, 0.5) + _RELEVANT_SHARE:
        warnings.append(
            f"{frame.too_dark_share:.0%} of the frame is too dark; lengthen the exposure or check "
            f"the lights"
        )
    return tuple(warnings)


def saturation_warning(frame: Frame) -> str:
    """Return the warning about saturated intensities; empty if there are few."""
    if frame.saturated_share <= _RELEVANT_SHARE:
        return ""
    return f"{frame.saturated_share:.0%} of the frame is saturated; shorten the exposure"


def left_out_notes(left_out: Mapping[str, type[Quantity]], *, bundled: bool) -> list[str]:
    """Return the notes about steps that are left out, with what makes them run.

    Parameters
    ----------
    left_out : mapping of step name to type
        The steps that cannot run, each with the missing input that causes it.
    bundled : bool
        Whether the pipeline has a bundle.
    """
    unreferenced = [name for name, kind in left_out.items() if kind is Reference]
    unfitted = [name for name, kind in left_out.items() if issubclass(kind, Artefact)]
    others = [name for name in left_out if name not in (*unreferenced, *unfitted)]
    no_reference = "no reference", "give --reference, a recording of the undeformed sensor"
    no_bundle = "no bundle", "make one with 'tactile calibrate' and give it with --bundle"
    models = {kind: [n for n in unfitted if left_out[n] is kind] for kind in left_out.values()}
    reasons = [
        (unreferenced, no_reference),
        *((steps, _no_model(kind)) for kind, steps in models.items() if issubclass(kind, Artefact)),
        (others, no_reference if bundled else no_bundle),
    ]
    return [
        f"{why}, so these steps are left out: {', '.join(steps)}; {remedy}"
        for steps, (why, remedy) in reasons
        if steps
    ]


def _no_model(kind: type[Artefact]) -> tuple[str, str]:
    return f"no {kind.noun} in a bundle", f"fit one with 'tactile {kind.command}'"


def not_given(step: str, kind: type[Quantity]) -> str:
    """Return the warning about a step without its external input."""
    return (
        f"step {step!r} needs {kind.__name__}, which was not given with this frame; the step is "
        f"left out"
    )


def without_slopes(step: str) -> str:
    """Return the warning about a step that integrates slopes where heights come directly."""
    return (
        f"step {step!r} needs Gradients, but this calibration provides a HeightMap directly; the "
        f"step is left out"
    )


class GelHealth:
    """Collects what readings show."""

    def __init__(self) -> None:
        self._seen: deque[int] = deque(maxlen=30)  # [readings] one second at 30 Hz
        self._expected = 0
        self._ratios: Mapping[str, float] = {}
        self._frame: Frame | None = None

    def add(self, reading: Reading) -> None:
        """Add a reading."""
        frame = self._frame = reading.frame
        markers = reading.get(MarkerField)
        if markers is not None:
            self._seen.append(int(np.count_nonzero(markers.seen)))
            self._expected = len(markers.ids)
        if frame.light_ratio is not None:
            self._ratios = dict(zip(frame.channels, frame.light_ratio.tolist(), strict=False))

    def lights(self) -> Mapping[str, Finding]:
        """Brightness of each channel over that in the reference."""
        return {name: _light(name, ratio) for name, ratio in self._ratios.items()}

    def judge_saturation(self) -> Finding:
        """Share of saturated intensities in the latest frame."""
        if self._frame is None:
            return Finding.unknown("there is no reading yet")
        return Finding.from_value(
            self._frame.saturated_share, 0, "", saturation_warning(self._frame)
        )

    def markers(self) -> Finding:
        """Markers that are seen, as a median."""
        if not self._seen:
            return Finding.unknown("no step tracks markers")
        seen, expected = round(median(self._seen)), self._expected
        problem = ""
        # [share of the markers] A contact over a tenth of the view hides at most as many; twice
        # that is unusual
        if seen < 0.8 * expected:
            problem = (
                f"{seen} of {expected} markers are seen; clean the gel, check focus and lights, or "
                f"record a new reference"
            )
        return Finding.from_value(seen, expected, "", problem)


def _light(name: str, ratio: float) -> Finding:
    problem = ""
    if abs(np.log(ratio)) > DRIFT.largest_log_gain:
        change = f"{abs(ratio - 1):.0%} {'brighter' if ratio > 1 else 'dimmer'}"
        problem = (
            f"the light in channel {name!r} is {change} than in the reference, too much to be "
            f"compensated; check its LEDs, its supply and the exposure, or record a new reference"
        )
    return Finding.from_value(ratio, 1, "", problem)
