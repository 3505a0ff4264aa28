"""The exposures of a frame by compiled loops: as :class:`Shining` and :class:`Chip`, but faster."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.sim.optics.camera import Chip, Numbers
from tactile_core.sim.optics.coating import Shading
from tactile_core.sim.optics.sources import LightSource, Shining

_NONE = np.zeros((0, 0), np.float32)
_NO_FIELD = np.zeros((2, 0, 0), np.float32)
_NO_HIDDEN = np.zeros((0, 0, 0), np.float32)


_MOST = 32767
"""Largest number of 16 bits with a sign."""


@dataclass(frozen=True, eq=False)
class StackedLights:
    """Shading of the S lights of a rig, as the kernels read it.

    Most of the time of a kernel goes into reading these images: 16 bits halve it. Each row has its
    own unit and zero, so that the light errs by less than a hundredth of the converter's steps.

    Attributes
    ----------
    planes : (S, P, H, W) int16
        Images ``toward`` of :class:`~tactile_core.sim.optics.coating.Shading`, three of them, and
        of a specular part ``lobe`` and ``peak``, four more.
    unit, zero : (S, P, H) float32
        Of each row.
    blur : (S,) float32
    """

    planes: NDArray[np.int16]
    unit: Float32
    zero: Float32
    blur: Float32

    @classmethod
    def of(cls, sources: Sequence[LightSource]) -> StackedLights:
        """Stack the lights of a rig."""
        coded = [_in_16_bits(_planes(source.shading)) for source in sources]
        planes, unit, zero = (np.stack(parts) for parts in zip(*coded, strict=True))
        blur = np.array([source.shading.blur for source in sources], np.float32)
        return cls(planes, unit, zero, blur)


def _planes(shading: Shading) -> Float32:
    if shading.lobe is None or shading.peak is None:
        return shading.toward
    return np.concatenate([shading.toward, shading.lobe, shading.peak[None]])


def _in_16_bits(images: Float32) -> tuple[NDArray[np.int16], Float32, Float32]:
    """Code images (P, H, W), and return the unit and the zero (P, H) of their rows."""
    low, high = images.min(-1), images.max(-1)
    unit = np.maximum((high - low) / np.float32(2 * _MOST), np.finfo(np.float32).tiny)
    zero = (high + low) / 2
    steps = np.rint((images - zero[..., None]) / unit[..., None])
    return np.clip(steps, -_MOST, _MOST).astype(np.int16), unit, zero


def photographed(
    compiled: ModuleType,
    lights: StackedLights,
    shining: Shining,
    glass: Float32,
    mixing: Float32,
    chip: Chip,
    noise: Sequence[Numbers],
) -> NDArray[Any]:
    """Render the exposures of a frame.

    Parameters
    ----------
    compiled : module
        :mod:`tactile_core.sim.kernels.compiled`.
    lights : StackedLights
        All lights of the rig.
    shining : Shining
    glass : (H, W) float32
        Transmission of the lens.
    mixing : (K, K) float32
        Colour mixing matrix: crosstalk and gain.
    chip : Chip
    noise : sequence of Numbers
        One per exposure.

    Returns
    -------
    (E, H, W, K) uint8 or uint16
    """
    surface, shade = shining.surface, shining.shade
    height, width = surface.relief_mm.shape
    count = len(mixing)
    pixels = np.empty((len(noise), height, width * count), chip.dtype)
    rest = _NO_FIELD if surface.rest_slopes is None else surface.rest_slopes
    printed = _NONE if surface.reflectance is None else surface.reflectance
    steps = [one.steps.reshape(count, height, width) for one in noise]
    compiled.photograph(
        (
            np.ascontiguousarray(surface.relief_mm),
            rest,
            surface.textures,
            surface.texture_unit,
            np.ascontiguousarray(printed),
            surface.mm_per_px,
        ),
        (lights.planes, lights.unit, lights.zero, lights.blur),
        (
            np.array([number for number, _, _, _ in shining.sources], np.int64),
            np.array([level for _, _, level, _ in shining.sources], np.float32),
            shining.fed,
        ),
        (_NO_HIDDEN, 0, np.full(height, -1), np.zeros(height, np.float32))
        if shade is None
        else (shade.hidden, shade.columns.start, shade.coarse, shade.share),
        shining.ambient,
        glass,
        mixing,
        (
            steps[0] if len(steps) == 1 else np.concatenate(steps),
            np.repeat(np.array([one.scale for one in noise], np.float32), count),
        ),
        (1 / chip.full_well_e, (chip.read_noise_e / chip.full_well_e) ** 2),
        chip.table,
        pixels,
    )
    return pixels.reshape(-1, height, width, count)
