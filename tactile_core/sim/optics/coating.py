"""Reflectance of the gel's coating: a diffuse part and a specular part."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.interfaces.component import SensorBuild


class SEMI_SPECULAR:
    """Reflectance of a semi-specular coating: metal flakes in silicone. Profiles may override it.

    References
    ----------
    .. [1] Yuan, Dong, Adelson, "GelSight: High-Resolution Robot Tactile Sensors for Estimating
       Geometry and Force", Sensors 17, 2017.
    """

    # [share] Specular share of the reflected light. Source: by hand, to look like the coated gels
    # in [1]_, figure 4.
    specular = 0.2
    # [root-mean-square slope over √2] Roughness of Beckmann's facet distribution; highlights are
    # about 20° wide. Source: by hand, to look like the coated gels in [1]_, figure 4.
    roughness = 0.35


@dataclass(frozen=True)
class Coating:
    """A diffuse part, and a specular part of microscopic facets.

    Attributes
    ----------
    specular : float
        Share of the specular part.
    roughness : float
        Roughness of Beckmann's facet distribution.
    """

    specular: float
    roughness: float

    @classmethod
    def from_profile(cls, profile: SensorBuild) -> Coating:
        """Return the coating of the profile's gel and optics."""
        share = SEMI_SPECULAR.specular if profile.gel.coating == "semi_specular" else 0.0
        coat = profile.optics.coat
        return cls(
            share if coat.specular is None else coat.specular,
            SEMI_SPECULAR.roughness if coat.roughness is None else coat.roughness,
        )


@dataclass(frozen=True, eq=False)
class Shading:
    """Reflection of one light by one coating, precomputed per pixel.

    Attributes
    ----------
    toward : (3, H, W) float32
        Half the light vectors of the diffuse part, see
        :func:`~tactile_core.sim.optics.lights.light_field`.
    blur : float
        Softness of the horizon of an extended light, in the units of ``toward``.
    lobe : (3, H, W) float32 or None
        Half vectors between light and camera, times the sharpness of the specular lobe; None
        without a specular part.
    peak : (H, W) float32 or None
        Logarithm of the specular peak, minus the sharpness.

    References
    ----------
    .. [1] Torrance, Sparrow, "Theory for Off-Specular Reflection From Roughened Surfaces", Journal
       of the Optical Society of America 57, 1967.
    .. [2] Wang, Ren, Gong, Snyder, Guo, "All-Frequency Rendering of Dynamic, Spatially-Varying
       Reflectance", ACM Transactions on Graphics 28, 2009.
    """

    toward: Float32
    blur: float
    lobe: Float32 | None = None
    peak: Float32 | None = None

    @classmethod
    def prepare(cls, toward: Float32, blur: float, coating: Coating, view: Float32) -> Shading:
        """Precompute the shading of one light.

        Parameters
        ----------
        toward : (3, H, W) float32
            Light vectors.
        blur : float
            Half the angle that the light subtends, rad, times the length of ``toward``.
        coating : Coating
        view : (3, H, W) float32
            Unit vectors towards the camera.
        """
        diffuse = 0.5 * (1 - coating.specular)
        if coating.specular == 0:
            return cls(toward * np.float32(diffuse), blur * diffuse)
        strength = np.maximum(np.sqrt((toward**2).sum(0)), 1e-9)
        half = toward / strength + view
        half /= np.sqrt((half**2).sum(0))
        # Torrance and Sparrow 1967: D / (4 n·v) of the light, with n·v nearly 1. Beckmann's D is
        # close to exp(2 (n·h − 1) / m²) / m² for n·h near 1 (Wang et al. 2009); its exponent is
        # linear in the normal.
        sharpness = 2 / coating.roughness**2
        gloss = coating.specular * strength * sharpness / 8
        return cls(
            toward * np.float32(diffuse),
            blur * diffuse,
            (half * sharpness).astype(np.float32),
            (np.log(gloss) - sharpness).astype(np.float32),
        )

    def reflect(self, normals: Float32, rows: slice = slice(None)) -> Float32:
        """Return the light reflected towards the camera, without cast shadows.

        Parameters
        ----------
        normals : (3, h, W) float32
            Unit normals; the third component points to the camera.
        rows : slice
            The h rows of the image that they cover.

        Returns
        -------
        (h, W) float32
        """
        light = _softly_positive(_dot(normals, self.toward[:, rows]), self.blur)
        if self.lobe is not None and self.peak is not None:
            specular = _dot(normals, self.lobe[:, rows])
            specular += self.peak[rows]
            light += np.asarray(cv2.exp(specular), np.float32)
        return light


def _dot(a: Float32, b: Float32) -> Float32:
    total = a[0] * b[0]
    # OpenCV multiplies and adds in one pass
    cv2.accumulateProduct(a[1], b[1], total)
    cv2.accumulateProduct(a[2], b[2], total)
    return np.asarray(total)


def _softly_positive(half_cosine: Float32, half_blur: float) -> Float32:
    """Soft clamp of a cosine at 0: an extended light sets gradually below the horizon."""
    constant = _constant(half_cosine.shape, half_blur)
    root = np.asarray(cv2.magnitude(half_cosine, constant), np.float32)
    root += half_cosine
    return root


@lru_cache(maxsize=32)
def _constant(shape: tuple[int, ...], value: float) -> Float32:
    return np.full(shape, value, np.float32)
