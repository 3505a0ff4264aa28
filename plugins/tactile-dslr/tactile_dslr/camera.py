"""``dslr.camera``: a single-lens reflex or mirrorless camera, through gphoto2."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Mapping
from fractions import Fraction
from threading import Event
from typing import Any, ClassVar

from pydantic import BaseModel, Field, PositiveFloat, PositiveInt

from tactile_core.errors import (
    CameraLost,
    CameraTimeout,
    DeviceAbsent,
    DeviceError,
    LibraryMissing,
)
from tactile_core.interfaces.camera import Trigger
from tactile_core.interfaces.device import ConnectedDevice, Options
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.streaming.encoded_image import EncodedImage, encoded_image
from tactile_core.interfaces.streaming.streaming_camera import ImageSource, StreamingCamera
from tactile_core.quantities import Image

# Names of the settings in gphoto2; they differ between makers.
_WIDGETS = {
    "exposure_time_s": ("shutterspeed", "shutterspeed2"),
    "aperture": ("f-number", "aperture"),
    "iso": ("iso",),
}


class DslrOptions(Options):
    """Options of ``dslr.camera``."""

    model: str | None = Field(default=None, description="Part of the model's name.")
    exposure_time_s: PositiveFloat | None = Field(
        default=None, description="One of the camera's exposure times; set its wheel to M."
    )
    aperture: PositiveFloat | None = Field(default=None, description="F-number.")
    iso: PositiveInt | None = Field(default=None, description="Sensitivity.")


class DslrCamera(StreamingCamera):
    """Takes one photo for each read, as a JPEG, without storing it on the card if possible.

    Timestamps are those of the request plus half of the exposure; the shutter's delay comes on top.
    A photo takes a second or more, so give ``open_sensor`` a longer ``timeout_s``.
    """

    Options: ClassVar[type[BaseModel]] = DslrOptions
    selectors: ClassVar[Mapping[str, str]] = {"model": "product"}

    @classmethod
    def connected(cls) -> Iterator[ConnectedDevice]:
        """Yield the cameras that gphoto2 finds; two of one model cannot be distinguished."""
        for model, port in _detect_cameras(library()):
            yield ConnectedDevice(port, model)

    def __init__(self, options: DslrOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._source: DslrSource | None = None
        self._port = ""

    @property
    def device_id(self) -> str:
        """Model and port; empty before the camera is found."""
        return self._port

    def _connect(self) -> ImageSource:
        gphoto = library()
        self._port = ""
        self._port = self._find_camera(gphoto)
        self._refuse_a_second()
        camera = gphoto.Camera()
        try:
            camera.init()
        except gphoto.GPhoto2Error as error:
            raise DeviceError(
                f"{self._name} cannot be opened: {error.string}; switch it on, and close file "
                f"managers and other programs that use it"
            ) from error
        try:
            self._configure(camera, gphoto)
            self._source = DslrSource(camera, self._name, self._settings.exposure_time_s)
        except BaseException:
            camera.exit()
            raise
        return self._source

    def _close(self) -> None:
        self._source = None
        super()._close()

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        super()._arm(exposures)
        return Trigger.SOFTWARE

    def _read(self, timeout_s: float) -> Image | None:
        if self._source is None:
            return super()._read(timeout_s)
        return self._read_triggered(self._source.request, timeout_s)

    def _latest(self, max_age_s: float) -> Image | None:
        return self._read(max_age_s)

    def _find_camera(self, gphoto: Any) -> str:
        listed = [f"{model} at {port}" for model, port in _detect_cameras(gphoto)]
        wanted = self._settings.model or ""
        if not any(wanted.casefold() in one.casefold() for one in listed):
            raise DeviceAbsent(
                f"no camera{f' of the model {wanted}' if wanted else ''} is connected; found "
                f"{', '.join(listed) or 'none'}; switch it on and check its cable"
            )
        if len(listed) > 1:
            raise DeviceAbsent(
                f"{len(listed)} cameras are connected: {', '.join(listed)}; disconnect all but one"
            )
        return listed[0]

    def _configure(self, camera: Any, gphoto: Any) -> None:
        config = camera.get_config()
        for option, names in _WIDGETS.items():
            wanted = getattr(self._settings, option)
            if wanted is None:
                continue
            widget = _widget(config, names, gphoto)
            if widget is None:
                raise DeviceError(
                    f"{self._name} has no setting for {option}; remove 'camera.{option}'"
                )
            choices = [str(widget.get_choice(index)) for index in range(widget.count_choices())]
            chosen = nearest(choices, wanted)
            if chosen is None:
                raise DeviceError(
                    f"{self._name} has no {option} of {wanted:g}, only {', '.join(choices)}; "
                    f"correct 'camera.{option}', and set the camera's wheel to M"
                )
            widget.set_value(chosen)
        target = _widget(config, ("capturetarget",), gphoto)
        if target is not None:
            target.set_value(target.get_choice(0))  # its memory, not the card
        camera.set_config(config)


class DslrSource(ImageSource):
    """An open camera that takes a photo when one is requested."""

    def __init__(self, camera: Any, name: str, exposure_time_s: float | None) -> None:
        self._camera, self._name, self._exposure_time_s = camera, name, exposure_time_s
        self._requested = Event()

    def request(self) -> None:
        """Ask for one photo."""
        self._requested.set()

    def interrupt(self) -> None:
        """Let the reader's thread end after the photo that it takes."""
        self._requested.set()

    def grab(self) -> EncodedImage:
        """Take a photo once it is requested."""
        if not self._requested.wait(0.1):  # [s] then it looks whether to end
            raise CameraTimeout(f"{self._name} waits for a request")
        self._requested.clear()
        gphoto = library()
        began_s = time.monotonic()
        try:
            place = self._camera.capture(gphoto.GP_CAPTURE_IMAGE)
            file = self._camera.file_get(place.folder, place.name, gphoto.GP_FILE_TYPE_NORMAL)
            data = bytes(file.get_data_and_size())
        except gphoto.GPhoto2Error as error:
            raise CameraLost(
                f"{self._name} took no photo: {error.string}; check that it is on, has power and "
                f"focuses by hand, and open it again"
            ) from error
        return encoded_image(
            data,
            began_s + (self._exposure_time_s or 0.0) / 2,
            self._name,
            exposure_time_s=self._exposure_time_s,
        )

    def close(self) -> None:
        """Release the camera."""
        self._camera.exit()


