"""Opens sensors, one or several together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from tactile_core.bundles.bundle import Bundle
from tactile_core.bundles.places import check_serial, find_place
from tactile_core.errors import InputError, TactileError
from tactile_core.interfaces.device import Closing
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.initial_reference import MEDIAN, is_word
from tactile_core.pipeline.sensor import TIMEOUT_S, Sensor
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference


def open_sensor(
    profile: Profile | str | Path,
    *,
    serial: str | None = None,
    gel: str | None = None,
    bundle: Bundle | Path | str | None = None,
    input: Path | str | None = None,
    reference: Reference | Path | str | None = None,
    sim: bool = False,
    script: Path | str | None = None,
    timeout_s: float = TIMEOUT_S,
    reconnect_s: float = 0.0,
) -> Sensor:
    """Make a sensor from its profile and open it.

    Parameters
    ----------
    profile : Profile, str or Path
        Name of a shipped profile or of a plugin's profile, or the path of a YAML file.
    serial : str, optional
        Serial number of the unit; selects its bundle and refuses that of another unit. A live
        sensor opens the camera and the light box that the unit has claimed
        (:func:`~tactile_core.acquisition.unit_devices.claim_device`), else the camera with this
        serial number.
    gel : str, optional
        Name of the gel on the unit; selects the bundle made with it and refuses any other.
    bundle : Bundle or path, optional
        The calibration. Default: the bundle in the user's data directory, if there is one, else
        the starting calibration of the profile, which measures coarsely.
    input : path, optional
        A recording to measure instead of the profile's camera.
    reference : Reference, path, "first" or "median", optional
        The undeformed sensor. Default: the bundle's reference. ``"first"`` uses the first frame
        and marks every reading as relative, ``"median"`` the median of the recording.
    sim : bool
        Open the virtual sensor: apply the profile's ``sim`` overlay.
    script : path, optional
        Script of the virtual sensor: YAML as for ``tactile simulate``. Default: the script that
        the overlay names, else a ball that presses and withdraws repeatedly.
    timeout_s : float
        Longest wait for each exposure; increase it for a slow camera.
    reconnect_s : float
        How long to try to open a live camera or light box again after it was unplugged. The first
        reading after that warns of the gap. Default: the loss is an error at once.

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
    # what a live sensor does not need is imported with a recording only
    session = None
    if input is not None:
        from tactile_core.pipeline.playback import check_unit, recorded_session

        session = recorded_session(Path(input))
        if session is not None:
            check_unit(session, serial, Path(input))
    if session is not None:
        serial, sim = serial or session.serial, sim or session.sim
    resolved = (
        profile
        if isinstance(profile, Profile)
        else _load_profile(profile, sim, script, replayed=input is not None)
    )
    if serial is not None:
        check_serial(serial)
        if input is None:
            from tactile_core.acquisition.unit_devices import with_unit_devices

            resolved = with_unit_devices(resolved, serial)
    if gel is not None:
        check_serial(gel, "gel")
    recorded = None
    if bundle is None and session is not None:
        from tactile_core.recordings.session_files import bundle_of

        bundle = recorded = bundle_of(session, Path(input or ""))
    if bundle is None or (bundle is recorded and recorded.manifest.starting):
        place = find_place(resolved, serial, gel)
        measured = place is not None and place != resolved.starting_bundle
        if place is not None and (bundle is None or measured):  # the unit was calibrated since
            bundle = Bundle.load(place)
    elif not isinstance(bundle, Bundle):
        bundle = Bundle.load(Path(bundle))
    if gel is not None and bundle is not None:
        bundle.check_gel(gel)
    first = session is not None and session.reference is not None and session.reference.relative
    if first and reference is None and bundle is not None and bundle is not recorded:
        reference = bundle.reference  # better than the first image of the recording
    note = ""
    if input is not None and is_word(reference, MEDIAN):
        from tactile_core.acquisition.median import median_reference
        from tactile_core.pipeline.playback import read_frames

        reference, note = median_reference(read_frames(resolved, Path(input)))
    sensor = Sensor(
        resolved,
        bundle,
        reference,
        serial=serial,
        gel=gel if gel is not None or session is None else session.gel,
        input=input,
        timeout_s=timeout_s,
        reconnect_s=reconnect_s,
    ).open()
    sensor.notes += (note,) if note else ()
    return sensor


def _load_profile(
    profile: str | Path, sim: bool, script: Path | str | None, *, replayed: bool
) -> Profile:
    if script is None:
        return load_profile(profile, sim=sim, replayed=replayed)
    if not sim:
        raise InputError(f"the script {script} controls the virtual sensor; add --sim")
    return load_profile(profile, sim=True, overrides={"camera": {"script": str(script)}})


@dataclass(frozen=True, eq=False)
class PairedReadings:
    """One reading of each sensor, taken at about the same time.

    Attributes
    ----------
    readings : tuple of Reading
        In the order of the sensors.
    apart_s : float
        Time between the first and the last of them.
    """

    readings: tuple[Reading, ...]
    apart_s: float


