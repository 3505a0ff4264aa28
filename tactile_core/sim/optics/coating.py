"""What the skin sends to the camera of the light that falls on it: matte, or with flakes."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.interfaces.component import SensorBuild

_SEMI_SPECULAR = (0.2, 0.35)
"""Share and roughness of metal flakes in silicone: they shine over some 20° around the mirror's
direction, as the coated gels of the 2017 review (figure 4) do."""


@dataclass(frozen=True)
class Coating:
    """A diffuse part and a part that mirrors in microscopic facets.

    Attributes
    ----------
    specular : float
        Share of the second part.
    roughness : float
        Of Beckmann's distribution of facets.
    """

    specular: float
    roughness: float

    @classmethod
    def of(cls, profile: SensorBuild) -> Coating:
        """Return what the profile's gel and optics say."""
        share, roughness = _SEMI_SPECULAR if profile.gel.coating == "semi_specular" else (0.0, 0.35)
        said = profile.optics.coat
        return cls(
            share if said.specular is None else said.specular,
            roughness if said.roughness is None else said.roughness,
        )


@dataclass(frozen=True, eq=False)
class Shading:
    """One lamp over one coating, prepared: from normals to the light that goes to the camera.

    Attributes
    ----------
    toward : (3, H, W) float32
        Light vectors of the diffuse part, see :func:`~tactile_core.sim.optics.lights.light_field`.
    blur : float
        Part of the lamp that a skin seen edge-on still receives, as long as ``toward``.
    lobe : (3, H, W) float32 or None
        Unit vectors between lamp and camera, times the sharpness of the mirrored part; None for
        a coating that mirrors nothing.
    peak : (H, W) float32 or None
        Logarithm of the mirrored light where a facet faces the half vector, less the sharpness.
    """

    toward: Float32
    blur: float
    lobe: Float32 | None = None
    peak: Float32 | None = None

    @classmethod
    def prepare(cls, toward: Float32, blur: float, coating: Coating, view: Float32) -> Shading:
        """Prepare one lamp.

        Parameters
        ----------
        toward : (3, H, W) float32
            Its light vectors.
        blur : float
            Half the angle that it fills, rad, times the length of ``toward``.
        coating : Coating
        view : (3, H, W) float32
            Unit vectors towards the camera.
        """
        if coating.specular == 0:
            return cls(toward, blur)
        strength = np.maximum(np.sqrt((toward**2).sum(0)), 1e-9)
        half = toward / strength + view
        half /= np.sqrt((half**2).sum(0))
        # Torrance and Sparrow 1967: D / (4 n·v) of the light, with n·v nearly 1. Beckmann's D is
        # close to exp(2 (n·h − 1) / m²) / m² for n·h near 1 (Wang et al. 2009), an exponential of
        # what is linear in the normal.
        sharpness = 2 / coating.roughness**2
        gloss = coating.specular * strength * sharpness / 8
        return cls(
            toward * np.float32(1 - coating.specular),
            blur * (1 - coating.specular),
            (half * sharpness).astype(np.float32),
            (np.log(gloss) - sharpness).astype(np.float32),
        )

    def reflect(self, normals: Float32, rows: slice = slice(None)) -> Float32:
        """Return the light towards the camera, without shadows that the skin casts.

        Parameters
        ----------
        normals : (3, h, W) float32
            Unit normals; the third component points to the camera.
        rows : slice
            Which h rows of the image they are.

        Returns
        -------
        (h, W) float32
        """
        light = _softly_positive(_dot(normals, self.toward[:, rows]), self.blur)
        if self.lobe is not None and self.peak is not None:
            mirrored = _dot(normals, self.lobe[:, rows])
            mirrored += self.peak[rows]
            light += np.asarray(cv2.exp(mirrored), np.float32)
        return light


def _dot(a: Float32, b: Float32) -> Float32:
    total = a[0] * b[0]
    total += a[1] * b[1]
    total += a[2] * b[2]
    return np.asarray(total)


def _softly_positive(cosine: Float32, blur: float) -> Float32:
    """The part of an extended lamp that is above the skin's own horizon, times its cosine."""
    root = cosine * cosine
    root += np.float32(blur**2)
    np.sqrt(root, out=root)
    root += cosine
    root *= np.float32(0.5)
    return np.asarray(root)
