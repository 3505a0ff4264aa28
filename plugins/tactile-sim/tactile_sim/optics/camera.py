"""Camera model: light to pixel values, with noise, gamma and JPEG compression."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.illumination import COLOUR

# [steps] Resolution of noise samples, which are stored as int8: 127 steps reach 4 standard
# deviations, which one sample in 16 000 exceeds; rounding adds 1/(12 · 32²) of the variance
_STEPS_PER_SIGMA = 32

# Whether OpenCV has look-up tables of 16-bit numbers; numpy takes twice as long.
_LOOKS_UP_16_BITS = int(cv2.__version__.split(".")[0]) >= 5


@dataclass(frozen=True)
class Chip:
    """Image sensor: conversion of light to pixel values.

    Light is linear and in units of full scale.

    Attributes
    ----------
    full_well_e : float
        Electrons at full scale.
    read_noise_e : float
        Read noise, electrons.
    gamma : float
        1 for a linear camera.
    bit_depth : int
    jpeg_quality : int or None
    """

    full_well_e: float
    read_noise_e: float
    gamma: float
    bit_depth: int
    jpeg_quality: int | None

    @classmethod
    def from_profile(cls, profile: SensorBuild) -> Chip:
        """Return the image sensor of a profile.

        Raises
        ------
        InputError
            The profile combines JPEG with more than 8 bits.
        """
        image, sensor = profile.image, profile.optics.sensor
        webcam = image.transfer == "gamma" and image.color == "rgb" and image.bit_depth == 8
        quality = sensor.jpeg_quality
        if quality is None:
            quality = 90 if webcam else "none"  # [JPEG quality] of 8-bit colour cameras with gamma
        if quality != "none" and image.bit_depth > 8:
            raise InputError(
                f"profile {profile.name!r}: JPEG holds 8 bits and image.bit_depth is "
                f"{image.bit_depth}; set optics.sensor.jpeg_quality to none"
            )
        return cls(
            full_well_e=sensor.full_well_e,
            read_noise_e=sensor.read_noise_e,
            gamma=sensor.gamma if image.transfer == "gamma" else 1.0,
            bit_depth=image.bit_depth,
            jpeg_quality=None if quality == "none" else quality,
        )

    @property
    def dtype(self) -> type[Any]:
        """Pixel type: uint8, or uint16 for more than 8 bits."""
        return np.uint8 if self.bit_depth <= 8 else np.uint16

    def light_of(self, coded: float) -> float:
        """Light that gives this pixel value, both relative to full scale."""
        return float(coded**self.gamma)

    def read_out(
        self, light: Float32, noise: NDArray[Any], noise_scale: float = 1.0
    ) -> NDArray[Any]:
        """Convert light to pixel values, with shot noise and read noise.

        Parameters
        ----------
        light : (K, h, W) float32
        noise : float32 or int8 of the same shape
            Standard normal samples, in units of ``noise_scale``.
        noise_scale : float

        Returns
        -------
        uint8 or uint16 of the same shape
            At most ``2 ** bit_depth - 1``.
        """
        rows = light.reshape(-1, light.shape[-1])  # OpenCV adds planes below each other at once
        # Photons arrive independently: variance is proportional to light.
        spread = rows + np.float32(self.read_noise_e**2 / self.full_well_e)
        cv2.sqrt(spread, dst=spread)
        spread *= noise.reshape(rows.shape)
        noise_scale /= self.full_well_e**0.5
        most = self._levels - 1
        levels = cv2.addWeighted(rows, most, spread, most * noise_scale, 0, dtype=cv2.CV_16U)
        coded = cv2.LUT(levels, self._table) if _LOOKS_UP_16_BITS else self._table[levels]
        return np.asarray(coded.reshape(light.shape))

    def send(self, pixels: NDArray[Any]) -> NDArray[Any]:
        """Return (H, W, 1) or (H, W, 3) pixels after transmission: JPEG is lossy."""
        if self.jpeg_quality is None:
            return pixels
        return _compress_pixels(pixels, self.jpeg_quality).reshape(pixels.shape)

    @property
    def _levels(self) -> int:
        """Number of levels of light that the converter distinguishes."""
        linear = self.gamma == 1
        # [bits] A converter ahead of the gamma curve resolves at least as many
        return 1 << (self.bit_depth if linear else max(12, self.bit_depth))

    @cached_property
    def _table(self) -> NDArray[Any]:
        """(65536,) pixel value of each level of light, which is constant above full scale."""
        light = np.linspace(0, 1, self._levels)
        coded = np.rint(light ** (1 / self.gamma) * (2**self.bit_depth - 1)).astype(self.dtype)
        return np.pad(coded, (0, 2**16 - len(coded)), mode="edge")


class Numbers(NamedTuple):
    """Standard normal samples of one exposure.

    Attributes
    ----------
    steps : (size,) int8
    scale : float
        Unit of the steps, positive or negative.
    """

    steps: NDArray[np.int8]
    scale: float


class Noise:
    """Reproducible standard normal samples for every pixel of any frame.

    Samples are rounded to whole steps: an eighth of the bytes of the light per pixel has to be
    read.

    Parameters
    ----------
    size : int
        Samples per exposure.
    seed : int
    from_table : bool
        Read the samples from a table at a random offset with a random sign, which is ten times
        faster than drawing new ones.
    """

    def __init__(self, size: int, seed: int, *, from_table: bool) -> None:
        self._size = size
        self._seed = seed
        rng = np.random.default_rng([seed, 1])
        self._table = _draw_steps(2 * size, rng) if from_table else None  # [frames] of noise

    def draw_samples(self, frame: int, exposure: int) -> Numbers:
        """Return the samples of one exposure of one frame."""
        rng = np.random.default_rng([self._seed, 2, frame, exposure])
        scale = 1 / _STEPS_PER_SIGMA
        if self._table is None:
            return Numbers(_draw_steps(self._size, rng), scale)
        start = int(rng.integers(0, self._table.size - self._size + 1))
        steps = self._table[start : start + self._size]
        return Numbers(steps, scale if rng.integers(2) else -scale)


def _draw_steps(count: int, rng: np.random.Generator) -> NDArray[np.int8]:
    samples = rng.standard_normal(count, np.float32)
    samples *= np.float32(_STEPS_PER_SIGMA)
    most = np.iinfo(np.int8).max
    return np.clip(np.rint(samples, out=samples), -most, most, out=samples).astype(np.int8)


def crosstalk_matrix(share: float) -> Float32:
    """(3, 3) response of the red, green and blue channels to red, green and blue light.

    Adjacent colours leak by ``share``, red and blue into each other by a quarter of that. Each row
    sums to 1, so that white remains white.
    """
    far = share * 0.25  # [share] between red and blue
    matrix = np.array([[0, share, far], [share, 0, share], [far, share, 0]])
    np.fill_diagonal(matrix, 1 - matrix.sum(1))
    return matrix.astype(np.float32)


def vignette(shape: tuple[int, int], loss: float) -> Float32:
    """(H, W) transmission of the lens: 1 in the middle, 1 − ``loss`` in the corners."""
    y, x = (np.linspace(-1, 1, n, dtype=np.float32) ** 2 for n in shape)
    return np.asarray(1 - loss * (x + y[:, None]) / 2, np.float32)


def _compress_pixels(pixels: NDArray[Any], quality: int) -> NDArray[Any]:
    colour = pixels.ndim == COLOUR and pixels.shape[2] == COLOUR
    swapped = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR) if colour else pixels
    _, data = cv2.imencode(".jpg", swapped, [cv2.IMWRITE_JPEG_QUALITY, quality])
    sent = np.asarray(cv2.imdecode(data, cv2.IMREAD_UNCHANGED))
    return np.asarray(cv2.cvtColor(sent, cv2.COLOR_BGR2RGB)) if colour else sent