class SensorGroup(Closing):
    """Open sensors whose readings belong together where their times do.

    All sensors need the same clock: live cameras of one host, or recordings that were started
    together.

    Parameters
    ----------
    sensors : sequence of Sensor
        Open; the group closes them.
    tolerance_s : float
        Readings of one instant are at most this far apart. Half the period of the slowest camera
        pairs every frame of that camera.

    Attributes
    ----------
    skipped : int
        Frames without a partner, which were not measured.
    """

    def __init__(self, sensors: Sequence[Sensor], *, tolerance_s: float) -> None:
        if len(sensors) < 2:
            raise InputError("a group needs two sensors or more; open each with open_sensor")
        if not 0 <= tolerance_s < float("inf"):
            raise InputError(f"a tolerance of {tolerance_s:g} s? give the seconds, 0 or more")
        self.sensors = tuple(sensors)
        self.tolerance_s = tolerance_s
        self.skipped = 0
        # a thread for each sensor, so that their exposures take place together
        self._threads = [ThreadPoolExecutor(1, f"sensor group {i}") for i in range(len(sensors))]

    @classmethod
    def open(
        cls,
        profile: Profile | str | Path,
        serials: Iterable[str],
        *,
        tolerance_s: float,
        **options: Any,
    ) -> Self:
        """Open several units of one profile; if one fails, none stays open.

        Parameters
        ----------
        profile : Profile, str or Path
            As of :func:`~tactile_core.pipeline.opening.open_sensor`.
        serials : iterable of str
            Serial of each unit.
        tolerance_s : float
        **options
            Further arguments of :func:`~tactile_core.pipeline.opening.open_sensor`, for all units.

        Raises
        ------
        InputError
            There is only one serial, or one is given twice.
        TactileError
            As :func:`~tactile_core.pipeline.opening.open_sensor`; the message names the unit.
        """
        units = list(serials)
        if len(units) < 2 or len(set(units)) < len(units):
            raise InputError(
                f"the serials {', '.join(units) or '(none)'}? give two or more, each once, as in "
                f"SensorGroup.open({str(profile)!r}, ('left', 'right'), …)"
            )
        with ExitStack() as opened:
            sensors = []
            for unit in units:
                with _naming(f"sensor {unit}"):
                    sensors.append(open_sensor(profile, serial=unit, **options))
                opened.callback(sensors[-1].close)
            group = cls(sensors, tolerance_s=tolerance_s)
            opened.pop_all()
            return group

    def stream(self) -> Iterator[PairedReadings]:
        """Yield paired readings until the first sensor ends.

        The sensor that is behind is read again until all are within the tolerance. Only paired
        frames are measured. Live cameras drop what nobody reads meanwhile, so that a slow sensor
        delays no frame of the others.

        Raises
        ------
        DeviceError
            A camera fails; the message names its sensor.
        InputError
            The frames of the sensors follow one another, but never within the tolerance.
        """
        frames = self._acquire_frames(range(len(self.sensors)))
        alone, closest_s = [0] * len(frames), float("inf")
        while None not in frames:
            times = [frame.timestamp_s for frame in frames if frame is not None]
            apart_s = max(times) - min(times)
            if apart_s <= self.tolerance_s:
                yield PairedReadings(tuple(self._measure_frames(frames)), apart_s)
                frames = self._acquire_frames(range(len(self.sensors)))
                alone, closest_s = [0] * len(frames), float("inf")
            else:
                behind = times.index(min(times))
                self.skipped += 1
                alone[behind] += 1
                closest_s = min(closest_s, apart_s)
                if min(alone) >= 30:  # [frames] a second of most cameras
                    raise InputError(
                        f"no frames of the sensors are within {self.tolerance_s:g} s of each "
                        f"other; the closest are {closest_s:.3g} s apart, so allow a larger "
                        f"tolerance_s"
                    )
                (frames[behind],) = self._acquire_frames([behind])

    def close(self) -> None:
        """Close every sensor, even if one of them fails."""
        with ExitStack() as stack:
            for sensor in self.sensors:
                stack.callback(sensor.close)
            for thread in self._threads:  # a read that is under way ends after its timeout
                stack.callback(thread.shutdown)

    def _acquire_frames(self, indices: Iterable[int]) -> list[Frame | None]:
        """Acquire one frame of each of these sensors, all at the same time."""
        under_way = {
            index: self._threads[index].submit(self.sensors[index].acquire) for index in indices
        }
        return [self._result(index, future) for index, future in under_way.items()]

    def _result(self, index: int, future: Future[Frame | None]) -> Frame | None:
        with _naming(f"sensor {index + 1} ({self.sensors[index].name})"):
            return future.result()

    def _measure_frames(self, frames: Sequence[Frame | None]) -> Iterator[Reading]:
        for sensor, frame in zip(self.sensors, frames, strict=True):
            assert frame is not None
            yield sensor.measure(frame)


@contextmanager
def _naming(sensor: str) -> Iterator[None]:
    """Put the sensor's name before the message of an error on purpose."""
    try:
        yield
    except TactileError as error:
        raise type(error)(f"{sensor}: {error}") from error
