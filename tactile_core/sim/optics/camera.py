"""The camera: from light to the numbers that it sends, with its noise and its compression."""

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

_CONVERTER_BITS = 12
_TABLE_FRAMES = 2
_DEFAULT_JPEG_QUALITY = 90
_COLOURS = 3


@dataclass(frozen=True)
class Chip:
    """How light becomes numbers.

    Light is told as the share of full scale that it gives, linear.

    Attributes
    ----------
    full_well_e, read_noise_e : float
        Electrons at full scale, and the noise without any light.
    gamma : float
        1 for a camera that is linear in light.
    bit_depth : int
    jpeg_quality : int or None
    """

    full_well_e: float
    read_noise_e: float
    gamma: float
    bit_depth: int
    jpeg_quality: int | None

    @classmethod
    def of(cls, profile: SensorBuild) -> Chip:
        """Return what the profile says.

        Raises
        ------
        InputError
            The profile wants JPEG of more than 8 bits.
        """
        image, said = profile.image, profile.optics.sensor
        webcam = image.transfer == "gamma" and image.color == "rgb" and image.bit_depth == 8
        quality = said.jpeg_quality
        if quality is None:
            quality = _DEFAULT_JPEG_QUALITY if webcam else "none"
        if quality != "none" and image.bit_depth > 8:
            raise InputError(
                f"profile {profile.name!r}: JPEG holds 8 bits and image.bit_depth is "
                f"{image.bit_depth}; set optics.sensor.jpeg_quality to none"
            )
        return cls(
            full_well_e=said.full_well_e,
            read_noise_e=said.read_noise_e,
            gamma=said.gamma if image.transfer == "gamma" else 1.0,
            bit_depth=image.bit_depth,
            jpeg_quality=None if quality == "none" else quality,
        )

    @property
    def dtype(self) -> type[Any]:
        """Type of the pixels: uint8, or uint16 for more than 8 bits."""
        return np.uint8 if self.bit_depth <= 8 else np.uint16

    def light_of(self, coded: float) -> float:
        """Light that gives an intensity, both as shares of full scale."""
        return float(coded**self.gamma)

    def read_out(self, light: Float32, noise: Float32) -> NDArray[Any]:
        """Turn light into numbers.

        Parameters
        ----------
        light : (H, W) or (H, W, 3) float32
        noise : float32 of the same shape
            Standard normal numbers.

        Returns
        -------
        uint8 or uint16 of the same shape
            Not more than ``2 ** bit_depth - 1``.
        """
        # Photons arrive independently: variance is proportional to light.
        spread = np.maximum(light, 0)
        spread *= np.float32(1 / self.full_well_e)
        spread += np.float32((self.read_noise_e / self.full_well_e) ** 2)
        np.sqrt(spread, out=spread)
        spread *= noise
        spread += light
        return self._coded(spread)

    def send(self, pixels: NDArray[Any]) -> NDArray[Any]:
        """Return what arrives of (H, W, 1) or (H, W, 3) pixels: less, if they are compressed."""
        if self.jpeg_quality is None:
            return pixels
        return _compressed(pixels, self.jpeg_quality).reshape(pixels.shape)

    def _coded(self, light: Float32) -> NDArray[Any]:
        most = self.table.size - 1
        levels = light * np.float32(most)
        levels += np.float32(0.5)
        np.clip(levels, 0, most, out=levels)
        if self.gamma == 1:
            return np.asarray(levels.astype(self.dtype))
        return np.asarray(self.table.take(levels.astype(np.uint16)))

    @cached_property
    def table(self) -> NDArray[Any]:
        """(L,) number that each of L even levels of light becomes; the last is full scale."""
        if self.gamma == 1:
            return np.arange(2**self.bit_depth).astype(self.dtype)
        bits = max(_CONVERTER_BITS, self.bit_depth)
        light = np.linspace(0, 1, 2**bits)
        coded = np.rint(light ** (1 / self.gamma) * (2**self.bit_depth - 1))
        return np.asarray(coded.astype(self.dtype))


class Numbers(NamedTuple):
    """Normal numbers for one exposure.

    Attributes
    ----------
    values : (size,) float32
    sign : float
        1 or -1, to be multiplied with.
    """

    values: Float32
    sign: float

    @property
    def signed(self) -> Float32:
        """(size,) float32 with the sign."""
        return self.values if self.sign > 0 else -self.values


class Noise:
    """Normal numbers for every pixel of any frame, the same for the same frame.

    Parameters
    ----------
    size : int
        Numbers per exposure.
    seed : int
    from_table : bool
        Take them from a table, at another place and with another sign each time, which is ten
        times faster than to draw them.
    """

    def __init__(self, size: int, seed: int, *, from_table: bool) -> None:
        self._size = size
        self._seed = seed
        rng = np.random.default_rng([seed, 1])
        self._table = rng.standard_normal(_TABLE_FRAMES * size, np.float32) if from_table else None

    def of(self, frame: int, exposure: int) -> Numbers:
        """Return the numbers of one exposure of one frame."""
        rng = np.random.default_rng([self._seed, 2, frame, exposure])
        if self._table is None:
            return Numbers(rng.standard_normal(self._size, np.float32), 1.0)
        start = int(rng.integers(0, self._table.size - self._size + 1))
        numbers = self._table[start : start + self._size]
        return Numbers(numbers, 1.0 if rng.integers(2) else -1.0)


def crosstalk_matrix(share: float) -> Float32:
    """(3, 3) what each of red, green and blue sees of the lamps' red, green and blue.

    Neighbours in the spectrum take ``share``, red and blue a quarter of that from each other; what
    a channel gives away its own colour lacks, so that white stays white.
    """
    far = share / 4
    matrix = np.array([[0, share, far], [share, 0, share], [far, share, 0]])
    np.fill_diagonal(matrix, 1 - matrix.sum(1))
    return matrix.astype(np.float32)


def vignette(shape: tuple[int, int], loss: float) -> Float32:
    """(H, W) share of the light that the lens lets through; ``loss`` is missing in the corners."""
    y, x = (np.linspace(-1, 1, n, dtype=np.float32) ** 2 for n in shape)
    return np.asarray(1 - loss * (x + y[:, None]) / 2, np.float32)


def _compressed(pixels: NDArray[Any], quality: int) -> NDArray[Any]:
    colour = pixels.ndim == _COLOURS and pixels.shape[2] == _COLOURS
    swapped = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR) if colour else pixels
    _, data = cv2.imencode(".jpg", swapped, [cv2.IMWRITE_JPEG_QUALITY, quality])
    back = cv2.imdecode(data, cv2.IMREAD_COLOR if colour else cv2.IMREAD_GRAYSCALE)
    sent = np.asarray(back)
    return np.asarray(cv2.cvtColor(sent, cv2.COLOR_BGR2RGB)) if colour else sent
