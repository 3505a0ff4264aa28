"""``genicam.camera``: a machine-vision camera (GigE Vision or USB3 Vision) through Aravis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, Field, NonNegativeFloat, PositiveFloat

from tactile_core.errors import DeviceAbsent, DeviceError
from tactile_core.interfaces.camera import Trigger
from tactile_core.interfaces.device import ConnectedDevice, Options
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.streaming.streaming_camera import ImageSource, StreamingCamera
from tactile_core.interfaces.usb_bus import CLAIM, INSTEAD, USB3_VISION, usb_cameras
from tactile_core.quantities import Image
from tactile_genicam.image_source import (
    PIXEL_FORMATS,
    GenicamSource,
    library,
    library_error,
)


class GenicamOptions(Options):
    """Options of ``genicam.camera``."""

    serial: str | None = Field(default=None, description="Serial number of the camera.")
    address: str | None = Field(
        default=None, description="Network address, for a camera that is not found by itself."
    )
    trigger: Literal["none", "software", "line"] = Field(
        default="none",
        description="What begins an exposure: the camera itself, each read, or the camera's input "
        "'line', which a light box switches.",
    )
    line: str = Field(default="Line1", description="Input of the camera for 'trigger: line'.")
    pixel_format: Literal[tuple(PIXEL_FORMATS)] = Field(  # type: ignore[valid-type]
        default="Mono8", description="Name of the format in the GenICam standard."
    )
    region: tuple[int, int, int, int] | None = Field(
        default=None, description="Part of the image sensor: x, y, width, height in its pixels."
    )
    fps: PositiveFloat | None = Field(default=None, description="Images a second.")
    exposure_time_s: PositiveFloat | None = Field(default=None, description="Exposure time.")
    gain: NonNegativeFloat | None = Field(default=None, description="In the camera's own units.")


class GenicamCamera(StreamingCamera):
    """A camera that follows the GenICam standard.

    With ``trigger: software`` each read begins one exposure, so that it shows the lights that are
    on; exposure time and gain may differ between the exposures of an observation. Timestamps are
    times of arrival less half of the exposure.
    """

    Options: ClassVar[type[BaseModel]] = GenicamOptions
    selectors: ClassVar[Mapping[str, str]] = {"serial": "serial", "address": "place"}

    @classmethod
    def connected(cls) -> Iterator[ConnectedDevice]:
        """Yield the cameras that Aravis finds within a second, then others of USB3 Vision."""
        missing, serials = None, set()
        try:
            aravis = library()
        except DeviceError as error:
            missing = error
        else:
            aravis.update_device_list()
            for index in range(aravis.get_n_devices()):
                serial = aravis.get_device_serial_nbr(index)
                serials.add(serial)
                maker, model = aravis.get_device_vendor(index), aravis.get_device_model(index)
                yield ConnectedDevice(
                    aravis.get_device_address(index), f"{maker} {model}", serial=serial or None
                )
        for other in usb_cameras(USB3_VISION):
            if other.serial not in serials:
                yield other
        if missing is not None:
            raise missing

    def __init__(self, options: GenicamOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._camera: Any = None
        self._source: GenicamSource | None = None
        self._serial = ""
        self._exposures: tuple[Exposure, ...] = ()
        self._next = 0

    @property
    def device_id(self) -> str:
        """The serial number; empty before the camera is found."""
        return self._serial

    def _connect(self) -> ImageSource:
        aravis = library()
        options = self._settings
        self._serial = ""
        address = options.address or self._find_camera(aravis)
        try:
            camera = aravis.Camera.new(address)
            serial = camera.get_device_serial_number()
            if options.serial not in (None, serial):
                raise DeviceAbsent(
                    f"the camera at {address} has the serial {serial}, not {options.serial}; "
                    f"correct 'camera.serial' or 'camera.address'"
                )
            self._serial = serial
            self._refuse_a_second()
            self._configure(camera)
            source = GenicamSource(camera, self._name, options.pixel_format)
            source.exposure_time_s = camera.get_exposure_time() / 1e6
            source.gain = camera.get_gain() if camera.is_gain_available() else None
        except library_error() as error:
            raise DeviceError(
                f"the camera {options.serial or address} cannot be opened: {error.message}; check "
                f"that no other program uses it, its cable and its power"
            ) from error
        self._camera, self._source = camera, source
        return source

    def _close(self) -> None:
        self._camera = self._source = None
        super()._close()

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        if self._settings.trigger == "software":
            self._exposures, self._next = exposures, 0
            return Trigger.SOFTWARE
        trigger = super()._arm(exposures)
        several = len(exposures) > 1
        return Trigger.CAMERA if several and self._settings.trigger == "line" else trigger

    def _read(self, timeout_s: float) -> Image | None:
        source = self._source
        if self._settings.trigger != "software" or source is None:
            return super()._read(timeout_s)
        index = self._next % max(1, len(self._exposures))
        if self._exposures:
            self._expose_as(self._exposures[index], source)
        image = self._read_triggered(source.trigger, timeout_s)
        self._next += 1
        return image

    def _latest(self, max_age_s: float) -> Image | None:
        if self._settings.trigger == "software":
            return self._read(max_age_s)
        return super()._latest(max_age_s)

    def _expose_as(self, exposure: Exposure, source: GenicamSource) -> None:
        """Change exposure time and gain, unless they are set already."""
        time_s = exposure.exposure_time_s or self._settings.exposure_time_s
        if time_s is not None and time_s != source.exposure_time_s:
            self._set("exposure_time_s", time_s, self._camera, 1e6)
            source.exposure_time_s = time_s
        gain = self._settings.gain if exposure.gain is None else exposure.gain
        if gain is not None and gain != source.gain:
            self._set("gain", gain, self._camera)
            source.gain = gain

    def _find_camera(self, aravis: Any) -> str:
        """Return the id of the one connected camera that the options describe."""
        wanted = self._settings.serial
        aravis.update_device_list()
        found = {
            aravis.get_device_id(index): aravis.get_device_serial_nbr(index)
            for index in range(aravis.get_n_devices())
        }
        matching = [device for device, serial in found.items() if wanted in (None, serial)]
        listed = ", ".join(f"{device} (serial {serial})" for device, serial in found.items())
        if not matching:
            raise DeviceAbsent(
                f"no GenICam camera{f' of serial {wanted}' if wanted else ''} is connected; found "
                f"{listed or 'none'}; check cable and power, write its 'address' in 'camera', "
                f"{INSTEAD}"
            )
        if len(matching) > 1:
            raise DeviceAbsent(
                f"{len(matching)} cameras are connected: {listed}; write 'serial' in 'camera' to "
                f"choose one, or {CLAIM}"
            )
        return str(matching[0])

    def _configure(self, camera: Any) -> None:
        options = self._settings
        if options.region is not None:
            camera.set_region(*options.region)
            if tuple(camera.get_region()) != options.region:
                raise DeviceError(
                    f"{self._name} chose the region {list(camera.get_region())} instead of "
                    f"{list(options.region)}; correct 'camera.region'"
                )
        formats = list(camera.dup_available_pixel_formats_as_strings())
        if options.pixel_format not in formats:
            raise DeviceError(
                f"{self._name} has no {options.pixel_format}, only {', '.join(formats)}; correct "
                f"'camera.pixel_format'"
            )
        camera.set_pixel_format_from_string(options.pixel_format)
        camera.clear_triggers()
        if options.fps is not None:
            self._set("fps", options.fps, camera)
        if options.exposure_time_s is not None:
            self._set("exposure_time_s", options.exposure_time_s, camera, 1e6)
        if options.gain is not None:
            self._set("gain", options.gain, camera)
        if options.trigger != "none":
            camera.set_trigger("Software" if options.trigger == "software" else options.line)

    def _set(self, option: str, wanted: float, camera: Any, unit: float = 1.0) -> None:
        """Set one setting and read it back."""
        name = {"fps": "frame_rate", "exposure_time_s": "exposure_time", "gain": "gain"}[option]
        lowest, highest = getattr(camera, f"get_{name}_bounds")()
        if lowest <= wanted * unit <= highest:
            getattr(camera, f"set_{name}")(wanted * unit)
            got = getattr(camera, f"get_{name}")()
            # [ratio] cameras choose in steps
            if abs(got - wanted * unit) <= 0.02 * max(abs(got), 1.0):
                return
        raise DeviceError(
            f"{self._name} does not take {option}: {wanted:g}; it takes {lowest / unit:g} to "
            f"{highest / unit:g}, so correct 'camera.{option}'"
        )
