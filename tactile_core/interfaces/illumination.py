"""The illumination interface: which lights shine during each exposure of an observation."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import Device


@dataclass(frozen=True)
class Exposure:
    """One exposure of an observation.

    Attributes
    ----------
    levels : mapping of light to level
        Brightness 0..1 of each light that shines.
    channels : tuple of str
        The light channels that this exposure measures; empty for a dark exposure.
    """

    levels: Mapping[str, float]
    channels: tuple[str, ...]


@dataclass(frozen=True)
class Light:
    """Where one light is.

    Attributes
    ----------
    name : str
    azimuth_deg : float
        From x towards y.
    elevation_deg : float
        Angle of its light to the gel surface.
    """

    name: str
    azimuth_deg: float
    elevation_deg: float


class Illumination(Device):
    """How one photometric observation is lit.

    Authors write ``channels``, ``exposures``, ``_set``, ``_open`` and ``_close``.
    """

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the K light channels of a frame, in order."""

    @abstractmethod
    def exposures(self) -> tuple[Exposure, ...]:
        """Return the sequence of exposures that make one observation."""

    def attach(self, camera: Camera) -> None:
        """Meet the camera, for lights that hang on its handle; called before ``open``."""

    def set(self, levels: Mapping[str, float]) -> None:
        """Shine as told; lights that are not named are dark.

        Raises
        ------
        DeviceError
            The illumination is closed or does not obey.
        ValueError
            A level lies outside 0..1.
        """
        self._require_open()
        for name, level in levels.items():
            if not 0 <= level <= 1:
                raise ValueError(f"light {name!r}: level {level} is outside 0..1")
        self._set(levels)

    @abstractmethod
    def _set(self, levels: Mapping[str, float]) -> None:
        """Shine as told."""
