"""A tactile sensor behind LeRobot's interface of cameras."""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np
from lerobot.cameras.camera import Camera
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError
from numpy.typing import NDArray

from lerobot_camera_tactile.configuration import TactileCameraConfig
from lerobot_camera_tactile.sensor_link import Observation, SensorLink, age_s, ask

_READ_S = 10.0  # Longest wait of read, as of LeRobot's own cameras
_FIND_S = 60.0  # Longest search for cameras, which may be on the network


class TactileCamera(Camera):
    """A tactile sensor as a camera: images in RGB, heights as depth, force, slip and contact.

    Image, heights and numbers that are read one after the other belong to one observation: the
    image chooses it. Only one thread reads.

    Parameters
    ----------
    config : TactileCameraConfig

    Attributes
    ----------
    width, height, fps : int
        Of the images; unless configured, those of the profile.
    use_depth : bool
        Whether there are heights; LeRobot's robots ask for it.
    number_names : tuple of str
        Names of the numbers that each observation has.

    Raises
    ------
    ValueError
        The profile cannot be used, has no heights where ``use_depth`` asks for them, or is of
        another size than configured.
    """

    def __init__(self, config: TactileCameraConfig) -> None:
        super().__init__(config)
        self.config = config
        self.use_depth = config.use_depth
        self._link: SensorLink | None = None
        self._chosen: Observation | None = None
        self._depth_is_due = False
        found = ask(config.python, "describe", config.sensor_options(), timeout_s=config.opening_s)
        if config.use_depth and found["no_depth"]:
            raise ValueError(f"use_depth: {found['no_depth']}")
        size = found["width_px"], found["height_px"]
        asked = config.width or size[0], config.height or size[1]
        if asked != size:
            raise ValueError(
                f"the images of {found['name']} are {size[0]} × {size[1]} pixels, not "
                f"{asked[0]} × {asked[1]}; leave width and height out"
            )
        self.width, self.height = size
        self.fps = config.fps or round(found["fps"])
        self.number_names: tuple[str, ...] = tuple(found["numbers"])

    def __str__(self) -> str:
        return f"TactileCamera({self.config.profile})"

    @property
    def is_connected(self) -> bool:
        """Whether the sensor's process runs."""
        return self._link is not None and not self._link.failure

    @staticmethod
    def find_cameras(python: str = sys.executable) -> list[dict[str, Any]]:
        """Return the connected cameras that a profile fits: type, id, name and profiles.

        Parameters
        ----------
        python : str
            Interpreter that has tactile-core.
        """
        return list(ask(python, "find", timeout_s=_FIND_S)["cameras"])

    def connect(self, warmup: bool = True) -> None:
        """Open the sensor in a process of its own.

        Parameters
        ----------
        warmup : bool
            Wait for the first observation, and then for the configured time.

        Raises
        ------
        DeviceAlreadyConnectedError
        ConnectionError
            The sensor cannot be opened, or sends nothing; no process is left.
        """
        if self.is_connected:
            raise DeviceAlreadyConnectedError(f"{self} is already connected")
        self.disconnect()
        options = self.config.sensor_options() | {"fps": self.config.fps}
        assert self.height is not None
        assert self.width is not None
        self._link = SensorLink(self.config.python, options, self.height, self.width)
        try:
            self._link.wait_until_open(self.config.opening_s)
            if warmup:
                self._warm_up(self._link)
        except BaseException:
            self.disconnect()
            raise

    def _warm_up(self, link: SensorLink) -> None:
        if link.wait_newer(0, self.config.opening_s) is None:
            raise ConnectionError(
                link.failure
                or f"{self} sent no image within {self.config.opening_s:g} s; is its camera free?"
            )
        time.sleep(self.config.warmup_s)

    def read(self) -> NDArray[Any]:
        """Wait for the next image.

        Returns
        -------
        (H, W, 3) uint8
            R, G, B.

        Raises
        ------
        DeviceNotConnectedError
            The camera is not connected, or the sensor's process has ended; the sentence says why.
        TimeoutError
            No image arrived within 10 s.
        """
        newest = self._running().newest
        return self._next(0 if newest is None else newest.number, _READ_S)

    def async_read(self, timeout_ms: float = 200) -> NDArray[Any]:
        """Return the newest image that was not read yet, (H, W, 3) uint8; wait if there is none.

        Raises
        ------
        DeviceNotConnectedError
            As of :meth:`read`.
        TimeoutError
            None arrived within the time.
        """
        return self._next(0 if self._chosen is None else self._chosen.number, timeout_ms / 1000)

    def read_latest(self, max_age_ms: int = 500) -> NDArray[Any]:
        """Return the newest image at once, (H, W, 3) uint8.

        Raises
        ------
        DeviceNotConnectedError
            As of :meth:`read`.
        TimeoutError
            It is older.
        RuntimeError
            There is none yet.
        """
        return self._choose(self._latest(max_age_ms))

    def read_latest_depth(self, max_age_ms: int = 500) -> NDArray[np.float32]:
        """Return heights at once, in metres because LeRobot takes floating point for metres.

        They belong to the image that was read last, or, if its heights were read already, to the
        newest observation.

        Returns
        -------
        (H, W, 1) float32
            Height above the undeformed gel in m, positive where the gel is indented.

        Raises
        ------
        DeviceNotConnectedError, TimeoutError
            As of :meth:`read_latest`.
        RuntimeError
            Not configured with ``use_depth``, or there is no observation yet, or no height in it.
        """
        if not self.use_depth:
            raise RuntimeError(f"{self} gives no heights; configure it with use_depth=True")
        if not self._depth_is_due:
            self._choose(self._latest(max_age_ms))
        chosen = self._checked(self._chosen, max_age_ms)
        self._depth_is_due = False
        if chosen.height_mm is None:
            raise RuntimeError(f"{self} measured no height in this frame; 'tactile run' says why")
        return (chosen.height_mm * np.float32(1e-3))[..., None]

    @property
    def observation(self) -> Observation:
        """The observation whose image or heights were read last, or else the newest.

        Raises
        ------
        DeviceNotConnectedError, TimeoutError, RuntimeError
            As of :meth:`read_latest`.
        """
        return self._latest(500) if self._chosen is None else self._chosen

    def disconnect(self) -> None:
        """End the sensor's process; may be called twice."""
        link, self._link = self._link, None
        self._chosen, self._depth_is_due = None, False
        if link is not None:
            link.stop()

    def _running(self) -> SensorLink:
        if self._link is None:
            raise DeviceNotConnectedError(f"{self} is not connected; call connect() first")
        if self._link.failure:
            raise DeviceNotConnectedError(f"{self}: {self._link.failure}")
        return self._link

    def _next(self, number: int, timeout_s: float) -> NDArray[Any]:
        found = self._running().wait_newer(number, timeout_s)
        if found is None:
            self._running()  # its sentence, if the process has ended
            raise TimeoutError(
                f"{self} sent no new image within {timeout_s * 1000:g} ms; wait longer, or read at "
                f"a lower rate"
            )
        return self._choose(found)

    def _latest(self, max_age_ms: int) -> Observation:
        return self._checked(self._running().newest, max_age_ms)

    def _checked(self, found: Observation | None, max_age_ms: int) -> Observation:
        self._running()
        if found is None:
            raise RuntimeError(f"{self} has sent no image yet; connect it with warmup")
        age_ms = 1000 * age_s(found)
        if age_ms > max_age_ms:
            raise TimeoutError(
                f"the newest image of {self} is {age_ms:.0f} ms old, more than max_age_ms = "
                f"{max_age_ms:g}; allow older ones, or check that the sensor keeps up"
            )
        return found

    def _choose(self, found: Observation) -> NDArray[Any]:
        self._chosen, self._depth_is_due = found, True
        return found.rgb
