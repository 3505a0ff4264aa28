"""Estimator ``core.load``: a load without a unit, for a sensor without calibration."""

from __future__ import annotations

from pydantic import BaseModel

from tactile_core.algorithms.light_change import change_in_detail
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import Bool, Frame, Reference, RelativeLoad


class LOAD:
    """Parameters of the load."""

    # [share of the image's width] Thickness of a gel whose profile does not give it. Source: the
    # gel of the hexagonal fingertip, 2 mm in a view of 17.67 mm.
    thickness_share = 0.11


class Load(Estimator):
    """Measure how much the light of the gel surface changed from the reference.

    It needs neither calibration nor markers, and works with any number of channels. The load grows
    with normal force; how fast depends on the sensor and on the size and shape of the object.
    """

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        image, thickness_mm = context.image, context.gel.thickness_mm
        self._thickness_px = LOAD.thickness_share * image.width_px
        if thickness_mm is not None:
            self._thickness_px = thickness_mm / image.mm_per_px
        self._zero = self._last = 0.0

    def reset(self) -> None:
        """Forget the tare."""
        self._zero = self._last = 0.0

    def tare(self, result: RelativeLoad) -> RelativeLoad:
        """Subtract the present load from all later ones."""
        self._zero = self._last
        return RelativeLoad(0.0, result.timestamp_s)

    def estimate(self, frame: Frame, reference: Reference) -> RelativeLoad:
        """Return the load relative to the reference."""
        hidden = _hidden(frame.marker_mask, reference.marker_mask)
        self._last = change_in_detail(frame.pixels, reference.pixels, hidden, self._thickness_px)
        return RelativeLoad(self._last - self._zero, frame.timestamp_s)


def _hidden(now: Bool | None, before: Bool | None) -> Bool | None:
    """Pixels that a marker covers in either image."""
    if now is None or before is None:
        return before if now is None else now
    return now | before