def nearest(choices: list[str], wanted: float) -> str | None:
    """Return the choice of a camera's setting whose number is the wanted one; None without any.

    Parameters
    ----------
    choices : list of str
        For example ``1/125``, ``0.0080s``, ``f/2.8`` or ``100``.
    """
    numbers = {choice: _number(choice) for choice in choices}
    close = {
        choice: abs(number / wanted - 1) for choice, number in numbers.items() if number is not None
    }
    best = min(close, key=lambda choice: close[choice], default=None)
    # [ratio] choices that a camera rounds are this close
    return best if best is not None and close[best] <= 0.02 else None


def _number(choice: str) -> float | None:
    found = re.fullmatch(r"(?:f/)?(\d+(?:\.\d+)?)(?:/(\d+))?\s*s?", choice.strip(), re.IGNORECASE)
    if found is None or found[2] == "0":
        return None
    return float(Fraction(found[1]) / int(found[2] or 1))


def _widget(config: Any, names: tuple[str, ...], gphoto: Any) -> Any:
    """Return the first of some settings that the camera has."""
    for name in names:
        try:
            return config.get_child_by_name(name)
        except gphoto.GPhoto2Error:
            continue
    return None


def library() -> Any:
    """Return the gphoto2 module.

    Raises
    ------
    DeviceError
        It is not installed.
    """
    try:
        import gphoto2
    except ImportError as error:
        raise LibraryMissing(
            "dslr.camera needs gphoto2; 'pip install gphoto2' on Linux or macOS"
        ) from error
    return gphoto2


def _detect_cameras(gphoto: Any) -> list[tuple[str, str]]:
    """Return model and port of each camera that is switched on."""
    found = gphoto.Camera.autodetect()
    return [(found.get_name(index), found.get_value(index)) for index in range(found.count())]
