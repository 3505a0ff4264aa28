"""Sentences for the user about a frame's exposure and about steps that cannot run."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.artefact import Artefact
from tactile_core.quantities import Frame, Quantity, Reference

# Share of a frame's intensities: fewer saturated or dark ones are filled without a warning.
_RELEVANT_SHARE = 0.01


# Share of the reference's intensities: more dark ones are no corners but a wrong exposure.
_DARK_REFERENCE_SHARE = 0.5


def exposure_warnings(frame: Frame, reference: Reference | None) -> tuple[str, ...]:
    """Return the warnings about saturated and dark intensities of a frame as acquired.

    What is dark in the reference too, such as the corners of a lens, needs no longer exposure.
    """
    saturation = saturation_warning(frame)
    warnings = [saturation] if saturation else []
    always = 0.0 if reference is None else reference.too_dark_share
    if frame.too_dark_share > min(always, _DARK_REFERENCE_SHARE) + _RELEVANT_SHARE:
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
    no_force = "no force model in a bundle", "fit one with 'tactile calibrate-force'"
    reasons = [
        (unreferenced, no_reference),
        (unfitted, no_force),
        (others, no_reference if bundled else no_bundle),
    ]
    return [
        f"{why}, so these steps are left out: {', '.join(steps)}; {remedy}"
        for steps, (why, remedy) in reasons
        if steps
    ]


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
