"""``tactile run`` with several recordings: one bar, one line a recording, failures at the end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from tactile_core.cli.output import Bar, print_data, print_json, print_message

if TYPE_CHECKING:
    from tactile_core.pipeline.batch.recording_job import MeasuredRecording


def are_several(profile: str, inputs: Sequence[Path]) -> bool:
    """Whether ``--input`` gives several recordings: several paths, or a folder of recordings."""
    if len(inputs) > 1:
        return True
    if not inputs[0].is_dir():
        return False
    from tactile_core.pipeline.playback import images_per_observation
    from tactile_core.profiles.loader import load_profile
    from tactile_core.recordings.recovery import is_folder_of_recordings

    count = images_per_observation(load_profile(profile))
    return is_folder_of_recordings(inputs[0], images_per_observation=count)


def unread_notes(recording: Path | None) -> Iterator[str]:
    """Yield a note if a folder of images contains recordings, which are not measured."""
    from tactile_core.recordings.recovery import unread_recordings

    unread = [] if recording is None else unread_recordings(recording)
    if unread:
        yield (
            f"{recording} is read as a folder of images, so {unread[0].name} in it is not "
            f"measured; to measure recordings, move them to a folder of their own"
        )


def run_batch(
    profile: str,
    inputs: Sequence[Path],
    *,
    unusable: Sequence[str],
    workers: int,
    cluster: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Measure several recordings.

    Parameters
    ----------
    profile : str
    inputs : sequence of Path
    unusable : sequence of str
        Options on the command line that belong to a single recording.
    workers : int
    cluster : str or None
    as_json : bool
    **options
        Further arguments of :class:`~tactile_core.pipeline.batch.batch.Batch`.
    """
    from tactile_core.errors import InputError
    from tactile_core.pipeline.batch.batch import Batch

    if unusable:
        raise InputError(
            f"{' and '.join(unusable)} cannot hold for several recordings; measure one at a time"
        )
    batch = Batch(profile, inputs, **options)
    failed: list[MeasuredRecording] = []
    said: set[str] = set()
    with (
        Bar() as bar,
        closing(batch.measure(workers=workers, cluster=cluster, progress=bar)) as results,
    ):
        for found in results:
            if found.failure:
                failed.append(found)
                continue
            for note in found.notes:
                if note not in said:  # most hold for every recording
                    print_message(f"note: {note}")
                said.add(note)
            if as_json:
                for line in found.lines():
                    print_json(line)
            else:
                print_data(_text(found))
    if failed:
        count = f"{len(failed)} of {len(batch.jobs)} recordings"
        print_message(f"tactile: {count} could not be measured and are left out:")
        for sentence, names in _by_sentence(failed).items():
            print_message(f"  {', '.join(names)}: {sentence}")
        raise typer.Exit(1)


def _text(found: MeasuredRecording) -> str:
    count = "1 observation" if found.observations == 1 else f"{found.observations} observations"
    parts = [count]
    if found.deepest_mm is not None:
        parts.append(f"height up to {found.deepest_mm:.3f} mm")
    if found.warned:
        parts.append(f"{found.warned} with warnings")
    parts.append("measured before" if found.earlier else f"{found.duration_s:.1f} s")
    return f"{found.name}: {', '.join(parts)}"


def _by_sentence(failed: Sequence[MeasuredRecording]) -> dict[str, list[str]]:
    names: dict[str, list[str]] = {}
    for one in failed:
        names.setdefault(one.failure, []).append(one.name)
    return names
