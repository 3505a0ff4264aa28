"""Whether a frame shows the gel that it is measured with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.quantity import Quantity

Cause = Literal[
    "channels_swapped",
    "turned",
    "mirrored",
    "cropped",
    "grey",
    "another_unit",
    "one_sided_light",
    "unknown",
]

_ADVICE: Mapping[str, str] = {
    "channels_swapped": (
        "its colour channels are in another order than in the reference; give RGB, since OpenCV "
        "delivers BGR"
    ),
    "turned": "it is turned against the reference; correct 'image.rotate_deg' or turn the camera",
    "mirrored": "it is a mirror image of the reference; correct 'image.flip'",
    "cropped": (
        "it shows another part of the view than the reference, or at another scale; choose the "
        "camera's mode of the calibration, or correct 'image.crop'"
    ),
    "grey": "its channels are all equal where the reference has colours; record in colour",
    "another_unit": (
        "its light differs from the reference all over, as that of another unit, of another gel or "
        "of an aged one does; record a new reference, and calibrate this unit if that does not help"
    ),
    "one_sided_light": (
        "its light has become brighter on one side than in the reference; check the LEDs, keep "
        "other light out, and record a new reference"
    ),
    "unknown": (
        "it looks like nothing that this gel can look like, or is much brighter or darker than in "
        "the reference; check camera, exposure and lights, and record a new reference"
    ),
}


@dataclass(frozen=True, eq=False)
class ShownGel(Quantity):
    """Whether a frame shows the gel of the reference, under the light of the calibration.

    Attributes
    ----------
    this_gel : bool
        False: whatever is measured from this frame is wrong.
    cause : str or None
        What was done to the frame: ``channels_swapped``, ``turned``, ``mirrored``, ``cropped`` (or
        scaled), ``grey``, ``another_unit`` (or an aged gel), ``one_sided_light`` or ``unknown``;
        None if nothing was.
    """

    this_gel: Annotated[bool, FieldSpec(saved_as="shows_this_gel")]
    cause: Annotated[Cause | None, FieldSpec(saved_as="shows_cause")] = None
    timestamp_s: TimestampS = 0.0

    def summary(self) -> Mapping[str, Any]:
        """Return the entry ``shows`` of a line of ``tactile run --json``."""
        return {"shows": {"this_gel": self.this_gel, "cause": self.cause}}

    def warnings(self) -> tuple[str, ...]:
        """Return what is wrong with the frame, and what to do."""
        if self.this_gel:
            return ()
        return (f"this frame does not show the gel of the reference: {self.advice}",)

    @property
    def advice(self) -> str:
        """What is wrong with a frame that does not show this gel, and what to do."""
        return _ADVICE[self.cause or "unknown"]
