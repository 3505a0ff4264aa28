"""Opens a sensor by its profile's name and reads quantities from it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

from tactile_core.acquisition.acquisition import CAMERA, DRIVER, Acquisition, average
from tactile_core.bundles.bundle import Bundle, check_serial, default_place
from tactile_core.errors import CameraLost, InputError
from tactile_core.interfaces.camera import Drop
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.live_check import LiveCheck
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import (
    make_devices,
    played_back,
    read_reference,
)
from tactile_core.plugins.blame import blame
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Quantity, Reference

_MANY_FRAMES = 250
"""Frames after which compiled loops have saved the time that loading them takes."""

TIMEOUT_S = 1.0
"""Default timeout of each exposure, s."""

FIRST = "first"
"""Value of ``reference``: use the first frame and mark every reading as relative."""


def open_sensor(
    profile: Profile | str | Path,
    *,
    serial: str | None = None,
    bundle: Bundle | Path | str | None = None,
    input: Path | str | None = None,
    reference: Reference | Path | str | None = None,
    sim: bool = False,
    script: Path | str | None = None,
    timeout_s: float = TIMEOUT_S,
) -> Sensor:
    """Make a sensor from its profile and open it.

    Parameters
    ----------
    profile : Profile, str or Path
        Name of a shipped profile or of a plugin's profile, or the path of a YAML file.
    serial : str, optional
        Serial number of the unit; selects its bundle and refuses that of another unit.
    bundle : Bundle or path, optional
        The calibration. Default: the bundle in the user's data directory, if there is one.
    input : path, optional
        A recording to measure instead of the profile's camera.
    reference : Reference, path or "first", optional
        The undeformed sensor. Default: the bundle's reference. ``"first"`` uses the first frame
        and marks every reading as relative.
    sim : bool
        Open the virtual sensor: apply the profile's ``sim`` overlay.
    script : path, optional
        Script of the virtual sensor: YAML as for ``tactile simulate``. Default: the script that
        the overlay names, else a ball that presses and withdraws repeatedly.
    timeout_s : float
        Longest wait for each exposure; increase it for a slow camera.

    Returns
    -------
    Sensor
        Open; use it in a ``with`` block.

    Raises
    ------
    ProfileError, PluginError, CalibrationError, InputError
        An argument is unusable; the message says what to do.
    DeviceError
        A device cannot be opened; nothing is left open.
    """
    resolved = profile if isinstance(profile, Profile) else _loaded(profile, sim, script)
    if serial is not None:
        check_serial(serial)
    if bundle is None:
        place = default_place(resolved, serial)
        bundle = Bundle.load(place) if place.is_dir() else None
    elif not isinstance(bundle, Bundle):
        bundle = Bundle.load(Path(bundle))
    return Sensor(
        resolved, bundle, reference, serial=serial, input=input, timeout_s=timeout_s
    ).open()


def _loaded(profile: str | Path, sim: bool, script: Path | str | None) -> Profile:
    if script is None:
        return load_profile(profile, sim=sim)
    if not sim:
        raise InputError(f"the script {script} controls the virtual sensor; add --sim")
    return load_profile(profile, sim=True, overrides={"camera": {"script": str(script)}})


class Sensor:
    """A sensor's acquisition and its :class:`~tactile_core.pipeline.pipeline.Pipeline`."""

    def __init__(
        self,
        profile: Profile,
        bundle: Bundle | None = None,
        reference: Reference | Path | str | None = None,
        *,
        serial: str | None = None,
        input: Path | str | None = None,
        timeout_s: float = TIMEOUT_S,
    ) -> None:
        if not 0 < timeout_s < float("inf"):
            raise InputError(f"a timeout of {timeout_s:g} s? give a positive number of seconds")
        self.notes: tuple[str, ...] = ()
        self._timeout_s = timeout_s
        count: int | None = None
        if input is not None:
            profile, self.notes, count = played_back(profile, Path(input))
        self.profile = profile
        self._serial = serial
        self._bundle = bundle
        self._given_reference = reference
        # loading compiled loops takes as long as they save over this many frames
        self._compiled = False if count is not None and count < _MANY_FRAMES else None
        self._camera, illumination, self._driver = make_devices(profile)
        self._acquisition = Acquisition(self._camera, illumination, profile.image, self._driver)
        self._check = LiveCheck(self._acquisition)
        self._pipeline: Pipeline | None = None
        self._pending: list[Frame] = []

    @property
    def pipeline(self) -> Pipeline:
        """The pipeline that computes readings from this sensor's frames; picklable."""
        if self._pipeline is None:
            raise InputError("the sensor is closed; open it with 'with open_sensor(…) as sensor:'")
        return self._pipeline

    def open(self) -> Self:
        """Open the lights and the camera; if that fails, nothing stays open."""
        try:
            if self._driver is not None:
                with blame(DRIVER, self._driver):
                    self._driver.attach(self._camera)
                    self._driver.open()
            with blame(CAMERA, self._camera):
                self._camera.open()
                self.notes += tuple(self._camera.notes)
            self._acquisition.arm()
            reference = self._reference()
            self._pipeline = Pipeline(
                self.profile,
                self._bundle,
                reference,
                serial=self._serial,
                compiled=self._compiled,
            )
            self.notes += self._pipeline.notes
        except BaseException as error:
            try:
                self.close()
            except Exception as second:  # it must not hide why opening failed
                error.add_note(f"closing failed as well: {second}")
            raise
        return self

    def close(self) -> None:
        """Switch the lights off and close camera and driver, even if one of them fails.

        May be called twice.
        """
        # not an ExitStack: it never returns if a device raises the same error object repeatedly
        try:
            if self._pipeline is not None:
                self._pipeline.close()
        finally:
            try:
                self._darken()
            finally:
                try:
                    self._close_camera()
                finally:
                    self._close_driver()

    def _close_camera(self) -> None:
        with blame(CAMERA, self._camera):
            self._camera.close()

    def _darken(self) -> None:
        # lights that are driven through the camera work only while the camera is open
        if self._driver is not None and self._driver.is_open:
            with blame(DRIVER, self._driver):
                self._driver.set({})

    def _close_driver(self) -> None:
        if self._driver is not None:
            with blame(DRIVER, self._driver):
                self._driver.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except Exception as second:
            if error is None:
                raise
            error.add_note(f"closing failed as well: {second}")

    def read(self, timeout_s: float | None = None) -> Reading:
        """Acquire one observation and measure it.

        Parameters
        ----------
        timeout_s : float, optional
            Longest wait for each exposure. Default: that of the sensor.

        Raises
        ------
        CameraTimeout
            No observation within ``timeout_s`` per exposure.
        CameraLost
            The camera was disconnected, or the recording has ended.
        SequenceError
            Several observations in succession show the wrong lights. A single one is dropped, and
            the next reading has a warning.
        """
        frame = self._next(timeout_s)
        if frame is None:
            raise CameraLost("the recording has ended")
        return self._check.noted(self.pipeline.process(frame))

    def stream(
        self,
        timeout_s: float | None = None,
        *,
        drop: Drop | None = None,
        tare_frame: int | None = None,
        workers: int = 1,
        inputs: Callable[[Frame], Iterable[Quantity]] | None = None,
    ) -> Iterator[Reading]:
        """Yield readings until the recording ends; a live camera never ends.

        Parameters
        ----------
        timeout_s : float, optional
            Longest wait for each exposure. Default: that of the sensor.
        drop : {"oldest", "never"}, optional
            What happens to a live camera's images that arrive while earlier ones are measured; see
            :meth:`Camera.set_drop <tactile_core.interfaces.camera.Camera.set_drop>`. Default: that
            of the camera.
        tare_frame : int, optional
            Sequence number of the frame whose load is subtracted from then on.
        workers : int
            Number of processes; see :meth:`Pipeline.map
            <tactile_core.pipeline.pipeline.Pipeline.map>`.
        inputs : callable, optional
            Returns the external inputs of a frame, such as
            :class:`~tactile_core.recordings.saved_inputs.SavedInputs`.

        Raises
        ------
        InputError
            There are several workers together with a tare, external inputs or a step that depends
            on earlier frames.
        """
        if drop not in (None, "oldest", "never"):
            raise InputError(f"drop={drop!r}? choose 'oldest' or 'never'")
        with blame(CAMERA, self._camera):
            self._camera.set_drop(drop)
        if workers > 1:
            if tare_frame is not None:
                raise InputError("a tare needs the frames in order; use one worker")
            if inputs is not None:
                raise InputError("external inputs need the frames in order; use one worker")
            frames = iter(partial(self._next, timeout_s), None)
            yield from map(self._check.noted, self.pipeline.map(frames, workers=workers))
            return
        while (frame := self._next(timeout_s)) is not None:
            given = () if inputs is None else inputs(frame)
            reading = self.pipeline.process(frame, *given, tare=frame.sequence == tare_frame)
            yield self._check.noted(reading)

    def tare(self) -> None:
        """Subtract the load of the next reading from it and from all later ones."""
        self.pipeline.tare()

    def capture_reference(self, frames: int = 10) -> Reference:
        """Use the mean of the next ``frames`` observations as the new reference.

        Nothing may touch the gel during this time.
        """
        taken = [frame for frame in (self._next() for _ in range(frames)) if frame is not None]
        reference = average(taken)
        self._pipeline = self.pipeline.with_reference(reference)
        return self._pipeline.reference or reference

    def _next(self, timeout_s: float | None = None) -> Frame | None:
        if self._pending:
            return self._pending.pop(0)
        timeout_s = self._timeout_s if timeout_s is None else timeout_s
        if self._pipeline is None or not self._camera.live:
            return self._acquisition.observe(timeout_s)
        return self._check.observe(self._pipeline.conditioning.verify, timeout_s)

    def _reference(self) -> Reference | None:
        given = self._given_reference
        if given is None or isinstance(given, Reference):
            return given
        if str(given) != FIRST:
            return read_reference(self.profile, Path(given))
        first = self._acquisition.observe(self._timeout_s)
        if first is None:
            raise InputError("the input has no frame to use as reference")
        self._pending.append(first)
        reference = average([first])
        return Reference(**{**vars(reference), "relative": True})
