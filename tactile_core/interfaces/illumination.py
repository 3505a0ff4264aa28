"""The illumination interface: where the lights are and which of them shine in each exposure.

A description, made of a profile's options; what switches real lights is a
:class:`~tactile_core.interfaces.light_driver.LightDriver`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import BaseModel

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.optics import LightBuild


@dataclass(frozen=True)
class Light:
    """One light, as seen from the image centre.

    Attributes
    ----------
    name : str
    azimuth_deg : float
        Where it stands around the image, from x towards y: 0 is right, 90 is down.
    elevation_deg : float
        Its angle above the gel surface; 90 shines straight onto it.
    feeds : tuple of str
        Channels that see it, where several lights share an exposure; empty: the channel of its own
        name, and all of them where there is none.
    build : Lamps
        How it is built, for the virtual sensor: only what is said here differs from the profile's
        ``optics.lights``.
    """

    name: str
    azimuth_deg: float
    elevation_deg: float
    feeds: tuple[str, ...] = ()
    build: LightBuild = field(default_factory=LightBuild)


@dataclass(frozen=True)
class Exposure:
    """One exposure of an observation.

    Attributes
    ----------
    levels : mapping of light to level
        Brightness 0..1 of each light that shines.
    channels : tuple of str
        The light channels that this exposure measures; empty for a dark exposure.
    exposure_time_s : float or None
        How long it lasts, where that differs from the camera's own setting.
    gain : float or None
        The camera's gain, as the camera counts it, where it differs from its own setting.
    """

    levels: Mapping[str, float]
    channels: tuple[str, ...]
    exposure_time_s: float | None = None
    gain: float | None = None


class Illumination(ABC):
    """How one photometric observation is lit.

    Authors write ``channels`` and ``exposures``, and ``lights`` where they know the places. All of
    them follow from the options alone and are always the same.
    """

    Options: ClassVar[type[BaseModel]] = Options

    def __init__(self, options: BaseModel) -> None:
        self.options = options

    @property
    def lights(self) -> tuple[Light, ...]:
        """The lights and where they stand; empty where the profile does not say."""
        return ()

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the K light channels of a frame, in order."""

    @abstractmethod
    def exposures(self) -> tuple[Exposure, ...]:
        """Return the sequence of exposures that make one observation."""
