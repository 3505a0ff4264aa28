"""The simulator interface: virtual sensors of any profile, and a hand that presses on them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.component import SensorBuild
from tactile_core.quantities import Frame


class Renderer(ABC):
    """Renders what a profile's camera sees of a gel surface of given height.

    Attributes
    ----------
    channels : tuple of str
        Names of the K channels of a frame.
    full_scale : float
        Largest pixel value.
    """

    channels: tuple[str, ...]
    full_scale: float

    @abstractmethod
    def take_frame(
        self,
        height_mm: NDArray[Any],
        displacement_mm: NDArray[Any] | None = None,
        *,
        number: int,
        time_s: float = 0.0,
    ) -> Frame:
        """Take one frame with every exposure of the profile's sequence.

        Parameters
        ----------
        height_mm : (H, W) array
            Height of the gel surface at each pixel, positive where an object presses, mm.
        displacement_mm : (H, W, 2) array, optional
            How far the surface that each pixel shows has moved, x and y, mm.
        number : int
            Selects the noise.
        time_s : float
            Timestamp of the frame.
        """


class Simulator(ABC):
    """Virtual units of any profile."""

    @abstractmethod
    def renderer(self, build: SensorBuild, *, seed: int = 0) -> Renderer:
        """Return the optics of a unit; the seed selects the unit.

        Raises
        ------
        TactileError, ValueError
            The profile says too little to be rendered.
        """

    @abstractmethod
    def write_presses(self, build: SensorBuild, folder: Path, *, count: int) -> float:
        """Press a ball into a virtual gel and write what ``tactile calibrate`` reads.

        Parameters
        ----------
        build : SensorBuild
        folder : Path
            Receives the recordings ``presses`` and ``reference``.
        count : int
            Number of presses.

        Returns
        -------
        float
            Diameter of the ball, mm.
        """

    @abstractmethod
    def write_script(self, build: SensorBuild, path: Path, *, ball_diameter_mm: float) -> None:
        """Write a script of the virtual camera in which a ball is pressed all over the gel.

        The gel is left alone first. Each press is held, and the ball then lifted, as a guided
        calibration asks.

        Parameters
        ----------
        build : SensorBuild
        path : Path
            A new YAML file.
        ball_diameter_mm : float
        """


@dataclass(frozen=True)
class Aim:
    """Where the object of a hand should be.

    Attributes
    ----------
    x_mm, y_mm : float
        Relative to the image centre.
    angle_deg : float
        Positive from x towards y.
    depth_mm : float
        Below first contact.
    pressed : bool
        Whether it touches the gel.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    angle_deg: float = 0.0
    depth_mm: float = 0.4
    pressed: bool = False


class Hand(ABC):
    """Moves an object on a virtual sensor towards its aim; usable from any thread.

    Attributes
    ----------
    problem : str
        Why the object was let go; empty if all is well.
    """

    problem: str = ""

    @property
    @abstractmethod
    def deepest_mm(self) -> float:
        """Deepest press."""

    @abstractmethod
    def take(self, kind: str, options: Mapping[str, Any]) -> None:
        """Choose the object; one that is pressed is released first.

        Raises
        ------
        InputError
            There is no such object.
        """

    @abstractmethod
    def aim(self, goal: Aim) -> None:
        """Choose where the object should be; the motion takes its time."""


class HandCamera(Camera):
    """A camera that shows a virtual sensor in real time while a hand moves an object on it."""

    @property
    @abstractmethod
    def hand(self) -> Hand:
        """The hand that moves the object.

        Raises
        ------
        InputError
            The camera is closed.
        """
