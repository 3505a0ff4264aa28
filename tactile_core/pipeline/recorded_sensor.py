"""The sensor that a recording is of, and whether a profile fits it."""

from __future__ import annotations

from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.profiles.loader import profile_hash
from tactile_core.profiles.model import Profile
from tactile_core.recordings.recorder import RecordedSession
from tactile_core.recordings.session_files import profile_of
from tactile_core.recordings.source import is_recorded, recording_file


def recorded_session(path: Path) -> RecordedSession | None:
    """Return the session of a recording; None if no sensor wrote it.

    Raises
    ------
    InputError
        The recording is damaged.
    """
    if not is_recorded(path):
        return None
    with recording_file(path) as file:
        return file.session


def check_same_sensor(profile: Profile, session: RecordedSession, path: Path) -> tuple[str, ...]:
    """Check that a profile can measure what a sensor recorded; return notes for the user.

    Raises
    ------
    InputError
        The recording is of another sensor: its image, lights or gel differ.
    """
    own = profile_of(session, path)
    if profile_hash(own) == profile_hash(profile):
        return ()
    sizes = [(p.image.width_px, p.image.height_px, p.image.bit_depth) for p in (own, profile)]
    if own.name != profile.name or sizes[0] != sizes[1]:
        raise InputError(
            f"{path} was recorded with the profile {own.name}, whose image, lights or gel differ "
            f"from those of {profile.name}; use the profile {own.name}"
        )
    return (
        f"the image, lights or gel of the profile {own.name} have changed since {path.name} was "
        f"recorded",
    )


def check_unit(session: RecordedSession, serial: str | None, path: Path) -> None:
    """Check that a recording is of a unit.

    Raises
    ------
    InputError
        It is of another one.
    """
    if None not in (session.serial, serial) and session.serial != serial:
        raise InputError(
            f"{path} was recorded with the unit {session.serial}, not {serial}; correct --serial "
            f"or leave it out"
        )
