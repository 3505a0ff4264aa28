"""Opens and closes camera and lights together."""

from __future__ import annotations

from tactile_core.acquisition.acquisition import CAMERA, DRIVER, Acquisition
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.plugins.blame import blame


class OpenDevices:
    """The devices of a sensor, in the order in which they depend on each other.

    Parameters
    ----------
    camera : Camera
    driver : LightDriver or None
    acquisition : Acquisition
        Armed when both are open.
    """

    def __init__(
        self, camera: Camera, driver: LightDriver | None, acquisition: Acquisition
    ) -> None:
        self._camera, self._driver, self._acquisition = camera, driver, acquisition

    def open(self) -> None:
        """Open the lights, then the camera; after an error, :meth:`close` them.

        Raises
        ------
        DeviceError
            One of them cannot be opened.
        """
        if self._driver is not None:
            with blame(DRIVER, self._driver):
                self._driver.attach(self._camera)
                self._driver.open()
        with blame(CAMERA, self._camera):
            self._camera.open()
        if self._driver is not None and self._driver.watchdog_s is None:
            self._darken()  # a program that was killed may have left the lights on
        self._acquisition.arm()

    def close(self) -> None:
        """Switch the lights off and close both, even if one of them fails."""
        # not an ExitStack: it never returns if a device raises the same error object repeatedly
        try:
            self._darken()
        finally:
            try:
                with blame(CAMERA, self._camera):
                    self._camera.close()
            finally:
                if self._driver is not None:
                    with blame(DRIVER, self._driver):
                        self._driver.close()

    def _darken(self) -> None:
        # lights that are driven through the camera work only while the camera is open
        if self._driver is not None and self._driver.is_open:
            with blame(DRIVER, self._driver):
                self._driver.set({})
