"""What the skin sends to the camera of the light that falls on it: matte, or with flakes."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.profiles.model import Profile

Float32 = NDArray[np.float32]

_SEMI_SPECULAR = (0.2, 0.35)
"""Share and roughness of metal flakes in silicone: they shine over some 20° around the mirror's
direction, as the coated gels of the 2017 review (figure 4) do."""

_STEEPEST_COSINE = 0.05


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
    def of(cls, profile: Profile) -> Coating:
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
        Light vectors, see :func:`~tactile_core.sim.optics.lights.light_field`.
    blur : float
        Half the angle that the lamp fills, rad.
    coating : Coating
    half : (3, H, W) float32 or None
        Unit vectors between lamp and camera; None for a coating that mirrors nothing.
    gloss : (H, W) float32 or None
        How strong the mirrored light is, where a facet faces the half vector.
    """

    toward: Float32
    blur: float
    coating: Coating
    half: Float32 | None = None
    gloss: Float32 | None = None

    @classmethod
    def prepare(cls, toward: Float32, blur: float, coating: Coating, view: Float32) -> Shading:
        """Prepare a lamp; ``view`` (3, H, W) holds unit vectors towards the camera."""
        if coating.specular == 0:
            return cls(toward, blur, coating)
        strength = np.sqrt((toward**2).sum(0))
        half = toward / np.maximum(strength, 1e-9) + view
        half /= np.sqrt((half**2).sum(0))
        # Torrance and Sparrow 1967: D / (4 n·v), the cosine of the light cancelled; n·v is nearly 1.
        gloss = coating.specular * strength / (4 * coating.roughness**2)
        return cls(toward, blur, coating, half, gloss.astype(np.float32))

    def reflect(self, normals: Float32) -> Float32:
        """Return (H, W) float32 light towards the camera, without shadows that the skin casts.

        Parameters
        ----------
        normals : (3, H, W) float32
            Unit normals; the third component points to the camera.
        """
        light = _softly_positive(_dot(normals, self.toward), self.blur)
        if self.half is None or self.gloss is None:
            return light
        light *= np.float32(1 - self.coating.specular)
        cosine = cv2.max(_dot(normals, self.half), _STEEPEST_COSINE)
        # Beckmann: exp(−tan²/m²) / cos⁴, written with t = 1/cos².
        t = cv2.divide(1.0, cv2.multiply(cosine, cosine))
        lobe = cv2.exp((1 - t) * np.float32(self.coating.roughness**-2))
        lobe *= t
        lobe *= t
        lobe *= self.gloss
        light += lobe
        return light


def _dot(a: Float32, b: Float32) -> Float32:
    total = a[0] * b[0]
    total += a[1] * b[1]
    total += a[2] * b[2]
    return np.asarray(total)


def _softly_positive(cosine: Float32, blur: float) -> Float32:
    """The part of an extended lamp that is above the skin's own horizon, times its cosine."""
    root = cv2.multiply(cosine, cosine)
    root += np.float32(blur**2)
    cv2.sqrt(root, dst=root)
    root += cosine
    root *= np.float32(0.5)
    return np.asarray(root)
