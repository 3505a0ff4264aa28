"""Where bundles lie: the folder of each unit, and the one that a sensor starts with."""

from __future__ import annotations

import re
from pathlib import Path

from tactile_core.bundles.manifest import bundle_files, read_manifest
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.text import shorten_repr
from tactile_core.profiles.model import Profile

_SERIAL = re.compile(r"[A-Za-z0-9._-]{1,100}")


def check_serial(serial: str, of: str = "serial") -> str:
    """Return the serial of a unit, or the name of a gel, if it is safe as a folder's name.

    Raises
    ------
    InputError
        It has characters other than letters, digits, ``.``, ``_`` and ``-``.
    """
    if not _SERIAL.fullmatch(serial) or set(serial) == {"."}:
        raise InputError(
            f"{of} {shorten_repr(serial)}: use only letters, digits, '.', '_' and '-', 100 at most"
        )
    return serial


def check_place(directory: Path) -> Path:
    """Return the folder, with links resolved, if a bundle may be written there.

    Raises
    ------
    InputError
        It holds anything but a bundle.
    """
    from tactile_core.formats.folders import resolve_links  # only where something is written

    directory = resolve_links(Path(directory))
    bundle_files(directory)
    return directory


def default_place(profile: Profile, serial: str | None, gel: str | None = None) -> Path:
    """Return the default bundle folder of a unit with a gel, in the user's data directory."""
    from platformdirs import user_data_path

    name = (serial or "default") + (f"+{gel}" if gel else "")  # no serial contains a plus
    return user_data_path("tactile-core") / "bundles" / profile.name / name


def find_place(profile: Profile, serial: str | None, gel: str | None = None) -> Path | None:
    """Return the folder of a unit's bundle, else of its design's starting calibration, if any.

    A profile whose image has another size, or is turned otherwise, may have inherited that, and has
    none.

    Raises
    ------
    CalibrationError
        The profile names a folder that is no starting calibration.
    """
    own, start = default_place(profile, serial, gel), profile.starting_bundle
    if own.is_dir() or start is None:
        return own if own.is_dir() else None
    named = f"'starting_bundle' of the profile {profile.name} names {start}"
    try:
        made = read_manifest(start)
    except CalibrationError as error:
        raise CalibrationError(
            f"{named}, which cannot be used ({error}); install the profile's package again, or set "
            f"the key to null"
        ) from error
    if made.starting is None:
        raise CalibrationError(
            f"{named}, the bundle of one unit; name what 'tactile starting-calibration' has made, "
            f"or set the key to null"
        )
    image, design = profile.image, made.starting
    mine = (image.width_px, image.height_px), image.flip, image.rotate_deg
    return start if mine == (made.image_size_px, design.flip, design.rotate_deg) else None
