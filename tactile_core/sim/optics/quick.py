"""One exposure by compiled loops: the same as :class:`Shining` and :class:`Chip`, but faster."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.sim.optics.camera import Chip, Numbers
from tactile_core.sim.optics.sources import Shining

_BAND_PX = 32
"""Rows rendered at once: their buffers fit into the processor's cache. Chosen by hand."""

_NONE = np.zeros((0, 0), np.float32)
_NO_FIELD = np.zeros((2, 0, 0), np.float32)


def photographed(
    compiled: ModuleType,
    shining: Shining,
    glass: Float32,
    mixing: Float32,
    chip: Chip,
    noise: Numbers,
) -> NDArray[Any]:
    """Render one exposure.

    Parameters
    ----------
    compiled : module
        :mod:`tactile_core.sim.kernels.compiled`.
    shining : Shining
    glass : (H, W) float32
        Transmission of the lens.
    mixing : (K, K) float32
        Colour mixing matrix: crosstalk and gain.
    chip : Chip
    noise : Numbers

    Returns
    -------
    (H, W, K) uint8 or uint16
    """
    surface, fed, ambient = shining.surface, shining.fed, shining.ambient
    height, width = surface.relief_mm.shape
    count = len(mixing)
    pixels = np.empty((height, width * count), chip.dtype)
    relief = np.ascontiguousarray(surface.relief_mm)
    rest = _NO_FIELD if surface.rest_slopes is None else surface.rest_slopes
    printed = _NONE if surface.reflectance is None else np.ascontiguousarray(surface.reflectance)
    numbers = noise.values.reshape(pixels.shape), noise.sign
    electrons = 1 / chip.full_well_e, (chip.read_noise_e / chip.full_well_e) ** 2
    facing = np.empty((3, _BAND_PX, width), np.float32)
    light = np.empty((count, _BAND_PX, width), np.float32)
    for top in range(0, height, _BAND_PX):
        rows = min(_BAND_PX, height - top)
        if rows < _BAND_PX:
            facing, light = (np.empty((len(a), rows, width), np.float32) for a in (facing, light))
        compiled.normals(relief, rest, surface.mm_per_px, top, facing)
        light[:] = 0
        for (number, source, level), seen, into in zip(
            shining.sources, shining.seen, fed, strict=True
        ):
            shading = source.shading
            compiled.add_light(
                facing,
                shading.toward,
                _NO_FIELD if shading.lobe is None else shading.lobe,
                _NONE if shading.peak is None else shading.peak,
                float(shading.blur),
                _NONE if seen is None else seen,
                (surface.textures[number // 4], number % 4),
                float(level),
                into,
                top,
                light,
            )
        compiled.read_out(
            light,
            facing[2],
            ambient,
            (glass, printed),
            mixing,
            numbers,
            electrons,
            chip.table,
            top,
            pixels,
        )
    return pixels.reshape(height, width, count)
