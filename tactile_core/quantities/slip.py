"""Whether the contact holds, and how it gives way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactile_core.quantities.quantity import Quantity

SlipName = Literal["none", "stick", "incipient", "slip"]
SlipKind = Literal["translation", "rotation"]


@dataclass(frozen=True, eq=False)
class SlipState(Quantity):
    """Whether the contact holds.

    Attributes
    ----------
    state : str
        ``none`` (nothing touches), ``stick``, ``incipient`` (the border of the contact slips) or
        ``slip`` (all of it does).
    degree : float
        0 where all of the contact sticks, 1 where all of it slips.
    kind : str or None
        ``translation`` or ``rotation`` while something slips.
    entropy_bits : float or None
        Of the displacement's magnitude over the contact, in bins of 1/256 mm [Yuan 2015]; None
        where nothing touches.
    rotation_deg : float or None
        How far the skin in contact is turned, positive from x towards y.
    onset_s : float or None
        Time at which the present incipient or gross slip began.
    """

    state: SlipName
    degree: float
    kind: SlipKind | None = None
    entropy_bits: float | None = None
    rotation_deg: float | None = None
    onset_s: float | None = None
    timestamp_s: float = 0.0

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """``slip_state``, ``slip_degree``, ``slip_entropy_bits`` and ``rotation_deg``."""
        return {
            "slip_state": np.asarray(self.state),
            "slip_degree": np.asarray(self.degree),
            "slip_entropy_bits": np.asarray(self.entropy_bits or 0.0),
            "rotation_deg": np.asarray(self.rotation_deg or 0.0),
        }

    def summary(self) -> Mapping[str, Any]:
        """The entry ``slip``."""
        return {
            "slip": {
                "state": self.state,
                "degree": self.degree,
                "kind": self.kind,
                "entropy_bits": self.entropy_bits,
                "rotation_deg": self.rotation_deg,
                "onset_s": self.onset_s,
            }
        }
