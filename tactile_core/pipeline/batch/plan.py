"""Which recordings are measured, how, and where their results go."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tactile_core import __version__
from tactile_core.bundles.bundle import Bundle, default_place
from tactile_core.errors import InputError
from tactile_core.formats.scan import SCAN_FILE
from tactile_core.pipeline.batch.recording_job import RecordingJob
from tactile_core.pipeline.initial_reference import FIRST
from tactile_core.pipeline.playback import images_per_observation
from tactile_core.pipeline.sinks import Sinks
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.recordings.inputs import Inputs
from tactile_core.recordings.kinds import is_recorded
from tactile_core.recordings.output_folder import OutputFolder
from tactile_core.recordings.recording_list import list_recordings
from tactile_core.recordings.result_folder import own_files


def planned(
    profile: Profile | str | Path,
    inputs: Sequence[Path],
    *,
    out: Path | None,
    save: Sequence[str],
    bundle: Path | None,
    reference: Path | str | None,
    serial: str | None,
    gel: str | None,
    tare_frame: int | None,
    frames: int | None,
) -> tuple[RecordingJob, ...]:
    """Return the job of each recording, after checking what holds for all of them.

    The arguments are those of :class:`~tactile_core.pipeline.batch.batch.Batch`.
    """
    known = profile if isinstance(profile, Profile) else load_profile(profile)
    count = images_per_observation(known)
    recordings = list_recordings(inputs, images_per_observation=count)
    # what a sensor recorded has its own bundle
    place = default_place(known, serial, gel) if bundle is None else bundle
    default = place.absolute() if bundle is not None or place.is_dir() else None
    loaded = None if default is None else Bundle.load(default)
    if Sinks(known, save).endings and out is None:
        raise InputError(f"{', '.join(save)} writes files; name a folder for them")
    if out is not None:
        _check_out(out, inputs, default, reference)
    if reference is not None and str(reference) != FIRST:
        reference = Path(reference).absolute()
    if not isinstance(profile, Profile) and Path(profile).suffix in (".yaml", ".yml"):
        profile = Path(profile).absolute()
    common: dict[str, Any] = {
        "reference": reference,
        "serial": serial,
        "gel": gel,
        "save": tuple(dict.fromkeys(save)),
        "tare_frame": tare_frame,
        "frames": frames,
    }
    basis = {
        **common,
        "reference": _content(reference) if isinstance(reference, Path) else reference,
        "profile": known.model_dump(mode="json"),
        "bundle": None if loaded is None else loaded.manifest.content_hash,
        "version": __version__,
    }
    return tuple(
        RecordingJob(
            name=one.name,
            recording=one.path.absolute(),
            folder=None if out is None else out.absolute() / one.name,
            fingerprint=_hash({**basis, "recording": [one.name, _content(one.path)]}),
            profile=profile,
            bundle=None if bundle is None and is_recorded(one.path) else default,
            **common,
        )
        for one in recordings
    )


def check_folders(jobs: Sequence[RecordingJob]) -> None:
    """Refuse results that would replace an input or a file that no command wrote.

    Raises
    ------
    InputError
    """
    recordings = {job.recording.resolve() for job in jobs}
    for folder in (job.folder for job in jobs if job.folder is not None):
        if folder.resolve() in recordings:
            raise InputError(f"{folder} is a recording itself; name another --out folder")
        if folder.exists() or folder.is_symlink():
            own_files(folder)


def _check_out(
    out: Path, inputs: Sequence[Path], bundle: Path | None, reference: Path | str | None
) -> None:
    shared: dict[str, Path | str | None] = {
        "--bundle": bundle,
        "--reference": None if reference == FIRST else reference,
    }
    OutputFolder(out, Inputs.of(shared))
    for path in inputs:
        OutputFolder(out, Inputs.of({"--input": path}))


def _content(path: Path) -> list[tuple[str, int, int]]:
    """Return name, size and time of modification of a file, or of all files in a folder."""
    if path.name == SCAN_FILE:
        path = path.parent
    if not path.is_dir():
        found = path.stat()
        return [(path.name, found.st_size, found.st_mtime_ns)]
    files = [(file, file.stat()) for file in sorted(path.rglob("*")) if file.is_file()]
    return [(str(f.relative_to(path)), found.st_size, found.st_mtime_ns) for f, found in files]


def _hash(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
