"""The skin under the camera: its relief, its print and its grain, carried by the displacement."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.dome import rest_height
from tactile_core.profiles.model import Profile
from tactile_core.sim.optics.faults import Faults
from tactile_core.sim.optics.markers import Marks

Float32 = NDArray[np.float32]


_MARGIN = 0.1
"""Surface around the image, of its width, which shear may bring into it."""


@dataclass(frozen=True, eq=False)
class Surface:
    """One state of the skin, ready to be lit.

    Attributes
    ----------
    normals : (3, H, W) float32
        Unit normals, the third component towards the camera.
    relief_mm : (H, W) float32
        Height above the rest surface, scratches included.
    reflectance : (H, W) float32 or None
        1 where the skin is bare, less where it is printed; None for a bare skin.
    grain : tuple of (H, W) float32
        Factor on the light of each lamp: grains catch the light of one and not of another.
    """

    normals: Float32
    relief_mm: Float32
    reflectance: Float32 | None
    grain: tuple[Float32, ...]


class Membrane:
    """The skin of one gel, in all its states.

    Parameters
    ----------
    profile : Profile
    lamps : int
        Each sees a grain of its own.
    faults : Faults
    seed : int
    """

    def __init__(self, profile: Profile, lamps: int, faults: Faults, seed: int) -> None:
        image, coat = profile.image, profile.optics.coat
        self._shape = (image.height_px, image.width_px)
        self._mm_per_px = image.mm_per_px
        self._ink = coat.ink
        self.marks = Marks.of(profile, faults, seed)
        self.rest_mm: Float32 | None = None
        self._rest_slopes: tuple[Float32, Float32] | None = None
        if profile.gel.radius_mm is not None:
            # A dome's border lies nearer to the camera, which its z in the sensor frame tells.
            self.rest_mm = -rest_height(
                self._shape, mm_per_px=image.mm_per_px, radius_mm=profile.gel.radius_mm
            )
            self._rest_slopes = _slopes(self.rest_mm, image.mm_per_px)
        self._margin = round(_MARGIN * image.width_px)
        wide = (self._shape[0] + 2 * self._margin, self._shape[1] + 2 * self._margin)
        rng = np.random.default_rng([seed, 31])
        size_px = (coat.grain_mm or image.mm_per_px) / image.mm_per_px
        textures = [_grain(wide, coat.grain, size_px, rng) for _ in range(lamps)]
        furrows = faults.furrows_mm(wide, image.mm_per_px, seed)
        self._scratched, self._printed = furrows is not None, self.marks is not None
        if furrows is not None:
            textures.append(furrows)
        if self.marks is not None:
            textures.append(self._inked(self.marks.cover(wide, self.marks.rest_px + self._margin)))
        m = self._margin
        self._resting = [
            np.ascontiguousarray(texture[m:-m, m:-m]) if m else texture for texture in textures
        ]
        # Images of up to four channels are carried in the time of one.
        self._textures = [cv2.merge(textures[k : k + 4]) for k in range(0, len(textures), 4)]

    def state(
        self,
        height_mm: Float32,
        displacement_mm: Float32 | None = None,
        marks_px: NDArray[np.float64] | None = None,
    ) -> Surface:
        """Return the skin as it is now; parameters as for ``RigOptics.expose``."""
        textures = self._carried(displacement_mm)
        reflectance = textures.pop() if self._printed else None
        if self.marks is not None and marks_px is not None:
            reflectance = self._inked(self.marks.cover(self._shape, marks_px))
        relief = height_mm + textures.pop() if self._scratched else height_mm
        return Surface(self._normals(relief), relief, reflectance, tuple(textures))

    def _normals(self, relief_mm: Float32) -> Float32:
        x, y = _slopes(relief_mm, self._mm_per_px)
        if self._rest_slopes is not None:
            x += self._rest_slopes[0]
            y += self._rest_slopes[1]
        up = x * x
        up += y * y
        up += 1
        cv2.sqrt(up, dst=up)
        cv2.divide(1.0, up, dst=up)
        normals = np.empty((3, *self._shape), np.float32)
        np.multiply(x, up, out=normals[0])
        np.multiply(y, up, out=normals[1])
        np.negative(normals[:2], out=normals[:2])
        normals[2] = up
        return normals

    def _inked(self, cover: Float32) -> Float32:
        return np.asarray(1 - (1 - self._ink) * cover, np.float32)

    def _carried(self, displacement_mm: Float32 | None) -> list[Float32]:
        """Every texture as the displacement has carried it."""
        rows, columns = self._shape
        m = self._margin
        if displacement_mm is None:
            return list(self._resting)
        px = np.float32(-1 / self._mm_per_px)
        x = displacement_mm[..., 0] * px
        y = displacement_mm[..., 1] * px
        x += np.arange(columns, dtype=np.float32) + m
        y += (np.arange(rows, dtype=np.float32) + m)[:, None]
        here = [
            cv2.remap(texture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
            for texture in self._textures
        ]
        # Views: to copy them apart would cost more than to read them where they are.
        return [
            np.asarray(plane, np.float32)
            for texture in here
            for plane in np.moveaxis(np.atleast_3d(texture), 2, 0)
        ]


def _slopes(height_mm: Float32, mm_per_px: float) -> tuple[Float32, Float32]:
    """Central differences; at the border the nearest ones."""
    padded = cv2.copyMakeBorder(height_mm, 1, 1, 1, 1, cv2.BORDER_REPLICATE)
    # The line through the last two pixels goes on, so that a plane has one slope everywhere.
    padded[0], padded[-1] = 2 * padded[1] - padded[2], 2 * padded[-2] - padded[-3]
    padded[:, 0], padded[:, -1] = 2 * padded[:, 1] - padded[:, 2], 2 * padded[:, -2] - padded[:, -3]
    half = np.float32(0.5 / mm_per_px)
    x = (padded[1:-1, 2:] - padded[1:-1, :-2]) * half
    y = (padded[2:, 1:-1] - padded[:-2, 1:-1]) * half
    return x, y


def _grain(
    shape: tuple[int, int], deviation: float, size_px: float, rng: np.random.Generator
) -> Float32:
    """Factor about 1 of the given standard deviation, correlated over some pixels."""
    numbers = rng.standard_normal(shape, np.float32)
    if size_px > 1:
        numbers = np.asarray(cv2.GaussianBlur(numbers, (0, 0), size_px / 2), np.float32)
        numbers /= numbers.std()
    return np.asarray(np.maximum(1 + np.float32(deviation) * numbers, 0), np.float32)
