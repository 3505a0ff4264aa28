"""Photometric stereo with lamps whose directions are given, and no calibration."""

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

_ROUNDS = 12
_TOLERANCE = 0.03
"""Misfit of a lamp, relative to the mean of all, at which it counts half."""

_BLOCK = 1 << 14
_ENOUGH_TO_DROP = 5
_STEEPEST = 5.0
_TINY = 1e-9
_FILE = "directions.npz"


def light_directions(azimuth_deg: Sequence[float], elevation_deg: Sequence[float]) -> Float32:
    """(K, 3) unit vectors from the skin towards lamps: x right, y down, z towards the camera."""
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    flat = np.cos(elevation)
    return np.stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=1
    ).astype(np.float32)


def robust_normals(intensity: Float32, directions: Float32) -> Float32:
    """Normals of a Lambertian surface, lamps in shadow or with a highlight left out by pixel.

    Least squares without the darkest and the brightest lamp (from five lamps on), then weighted
    anew by Cauchy's weights, so that a lamp that does not fit hardly counts.

    Parameters
    ----------
    intensity : (N, K) float32
        Over each lamp's strength.
    directions : (K, 3) float32
        Towards the lamps.

    Returns
    -------
    (N, 3) float32
        Unit normals, towards the camera.
    """
    blocks = [
        _solved(intensity[start : start + _BLOCK].astype(np.float64), directions)
        for start in range(0, len(intensity), _BLOCK)
    ]
    normals = np.concatenate(blocks)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), _TINY)
    return normals.astype(np.float32)


def _solved(intensity: NDArray[np.float64], directions: Float32) -> NDArray[np.float64]:
    weights = np.ones_like(intensity)
    if intensity.shape[1] >= _ENOUGH_TO_DROP:
        order = np.argsort(intensity, axis=1)
        np.put_along_axis(weights, order[:, [0, -1]], 1e-6, axis=1)
    scale = np.maximum(intensity.mean(axis=1, keepdims=True), _TINY)
    normals = _weighted(intensity, directions, weights)
    for _ in range(_ROUNDS):
        misfit = (intensity - normals @ directions.T) / scale
        normals = _weighted(intensity, directions, 1 / (1 + (misfit / _TOLERANCE) ** 2))
    return normals


def _weighted(
    intensity: NDArray[np.float64], directions: Float32, weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    normal = np.einsum("kc,nk,kd->ncd", directions, weights, directions, optimize=True)
    normal += _TINY * np.eye(3)
    right = (weights * intensity) @ directions
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])


class GivenLights(Calibration):
    """What can be measured before anything was calibrated: lamps where the profile has them.

    Parameters
    ----------
    directions : (K, 3) float32
        Towards the lamps.
    """

    compensation: ClassVar[Compensation] = "none"

    def __init__(self, directions: Float32) -> None:
        self._directions = directions

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Slopes of a Lambertian skin.

        Parameters
        ----------
        frame : Frame
        reference : Reference
            The level skin; of equal intensities where it is not known, which leaves the lamps'
            strengths to the frame.
        """
        height, width, lights = frame.pixels.shape
        if lights != len(self._directions):
            raise CalibrationError(
                f"the profile has {len(self._directions)} lights and the frame {lights} channels; "
                f"give one light per channel"
            )
        level = np.maximum(reference.pixels, 1e-3 * reference.full_scale)
        facing = self._directions[:, 2] if np.ptp(reference.pixels) else np.float32(1)
        light = (frame.pixels / level * facing).reshape(-1, lights)
        normals = robust_normals(light.astype(np.float32), self._directions)
        slopes = -normals[:, :2] / np.maximum(normals[:, 2:], 1e-3)
        steep = np.hypot(slopes[:, 0], slopes[:, 1])
        slopes *= np.minimum(1, _STEEPEST / np.maximum(steep, _TINY))[:, None]
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
            It is missing or broken.
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
