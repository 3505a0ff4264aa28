"""Photometric stereo with given light directions, without calibration."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.interfaces.calibration import Calibration, Compensation
from tactile_core.quantities import Float32, Frame, Gradients, Reference

_TINY = 1e-9  # Keeps denominators and equations regular

_FILE = "directions.npz"


def light_directions(azimuth_deg: Sequence[float], elevation_deg: Sequence[float]) -> Float32:
    """Return (K, 3) unit vectors towards the lights: x right, y down, z towards the camera."""
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    flat = np.cos(elevation)
    return np.stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=1
    ).astype(np.float32)


def robust_normals(intensity: Float32, directions: Float32) -> Float32:
    """Estimate normals of a Lambertian surface, robust against shadows and highlights.

    Iteratively reweighted least squares [2]_ with Cauchy weights, per pixel, so that lights in
    shadow or with a highlight have little influence. With five or more lights, the first solution
    leaves out the darkest and the brightest one.

    Parameters
    ----------
    intensity : (N, K) float32
        Intensities divided by the strength of each light.
    directions : (K, 3) float32
        Unit vectors towards the lights.

    Returns
    -------
    (N, 3) float32
        Unit normals, towards the camera.

    References
    ----------
    .. [1] R. J. Woodham, "Photometric method for determining surface orientation from multiple
       images", Optical Engineering 19(1), 1980.
    .. [2] P. W. Holland and R. E. Welsch, "Robust regression using iteratively reweighted
       least-squares", Communications in Statistics 6(9), 1977.
    """
    block = 1 << 14  # [pixels] bounds memory
    blocks = [
        _solve_normals(intensity[start : start + block].astype(np.float64), directions)
        for start in range(0, len(intensity), block)
    ]
    normals = np.concatenate(blocks)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), _TINY)
    return normals.astype(np.float32)


def _solve_normals(intensity: NDArray[np.float64], directions: Float32) -> NDArray[np.float64]:
    weights = np.ones_like(intensity)
    if intensity.shape[1] >= 5:  # three remain without the extremes
        order = np.argsort(intensity, axis=1)
        # [weight] The equations stay regular
        np.put_along_axis(weights, order[:, [0, -1]], 1e-6, axis=1)
    scale = np.maximum(intensity.mean(axis=1, keepdims=True), _TINY)
    normals = _solve_weighted(intensity, directions, weights)
    for _ in range(12):  # [reweightings]
        residual = (intensity - normals @ directions.T) / scale
        # [share of the mean intensity] There a light has half its weight
        normals = _solve_weighted(intensity, directions, 1 / (1 + (residual / 0.03) ** 2))
    return normals


def _solve_weighted(
    intensity: NDArray[np.float64], directions: Float32, weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    normal = np.einsum("kc,nk,kd->ncd", directions, weights, directions, optimize=True)
    normal += _TINY * np.eye(3)
    right = (weights * intensity) @ directions
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])


class GivenLights(Calibration):
    """Measures without calibration, with the light directions of the profile.

    Parameters
    ----------
    directions : (K, 3) float32
        Unit vectors towards the lights.
    """

    compensation: ClassVar[Compensation] = "none"

    def __init__(self, directions: Float32) -> None:
        self._directions = directions

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Return the slopes of a Lambertian surface.

        Parameters
        ----------
        frame : Frame
        reference : Reference
            The undeformed, level gel surface. A reference of equal intensities means that none was
            recorded; all lights are then assumed to have the same strength.

        Raises
        ------
        CalibrationError
            The frame has another number of channels than there are lights.
        """
        height, width, lights = frame.pixels.shape
        if lights != len(self._directions):
            raise CalibrationError(
                f"the profile has {len(self._directions)} lights and the frame {lights} channels; "
                f"give one light per channel"
            )
        level = np.maximum(reference.pixels, 1e-3 * reference.full_scale)  # no division by zero
        facing = self._directions[:, 2] if np.ptp(reference.pixels) else np.float32(1)
        light = (frame.pixels / level * facing).reshape(-1, lights)
        normals = robust_normals(light.astype(np.float32), self._directions)
        slopes = -normals[:, :2] / np.maximum(normals[:, 2:], 1e-3)  # no division by zero
        steep = np.hypot(slopes[:, 0], slopes[:, 1])
        # [slope] Normals at right angles to the camera have no finite one
        slopes *= np.minimum(1, 5.0 / np.maximum(steep, _TINY))[:, None]
        planes = slopes.T.reshape(2, height, width)
        valid = (normals[:, 2] > 0).reshape(height, width)
        gx, gy = (np.ascontiguousarray(plane, np.float32) for plane in planes)
        return Gradients(gx, gy, valid, frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        """Write ``directions.npz``."""
        write_npz(directory / _FILE, {"directions": self._directions})

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``directions.npz``.

        Raises
        ------
        CalibrationError
            The file is missing or damaged.
        """
        path = directory / _FILE
        try:
            directions = np.asarray(read_npz(path)["directions"], np.float32)
            if (
                directions.ndim != 2
                or directions.shape[1] != 3
                or not np.isfinite(directions).all()
            ):
                raise ValueError("no directions")
        except (InputError, LookupError, ValueError, TypeError) as error:
            raise CalibrationError(f"{path} holds no directions of lights") from error
        return cls(directions)
