"""Texture of an object's surface: ribs, random roughness, or a weave on any shape."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.errors import InputError
from tactile_sim.indenters.solids import Indenter, positive
from tactile_sim.indenters.textures import weave_gap

# [count] Points of the tile on one grain: sampling theorem: two per wavelength of the shortest
# wave, which is half a grain
_POINTS_PER_GRAIN = 4


@dataclass(frozen=True)
class Ribs:
    """Parallel ribs: a cosine along the object's x.

    Parameters
    ----------
    pitch_mm : float
        Distance between ribs.
    relief_mm : float
        Height of the ribs above the grooves.
    angle_deg : float
        Direction across the ribs, from the object's x towards its y.
    """

    pitch_mm: float = 1.0
    relief_mm: float = 0.1
    angle_deg: float = 0.0

    def __post_init__(self) -> None:
        positive("the ribs' pitch_mm", self.pitch_mm)
        positive("the ribs' relief_mm", self.relief_mm)

    @property
    def detail_mm(self) -> float:
        """Half the pitch."""
        return self.pitch_mm / 2

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """(…) depth below the highest point, mm."""
        angle = np.radians(self.angle_deg)
        across = np.cos(angle) * x_mm + np.sin(angle) * y_mm
        return np.asarray(self.relief_mm / 2 * (1 - np.cos(2 * np.pi * across / self.pitch_mm)))


@dataclass(frozen=True)
class Weave:
    """Plain weave of threads.

    Parameters
    ----------
    pitch_mm : float
        Distance between adjacent threads.
    relief_mm : float
        Thickness of a thread.
    """

    pitch_mm: float = 0.8
    relief_mm: float = 0.2

    def __post_init__(self) -> None:
        positive("the weave's pitch_mm", self.pitch_mm)
        positive("the weave's relief_mm", self.relief_mm)

    @property
    def detail_mm(self) -> float:
        """Half the pitch."""
        return self.pitch_mm / 2

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """(…) depth below the highest point, mm."""
        return weave_gap(x_mm, y_mm, self.pitch_mm, self.relief_mm)


@dataclass(frozen=True)
class Roughness:
    """Random roughness: normally distributed heights with a Gaussian spectrum.

    Parameters
    ----------
    grain_mm : float
        Correlation length.
    relief_mm : float
        Root-mean-square height.
    seed : float
        Random seed.
    """

    grain_mm: float = 0.5
    relief_mm: float = 0.03
    seed: float = 0

    def __post_init__(self) -> None:
        positive("the roughness's grain_mm", self.grain_mm)
        positive("the roughness's relief_mm", self.relief_mm)
        if self.seed < 0 or self.seed != int(self.seed):
            raise InputError(f"the roughness's seed should be 0, 1, 2, …, not {self.seed:g}")

    @property
    def detail_mm(self) -> float:
        """The correlation length."""
        return self.grain_mm

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """(…) depth below the highest point, mm."""
        from scipy.ndimage import map_coordinates

        points_per_mm = _POINTS_PER_GRAIN / self.grain_mm
        places = [np.asarray(y_mm) * points_per_mm, np.asarray(x_mm) * points_per_mm]
        return np.asarray(
            map_coordinates(self._tile, places, order=1, mode="grid-wrap", prefilter=False)
        )

    @cached_property
    def _tile(self) -> Array:
        from scipy.ndimage import gaussian_filter

        side = 32 * _POINTS_PER_GRAIN  # [grains] Of the tile that repeats; a contact covers fewer
        noise = np.random.default_rng([int(self.seed), 61]).standard_normal((side, side))
        # a Gaussian filter of σ gives the correlation exp(−r²/4σ²): σ is the length over √2 … 2
        height = gaussian_filter(noise, _POINTS_PER_GRAIN / 2, mode="wrap")
        height /= height.std()
        # [sigmas] One peak does not carry the object; 2.3 % of a normal distribution are higher
        return np.asarray(self.relief_mm * (2.0 - height).clip(0))


TEXTURES: dict[str, Callable[..., Ribs | Weave | Roughness]] = {
    "ribs": Ribs,
    "rough": Roughness,
    "weave": Weave,
}


@dataclass(frozen=True)
class Textured(Indenter):
    """Object with a texture on its lower side.

    Parameters
    ----------
    base : Indenter
    texture : Ribs, Weave or Roughness
        It moves and rotates with the object.
    """

    base: Indenter
    texture: Ribs | Weave | Roughness

    @property
    def rolling_radius_mm(self) -> float | None:
        """That of the shape."""
        return self.base.rolling_radius_mm

    @property
    def rolls_along_x(self) -> bool:
        """That of the shape."""
        return self.base.rolls_along_x

    @property
    def detail_mm(self) -> float | None:
        """The finer one of the shape and the texture."""
        detail = self.base.detail_mm
        return float(min(self.texture.detail_mm, detail or np.inf))

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        return self.base.gap_mm(x_mm, y_mm) + self.texture.gap_mm(x_mm, y_mm)
