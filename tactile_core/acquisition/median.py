"""The undeformed sensor from frames in which something presses elsewhere each time."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.errors import InputError
from tactile_core.quantities import Frame, Reference

# [frames] More make the median hardly better, and large images take memory
_MOST_FRAMES = 64


def median_reference(frames: Iterable[Frame]) -> tuple[Reference, str]:
    """Return the median of frames as a reference, and a note that says how far to trust it.

    A pixel that is undeformed in more than half of the frames keeps its light: its deviation is
    that of the median of frames [1]_, from their median absolute deviation. Where presses overlap,
    frames differ, and the deviation is large.

    Parameters
    ----------
    frames : iterable of Frame
        At least three; of more than 64, evenly spaced ones are used.

    Raises
    ------
    InputError
        There are fewer frames, or they differ in size.

    References
    ----------
    .. [1] P. J. Huber, "Robust Statistics", Wiley, 1981.
    """
    kept = _evenly_spaced(frames)
    if len(kept) < 3:
        raise InputError(
            f"the median of {len(kept)} frames is no reference; give a recording of three or more, "
            f"or one of the undeformed sensor"
        )
    mean = average(kept)
    pixels = np.stack([frame.pixels for frame in kept])
    middle = np.median(pixels, axis=0).astype(np.float32)
    # [standard deviations] of a normal distribution: over its median absolute deviation
    spread = 1.4826 * np.median(np.abs(pixels - middle), axis=0)
    # [standard deviations] of the median of n values of a normal distribution: √(π/2) / √n
    deviation = 1.2533 * spread / len(kept) ** 0.5
    half, most = np.quantile(deviation, (0.5, 0.95))
    reference = Reference(
        middle, mean.channels, mean.full_scale, noise=float(np.median(spread)), frames=len(kept)
    )
    return reference, (
        f"the reference is the median of {len(kept)} frames: its standard deviation is up to "
        f"{half:.1f} grey levels in half of the pixels, and up to {most:.1f} in 95 % of them; "
        f"record the undeformed sensor for a better one"
    )


def _evenly_spaced(frames: Iterable[Frame]) -> list[Frame]:
    kept: list[Frame] = []
    stride = 1
    for number, frame in enumerate(frames):
        if number % stride == 0:
            kept.append(frame)
        if len(kept) > _MOST_FRAMES:
            kept, stride = kept[::2], 2 * stride
    return kept
