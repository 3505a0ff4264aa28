"""Training samples of the undeformed gel surface, from the reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactile_core.calibration.presses import PRESS, FoundPress
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Frame, Reference


def undeformed_press(presses: Sequence[FoundPress], reference: Reference) -> Press:
    """Sample undeformed pixels for a frame full of balls, in the usual ratio, of the reference."""
    count = int(PRESS.undeformed_share * sum(len(press.training().rows) for press in presses))
    return undeformed_sample(presses[0].frame, reference, count)


def undeformed_sample(frame: Frame, reference: Reference, count: int) -> Press:
    """Sample pixels all over the reference, with slope and height 0."""
    height, width = reference.pixels.shape[:2]
    rng = np.random.default_rng(0)
    return Press(
        frame=replace(frame, pixels=reference.pixels, marker_mask=reference.marker_mask),
        rows=rng.integers(0, height, count).astype(np.int32),
        columns=rng.integers(0, width, count).astype(np.int32),
        gradients=np.zeros((count, 2), np.float32),
        name="reference",
        heights_mm=np.zeros(count, np.float32),
    )
