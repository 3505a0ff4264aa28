"""The first thing that touches the gel after a calibration."""

from __future__ import annotations

from collections.abc import Iterable

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.guided.change import UndeformedCells
from tactile_core.calibration.guided.touch import Touches
from tactile_core.quantities import Frame


def next_touch(frames: Iterable[Frame], bundle: Bundle) -> Frame | None:
    """Return the frame in which the next thing that touches holds still.

    What touches already at the beginning does not count.

    Parameters
    ----------
    frames : iterable of Frame
        Live, in order.
    bundle : Bundle
        The calibration, made with a ball.

    Returns
    -------
    Frame or None
        None if the frames end before.
    """
    manifest = bundle.manifest
    ball_px = min(manifest.ball_diameters_mm) / 2 / manifest.mm_per_px
    cells, touches = UndeformedCells(bundle.reference, ball_px), Touches(ball_px)
    lifted = False
    for frame in frames:
        still = touches.add(frame, cells.change(frame))
        lifted |= not touches.touching
        if still is not None and lifted:
            return still.frame
    return None
