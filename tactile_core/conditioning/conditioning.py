"""Conditions frames: markers, drift of the lights, the order of images."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from tactile_core.algorithms.light.drift import ReferenceLevels, divide_by_gains
from tactile_core.errors import SequenceError
from tactile_core.interfaces.component import GelImage
from tactile_core.quantities import Bool, Frame, Reference

if TYPE_CHECKING:
    from tactile_core.algorithms.light.sequence import Pattern, SequenceFault
    from tactile_core.conditioning.marker_finder import MarkerFinder


class DriftCompensator:
    """Scales frames to the illumination of one reference.

    It keeps nothing from earlier frames, so a contact that is held for long is not absorbed; see
    :class:`~tactile_core.algorithms.light.drift.ReferenceLevels`.

    Parameters
    ----------
    reference : Reference
    divides : bool
        False only measures the change of the light, as ``Frame.light_ratio``.
    """

    def __init__(self, reference: Reference, *, divides: bool = True) -> None:
        self._reference, self._divides = reference, divides
        self._levels = ReferenceLevels(reference.pixels, reference.full_scale)

    def compensate_frame(self, frame: Frame) -> Frame:
        """Return the frame as it would look under the illumination of the reference."""
        reference = self._reference
        if (frame.pixels.shape, frame.full_scale) != (reference.pixels.shape, reference.full_scale):
            return frame
        change = self._levels.change(frame.pixels, frame.marker_mask)
        if change is None:
            return frame
        gains = change.gains
        # [ratio] If no gain differs from 1 by more, the frame is not divided. Source: by hand, (ADR
        # 10).
        if not self._divides or np.abs(gains - 1).max() < 0.002:
            return frame.beside(light_ratio=change.ratio)
        pixels = divide_by_gains(frame.pixels, gains, frame.full_scale)
        return replace(frame, pixels=pixels, light_ratio=change.ratio)


def is_sequential(frame: Frame) -> bool:
    """Whether each channel of the frame is a separate exposure."""
    return 1 < len(frame.exposure_times_s) == len(frame.channels)


def pattern_of(observed: Frame | Reference) -> Pattern:
    """Brightness patterns that distinguish the lights of an observation."""
    # only sequential lights need it
    from tactile_core.algorithms.light.sequence import pattern

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
    from tactile_core.algorithms.light.sequence import faults

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


@dataclass(frozen=True, eq=False)
class Conditioning:
    """Verifies the sequence of a frame, masks its markers and compensates illumination drift.

    A pipeline and the fitting of a calibration share it, so that both use the same frames.

    Attributes
    ----------
    reference : Reference or None
        Image of the undeformed sensor, with its markers masked.
    finder : MarkerFinder or None
        None for a gel without markers.
    compensates : bool
        Whether illumination drift is compensated, which takes a reference.
    known : Reference or None
        Trusted reference whose exposures are in the correct order, such as that of the bundle.
        ``reference`` is verified against it.
    """

    reference: Reference | None
    finder: MarkerFinder | None = None
    compensates: bool = True
    known: Reference | None = None

    @classmethod
    def for_build(
        cls,
        build: GelImage,
        reference: Reference | None,
        *,
        compensates: bool,
        known: Reference | None = None,
    ) -> Self:
        """Make the conditioning of a sensor build, and mask the markers of the reference.

        Raises
        ------
        InputError
            The profile has ``markers: auto``, and there is no reference to detect them in.
        """
        finder: MarkerFinder | None = None
        if build.gel.markers is not None:  # other gels need no code for markers
            from tactile_core.conditioning.marker_finder import MarkerFinder

            finder = MarkerFinder.for_gel(build, reference)
        return cls(None, finder, compensates, known).with_reference(reference)

    def with_reference(self, reference: Reference | None) -> Self:
        """Return a copy with another reference."""
        if reference is not None and reference.marker_mask is None and self.finder is not None:
            reference = replace(reference, marker_mask=self.finder.find(reference.pixels))
        return replace(self, reference=reference)

    def __call__(self, frame: Frame) -> Frame:
        """Condition a frame.

        Raises
        ------
        SequenceError
            An exposure of a sequence is dark, or shows another light than its own.
        """
        self.verify(frame)
        return self.compensate_drift(self.mask_markers(frame))

    def verify(self, frame: Frame) -> None:
        """Check that each exposure of a sequential frame shows its own light."""
        if is_sequential(frame):
            verify(frame, self._expected, f"observation {frame.source or frame.sequence}")

    def mask_markers(self, frame: Frame) -> Frame:
        """Mask a frame's markers, unless they are masked already."""
        if self.finder is None or frame.marker_mask is not None:
            return frame
        return self.finder.mask_frame(frame)

    def compensate_drift(self, frame: Frame) -> Frame:
        """Measure the illumination drift of a masked frame, and compensate it if it should be."""
        if self._drift is None:
            return frame
        return self._drift.compensate_frame(frame)

    def condition_without(self, frame: Frame, hidden: Bool) -> Frame:
        """Condition a frame without using its hidden pixels, not even for the drift.

        The reference replaces them, as if nothing had touched there.

        Parameters
        ----------
        frame : Frame
        hidden : (H, W) bool
        """
        pixels = np.where(hidden[..., None], self.undeformed.pixels, frame.pixels)
        pixels = pixels.astype(frame.pixels.dtype)
        frame = self.mask_markers(
            replace(frame, pixels=pixels, marker_mask=None, marker_contrast=None)
        )
        unseen = hidden if frame.marker_mask is None else hidden | frame.marker_mask
        return replace(
            self.compensate_drift(replace(frame, marker_mask=unseen)), marker_mask=frame.marker_mask
        )

    @property
    def undeformed(self) -> Reference:
        """The reference; it is an error if there is none."""
        if self.reference is None:
            raise ValueError("there is no reference")
        return self.reference

    @cached_property
    def _expected(self) -> Pattern | None:
        if self.reference is None:
            return None
        known = None if self.known is None else pattern_of(self.known)
        verify(self.reference, known, "the reference")
        return known or pattern_of(self.reference)

    @cached_property
    def _drift(self) -> DriftCompensator | None:
        if self.reference is None:
            return None
        return DriftCompensator(self.reference, divides=self.compensates)
