"""References as named arrays, as bundles and recordings store them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.quantities import Reference


def reference_arrays(reference: Reference) -> dict[str, Any]:
    """Return the arrays of a reference; its detected markers are left out."""
    arrays: dict[str, Any] = {
        "pixels": reference.pixels,
        "channels": np.array(reference.channels),
        "full_scale": reference.full_scale,
        "noise": reference.noise,
        "frames": reference.frames,
    }
    if reference.marker_mask is not None:
        arrays["marker_mask"] = reference.marker_mask
    if reference.relative:
        arrays["relative"] = True
    return arrays


def reference_of(arrays: Mapping[str, NDArray[Any]]) -> Reference:
    """Return the reference of some arrays.

    Raises
    ------
    ValueError, LookupError, TypeError, OverflowError
        An array is missing or has the wrong form.
    """
    reference = Reference(
        pixels=arrays["pixels"],
        channels=tuple(str(name) for name in arrays["channels"]),
        full_scale=float(arrays["full_scale"]),
        noise=float(arrays["noise"]),
        frames=int(arrays["frames"]),
        marker_mask=arrays.get("marker_mask"),
        relative=bool(arrays.get("relative", False)),
    )
    pixels, marker_mask = reference.pixels, reference.marker_mask
    if not (
        pixels.ndim == 3
        and pixels.shape[2] == len(reference.channels)
        and pixels.dtype == np.float32
        and np.isfinite(pixels).all()
        and (
            marker_mask is None
            or (marker_mask.shape == pixels.shape[:2] and marker_mask.dtype == bool)
        )
        and np.isfinite([reference.full_scale, reference.noise]).all()
        and reference.full_scale > 0
        and reference.noise >= 0
        and reference.frames >= 1
    ):
        raise ValueError("these are not the arrays of a reference")
    return reference
