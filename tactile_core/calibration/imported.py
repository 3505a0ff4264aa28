"""The bundle of a calibration that another program has made."""

from __future__ import annotations

from pathlib import Path

from tactile_core.acquisition.devices import make_lights
from tactile_core.bundles.bundle import Bundle, manifest_for
from tactile_core.bundles.manifest import LIGHT, Imported
from tactile_core.bundles.places import check_serial
from tactile_core.calibration.fitted_bundle import conditioning_for
from tactile_core.errors import PluginError
from tactile_core.formats.files import status
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.importer import Importer
from tactile_core.pipeline.made_up_frames import made_up_reference
from tactile_core.pipeline.playback import read_reference
from tactile_core.plugins.blame import blame, fault
from tactile_core.plugins.options import measured_by
from tactile_core.plugins.registry import list_plugins, resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile

_PART = "the importer"


def import_calibration(
    file: Path,
    kind: str,
    profile: Profile | str | Path,
    *,
    reference: Path | None = None,
    serial: str = "",
    gel: str = "",
) -> Bundle:
    """Read a calibration of another program and try it on the undeformed sensor.

    The bundle has no score: nothing is known of the errors of the model.

    Parameters
    ----------
    file : Path
        What the other program wrote.
    kind : str
        ``plugin.name`` of the importer.
    profile : Profile, str or Path
        The sensor that the calibration was made for.
    reference : Path, optional
        A recording of the undeformed sensor, which the bundle keeps. Without it, each use of the
        bundle has to give one.
    serial, gel : str
        The physical unit, and the gel on it.

    Raises
    ------
    PluginError
        There is no such importer; the message lists those that are installed.
    InputError, ProfileError, CalibrationError
        The file is of another kind or sensor, or another input cannot be used.
    """
    if serial:
        check_serial(serial)
    if gel:
        check_serial(gel, "gel")
    status(file)
    importer = _find_importer(kind)
    base = profile if isinstance(profile, Profile) else load_profile(profile)
    with blame(_PART, importer):
        model = importer().read(file, base)
    if not isinstance(model, Calibration):
        raise fault(_PART, importer, f"returned {type(model).__name__}, not a Calibration")
    undeformed = None
    if reference is not None:
        undeformed = conditioning_for(base, read_reference(base, reference), model).undeformed
    channels = tuple(make_lights(base).channels)
    shown = undeformed or made_up_reference(base.image, channels)
    measured_by(model, shown.as_frame(base.image.mm_per_px), shown)
    artefacts: dict[str, Artefact] = {LIGHT: model}
    manifest = manifest_for(
        base,
        channels,
        artefacts,
        serial=serial,
        gel_id=gel,
        imported=Imported(kind=kind, file=file.name),
    )
    return Bundle(manifest, artefacts, undeformed)


def _find_importer(kind: str) -> type[Importer]:
    try:
        return resolve("importer", kind)
    except PluginError as error:
        known = sorted(
            f"{plugin.name}.{name}"
            for plugin in list_plugins()
            for name in plugin.components.get("importer", ())
        )
        raise PluginError(f"{error} (installed importers: {', '.join(known) or 'none'})") from error
