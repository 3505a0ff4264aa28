"""Assembles the exposures of one observation into a frame of K light channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactile_core.acquisition.devices import exposures_of
from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.errors import InputError
from tactile_core.interfaces.illumination import Exposure, Illumination
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import Frame, Image, Pixels


class Assembly:
    """Rectifies exposures and stacks their channels.

    Parameters
    ----------
    illumination : Illumination
        Defines the channels of each exposure.
    image : ImageSection

    Attributes
    ----------
    exposures : tuple of Exposure
        The exposures of one observation, in order.
    """

    def __init__(self, illumination: Illumination, image: ImageSection) -> None:
        self.exposures = exposures_of(illumination)
        if image.color != "rgb" and any(exposure.color for exposure in self.exposures):
            raise InputError(
                f"a light has a color, but the profile specifies color: {image.color}; write "
                f"'image.color: rgb', or remove the color of the lights"
            )
        self._channels = tuple(illumination.channels)
        self._image = image
        self._geometry = ImageGeometry(image)

    def frame(self, images: Sequence[Image], sequence: int = 0) -> Frame:
        """Make a frame from the exposures of one observation, in order.

        Raises
        ------
        InputError
            An image does not match the profile, or the number of images is wrong.
        """
        if len(images) != len(self.exposures):
            raise InputError(
                f"one observation takes {len(self.exposures)} exposures, not {len(images)}; give "
                f"each image of its sequence, in order"
            )
        planes: list[Pixels] = []
        times: list[float] = []
        dark: Image | None = None
        for image, exposure in zip(images, self.exposures, strict=True):
            if exposure.channels:
                planes.append(self._planes(image, exposure))
                times.append(image.timestamp_s)
            else:
                dark = image
        if dark is not None:
            planes = self._without_ambient(planes, dark)
        return Frame(
            pixels=planes[0] if len(planes) == 1 else _channels_of(planes),
            channels=self._channels,
            mm_per_px=self._image.mm_per_px,
            full_scale=self._image.full_scale,
            timestamp_s=sum(times) / len(times),
            wall_time_s=sum(image.wall_time_s for image in images) / len(images),
            sequence=sequence,
            source=images[0].source,
            exposure_times_s=tuple(times),
            standalone=images[0].standalone,
        )

    def _without_ambient(self, planes: Sequence[Pixels], dark: Image) -> list[Pixels]:
        """Subtract a dark exposure, of each colour from the exposures of that colour."""
        lit = [exposure for exposure in self.exposures if exposure.channels]
        ambient = {exposure.color: self._planes(dark, exposure) for exposure in lit}
        return [
            _less(plane, ambient[exposure.color], self._image.full_scale)
            for plane, exposure in zip(planes, lit, strict=True)
        ]

    def _planes(self, image: Image, exposure: Exposure) -> Pixels:
        wanted = len(exposure.channels)
        try:
            pixels = self._geometry.apply(image.pixels, exposure.color)
        except InputError as error:
            raise InputError(f"{image.source or 'camera'}: {error}") from error
        pixels = pixels if pixels.ndim == 3 else pixels[..., None]
        if pixels.shape[2] != wanted:
            raise InputError(
                f"{image.source or 'camera'}: the image has {pixels.shape[2]} channels instead of "
                f"{wanted}; correct 'image.color' or 'illumination' in the profile"
            )
        return pixels


def _channels_of(planes: list[Pixels]) -> Pixels:
    """Stack K exposures to (H, W, K), stored plane by plane, as photometric stereo reads them."""
    return np.concatenate([plane.transpose(2, 0, 1) for plane in planes]).transpose(1, 2, 0)


def _less(lit: Pixels, dark: Pixels, full_scale: float) -> Pixels:
    """Subtract the dark exposure.

    Results are clipped at 0, where unsigned pixels would wrap. Saturated pixels keep their value:
    their true intensity is unknown, and a smaller value would look like a valid measurement.
    """
    return np.where(lit >= LEVELS.saturation_share * full_scale, lit, lit - np.minimum(lit, dark))
