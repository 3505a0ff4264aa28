"""The illumination interface: the lights' positions, and which of them are on in each exposure.

An illumination only describes; a :class:`~tactile_core.interfaces.light_driver.LightDriver`
switches real lights.
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
        Direction from the image centre, from x towards y: 0 is right, 90 is down.
    elevation_deg : float
        Angle above the gel surface; 90 is perpendicular to it.
    feeds : tuple of str
        Channels that see the light, if several lights share an exposure. Empty: the channel of
        the same name or, if there is none, all channels.
    build : LightBuild
        Construction of this light in the virtual sensor; keys that it sets override the
        profile's ``optics.lights``.
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
        Brightness 0..1 of each light that is on.
    channels : tuple of str
        The light channels that this exposure measures; empty for a dark exposure.
    exposure_time_s : float or None
        Exposure time, if it differs from the camera's setting.
    gain : float or None
        Gain in the camera's own unit, if it differs from the camera's setting.
    """

    levels: Mapping[str, float]
    channels: tuple[str, ...]
    exposure_time_s: float | None = None
    gain: float | None = None


class Illumination(ABC):
    """The lighting of one photometric observation.

    Implement ``channels`` and ``exposures``, and ``lights`` if the positions are known. All three
    depend on the options alone and never change.
    """

    Options: ClassVar[type[BaseModel]] = Options

    def __init__(self, options: BaseModel) -> None:
        self.options = options

    @property
    def lights(self) -> tuple[Light, ...]:
        """The lights and their positions; empty if the profile does not give them."""
        return ()

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the K light channels of a frame, in order."""

    @abstractmethod
    def exposures(self) -> tuple[Exposure, ...]:
        """Return the exposures that make up one observation, in order."""
