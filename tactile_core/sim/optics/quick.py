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
from tactile_core.sim.optics.sources import LightSource, Shining

_NONE = np.zeros((0, 0), np.float32)
_NO_FIELD = np.zeros((2, 0, 0), np.float32)
_NO_HIDDEN = np.zeros((0, 0, 0), np.float32)


@dataclass(frozen=True, eq=False)
class StackedLights:
    """Shading of the S lights of a rig, as the kernels read it.

    Attributes
    ----------
    toward : (S, 3, H, W) float32
    lobe : (S, 3, H, W) or (S, 3, 0, 0) float32
    peak : (S, H, W) or (S, 0, 0) float32
    blur : (S,) float32
        Each as in :class:`~tactile_core.sim.optics.coating.Shading`; without rows, there is no
        specular part.
    """

    toward: Float32
    lobe: Float32
    peak: Float32
    blur: Float32

    @classmethod
    def of(cls, sources: Sequence[LightSource]) -> StackedLights:
        """Stack the lights of a rig."""
        shadings = [source.shading for source in sources]
        lobes = [shading.lobe for shading in shadings if shading.lobe is not None]
        peaks = [shading.peak for shading in shadings if shading.peak is not None]
        count = len(shadings)
        return cls(
            np.stack([shading.toward for shading in shadings]),
            np.stack(lobes) if lobes else np.zeros((count, 3, 0, 0), np.float32),
            np.stack(peaks) if peaks else np.zeros((count, 0, 0), np.float32),
            np.array([shading.blur for shading in shadings], np.float32),
        )


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
            np.ascontiguousarray(printed),
            surface.mm_per_px,
        ),
        (lights.toward, lights.lobe, lights.peak, lights.blur),
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
