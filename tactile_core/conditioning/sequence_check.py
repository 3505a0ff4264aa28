"""Verification of sequential exposures from their content, before anything is measured."""

from __future__ import annotations

from tactile_core.algorithms.sequence import Pattern, SequenceFault, faults, pattern
from tactile_core.errors import SequenceError
from tactile_core.quantities import Frame, Reference


def is_sequential(frame: Frame) -> bool:
    """Whether each channel of the frame is a separate exposure."""
    return 1 < len(frame.exposure_times_s) == len(frame.channels)


def pattern_of(observed: Frame | Reference) -> Pattern:
    """Brightness patterns that distinguish the lights of an observation."""
    return pattern(observed.pixels, observed.full_scale)


def verify(observed: Frame | Reference, expected: Pattern | None, what: str) -> None:
    """Check that each exposure of an observation shows its own light.

    Parameters
    ----------
    observed : Frame or Reference
        One exposure per channel.
    expected : Pattern, optional
        Pattern of the undeformed sensor. Without it only dark and repeated exposures are found.
    what : str
        Name of the observation in the message.

    Raises
    ------
    SequenceError
        An exposure is dark, or shows another light than its own.
    """
    found = faults(pattern_of(observed), expected)
    if found:
        messages = "; ".join(_message(fault, observed.channels) for fault in found)
        raise SequenceError(
            f"{what}: {messages}, so it is not measured; record it again with the lights in order"
        )


def _message(fault: SequenceFault, names: tuple[str, ...]) -> str:
    name = names[fault.exposure]
    if fault.shows is None:
        return f"the exposure of light {name!r} is dark"
    if fault.certain:
        return f"the exposure of light {name!r} shows light {names[fault.shows]!r}"
    return f"the exposures of lights {names[fault.shows]!r} and {name!r} show the same light"
