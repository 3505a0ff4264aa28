"""Plays recordings back, of one sensor or of a session."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from tactile_core.acquisition.acquisition import Acquisition, average
from tactile_core.acquisition.devices import images_per_observation, make_devices
from tactile_core.acquisition.geometry import ImageGeometry, Size
from tactile_core.errors import InputError
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.gel import markers_misfit
from tactile_core.interfaces.image import ImageSection
from tactile_core.interfaces.recording_writer import RecordedSession
from tactile_core.profiles.loader import profile_hash
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.recorded_source import RecordedSource
from tactile_core.recordings.recording import open_recording
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


class Playback(NamedTuple):
    """A recording in place of a profile's camera.

    Attributes
    ----------
    profile : Profile
    notes : tuple of str
        For the user.
    observations : int or None
        Number of observations; None if it is unknown before the end.
    recorded : RecordedSource or None
        What a sensor recorded besides the images; None if no sensor wrote the recording.
    """

    profile: Profile
    notes: tuple[str, ...]
    observations: int | None
    recorded: RecordedSource | None = None


def played_back(profile: Profile, path: Path) -> Playback:
    """Return the profile with a recording in place of its camera, and notes for the user."""
    count = images_per_observation(profile)
    recording = open_recording(path, images_per_observation=count)
    notes: tuple[str, ...] = ()
    recorded, image = recording.recorded, profile.image
    if recording.crop is None:
        image, notes = _as_recorded(profile, recording.size_px, path)
    if recorded is not None:
        as_seen = profile.model_copy(update={"image": image})
        notes = (*notes, *check_same_sensor(as_seen, recorded.session, path), *recorded.notes)
    if recording.crop is not None:
        image = image.model_copy(update={"crop": recording.crop})
    if recording.mm_per_px is not None:
        # a recording gives the scale of the camera's pixels, the profile that of the final image
        camera_scale = ImageGeometry(image).camera_mm_per_px(recording.size_px)
        scale = image.mm_per_px * recording.mm_per_px / camera_scale
        if scale != image.mm_per_px:
            note = (
                f"{path.name} gives a scale of {scale:g} mm per pixel, which replaces the "
                f"profile's {image.mm_per_px:g}"
            )
            notes = (*notes, note)
            image = image.model_copy(update={"mm_per_px": scale})
            misfit = markers_misfit(profile.gel, image)
            if misfit is not None:
                raise InputError(f"{note}, but then the gel {misfit}")
    stretch = ImageGeometry(image).stretch(recording.size_px)
    if abs(stretch - 1) > 0.01:  # [ratio] rounding of the image's size causes less
        width, height = recording.size_px
        notes = (
            *notes,
            f"{path.name} has images of {width} × {height}, which are stretched to the profile's "
            f"{image.width_px} × {image.height_px}, so mm_per_px is wrong in one direction; set "
            f"'image.crop' or the size in the profile",
        )
    fps = profile.camera.options.get("fps")
    if isinstance(fps, bool) or not isinstance(fps, int | float) or fps <= 0:
        fps = None  # another plugin's option of this name
    camera = Component.model_validate(
        {"use": "core.replay", "path": path, "images_per_observation": count, "fps": fps}
    )
    played = profile.model_copy(update={"camera": camera, "image": image})
    return Playback(played, notes, recording.count, recorded)


def _as_recorded(
    profile: Profile, size_px: Size, path: Path
) -> tuple[ImageSection, tuple[str, ...]]:
    """Return how to rectify images that another program recorded, and a note if they already are.

    They are if they have the size of the rectified image, and not that which the camera sends.
    """
    image = profile.image
    sent = tuple(profile.camera.options.get(side) for side in ("width_px", "height_px"))
    done = image.model_copy(
        update={"crop": None, "flip": "none", "rotate_deg": 0, "lens": None, "warp": None}
    )
    rectified = size_px == (image.width_px, image.height_px)
    if done == image or not rectified or None in sent or size_px == sent:
        return image, ()
    return done, (
        f"{path.name} has images of the rectified {size_px[0]} × {size_px[1]}, not of the camera's "
        f"{sent[0]} × {sent[1]}, so they are taken as cropped and turned already",
    )


def observation_names(profile: Profile, path: Path) -> list[str]:
    """Return the names of a recording's observations; for a video, only the first name."""
    recording = open_recording(path, images_per_observation=images_per_observation(profile))
    return [f"{path.stem}_{0:06d}"] if recording.names is None else list(recording.names)


def read_reference(profile: Profile, path: Path) -> Reference:
    """Average the observations of a recording of the undeformed sensor."""
    return average(list(read_frames(profile, path)))


def read_frames(profile: Profile, path: Path) -> Iterator[Frame]:
    """Yield the frames of a recording, in image coordinates."""
    profile = played_back(profile, path).profile
    camera, illumination, _ = make_devices(profile)
    with camera:
        yield from Acquisition(camera, illumination, profile.image)
