"""Opens a sensor by its profile's name."""

from __future__ import annotations

from pathlib import Path

from tactile_core.acquisition.unit_devices import with_unit_devices
from tactile_core.bundles.bundle import Bundle, check_serial, default_place
from tactile_core.errors import InputError
from tactile_core.pipeline.recorded_sensor import check_unit, recorded_session
from tactile_core.pipeline.sensor import TIMEOUT_S, Sensor
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference
from tactile_core.recordings.session_files import bundle_of


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
    session = None if input is None else recorded_session(Path(input))
    if session is not None:
        check_unit(session, serial, Path(input or ""))
        serial, sim = serial or session.serial, sim or session.sim
    resolved = profile if isinstance(profile, Profile) else _load_profile(profile, sim, script)
    if serial is not None:
        check_serial(serial)
        if input is None:
            resolved = with_unit_devices(resolved, serial)
    if gel is not None:
        check_serial(gel, "gel")
    if bundle is None and session is not None:
        bundle = bundle_of(session, Path(input or ""))
    if bundle is None:
        place = default_place(resolved, serial, gel)
        bundle = Bundle.load(place) if place.is_dir() else None
    elif not isinstance(bundle, Bundle):
        bundle = Bundle.load(Path(bundle))
    if gel is not None and bundle is not None:
        bundle.check_gel(gel)
    return Sensor(
        resolved,
        bundle,
        reference,
        serial=serial,
        gel=gel if gel is not None or session is None else session.gel,
        input=input,
        timeout_s=timeout_s,
        reconnect_s=reconnect_s,
    ).open()


def _load_profile(profile: str | Path, sim: bool, script: Path | str | None) -> Profile:
    if script is None:
        return load_profile(profile, sim=sim)
    if not sim:
        raise InputError(f"the script {script} controls the virtual sensor; add --sim")
    return load_profile(profile, sim=True, overrides={"camera": {"script": str(script)}})
