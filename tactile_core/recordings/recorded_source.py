"""Plays a recording, and the inputs that a result keeps."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.images import ImageKind
from tactile_core.formats.npz import read_quantities
from tactile_core.interfaces.recording_format import (
    MEASURED,
    REFERENCE,
    RESUMED,
    EventEntry,
    ImageEntry,
    RecordingFile,
)
from tactile_core.interfaces.recording_writer import RecordedSession
from tactile_core.plugins.blame import blame
from tactile_core.quantities import Frame, Image, Quantity, Reference
from tactile_core.recordings.output_folder import safe_stem
from tactile_core.recordings.session_files import own_reference
from tactile_core.recordings.source import Observation, ObservationSource


@dataclass(frozen=True)
class Turn:
    """What happened before an observation was measured.

    Attributes
    ----------
    tare : bool
        Its load is subtracted from then on.
    resumed : bool
        Tracking started again.
    reference : str or None
        Name of the new reference.
    """

    tare: bool = False
    resumed: bool = False
    reference: str | None = None


class RecordedSource(ObservationSource):
    """The observations of a recording, in the order in which they were measured.

    If the sensor measured only some of the images, these are the observations; if it measured
    none, all images are.

    Parameters
    ----------
    file : RecordingFile
    images_per_observation : int
        Exposures of the rig.
    every : bool
        Whether all images are observations, also those that were not measured.

    Raises
    ------
    InputError
        No observation is complete, or the rig takes another number of exposures.
    """

    def __init__(
        self, file: RecordingFile, images_per_observation: int, *, every: bool = False
    ) -> None:
        self._file = file
        if file.session.exposures != images_per_observation:
            raise InputError(
                f"{file.path} was recorded with {file.session.sensor}, whose observations have "
                f"{_exposures(file.session.exposures)}, but the rig takes "
                f"{_exposures(images_per_observation)}; use the profile that it was recorded with"
            )
        self._played, turns = _plan_replay(file, images_per_observation, every=every)
        if not self._played:
            raise InputError(f"{file.path} has no complete observation; record again")
        self.turns: Mapping[int, Turn] = {n: turn for n, turn in turns.items() if turn != Turn()}
        self.kind = ImageKind.from_pixels(self._image(self._played[0][0]).pixels)

    @property
    def session(self) -> RecordedSession:
        """The sensor that recorded, and what belongs to it."""
        return self._file.session

    @property
    def changes_reference(self) -> bool:
        """Whether a new reference was taken between the observations."""
        return any(turn.reference is not None for turn in self.turns.values())

    @property
    def damage(self) -> tuple[str, ...]:
        """Say what is missing of it; empty if nothing is."""
        return self._file.missing

    def own_reference(self) -> Reference | None:
        """Return the reference with which the recording begins; None if it has none.

        Raises
        ------
        InputError
            It is damaged.
        """
        return own_reference(self.session, self._file.path)

    @property
    def notes(self) -> tuple[str, ...]:
        """For the user."""
        notes = list(self.damage)
        times = [exposures[0].described.get("timestamp_s") for exposures in self._played]
        known = [time_s for time_s in times if isinstance(time_s, float | int)]
        stuck = sum(later <= earlier for earlier, later in pairwise(known))
        if stuck:
            notes.append(
                f"{stuck} of {len(times)} times in {self._file.path.name} are not after the one "
                f"before, so its rates and slip are not to be trusted; set the recorder's clock"
            )
        if self.session.tared:
            notes.append(
                f"the sensor had been tared before {self._file.path.name} was recorded, which the "
                f"recording does not repeat; loads are absolute"
            )
        return tuple(notes)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the observations."""
        return tuple(self._name(number) for number in range(len(self._played)))

    def reference(self, name: str) -> Reference:
        """Read a reference that a :class:`Turn` names."""
        with blame("the recording", self._file):
            return self._file.reference(name)

    def __iter__(self) -> Iterator[Observation]:
        """Read the observations."""
        for number, entries in enumerate(self._played):
            name = self._name(number)
            images = [replace(self._image(entry), source=name) for entry in entries]
            for image in images:
                if ImageKind.from_pixels(image.pixels) != self.kind:
                    raise InputError(
                        f"{name} is {ImageKind.from_pixels(image.pixels)}, but the first image of "
                        f"the recording is {self.kind}; record again"
                    )
            yield Observation(name, tuple(images))

    def _image(self, entry: ImageEntry) -> Image:
        with blame("the recording", self._file):
            return self._file.image(entry)

    def _name(self, number: int) -> str:
        return f"{self._file.path.stem}_{number:06d}"


_Exposures = tuple[ImageEntry, ...]


def _plan_replay(
    file: RecordingFile, count: int, *, every: bool
) -> tuple[list[_Exposures], dict[int, Turn]]:
    """Return the observations to measure, and what happened before some of them."""
    complete = _observations(file, count)
    names = {entry.name for entry in file.entries if isinstance(entry, EventEntry)}
    if every or MEASURED not in names:
        return list(complete.values()), {}
    played: list[_Exposures] = []
    turns: dict[int, Turn] = {}
    turn = Turn()
    for entry in file.entries:
        if not isinstance(entry, EventEntry):
            continue
        if entry.name == REFERENCE:
            turn = replace(turn, reference=str(entry.values.get("name")))
        elif entry.name == RESUMED:
            turn = replace(turn, resumed=True)
        elif entry.name == MEASURED:
            turn = replace(turn, tare=turn.tare or bool(entry.values.get("tare")))
            found = complete.get(_key(entry.values))
            if found is not None:
                turns[len(played)], turn = turn, Turn()
                played.append(found)
    return played, turns


def _observations(file: RecordingFile, count: int) -> dict[Hashable, _Exposures]:
    """Return the complete observations by number, in order."""
    found: dict[Hashable, dict[int, ImageEntry]] = {}
    for entry in file.entries:
        if isinstance(entry, ImageEntry):
            key = _key(entry.described)
            found.setdefault(key, {})[entry.described.get("exposure_index") or 0] = entry
    return {
        key: tuple(exposures[index] for index in range(count))
        for key, exposures in found.items()
        if set(exposures) == set(range(count))
    }


def _exposures(count: int) -> str:
    return "1 exposure" if count == 1 else f"{count} exposures"


def _key(values: Mapping[str, object]) -> Hashable:
    """Return what identifies an observation: its number, or that of a streaming camera's image."""
    observation, number = values.get("observation"), values.get("number")
    if observation is None:
        return "image", number if isinstance(number, int) else None
    return "observation", observation if isinstance(observation, int) else None


class SavedInputs:
    """Reads the inputs of a frame from the ``NAME.npz`` of its observation.

    Parameters
    ----------
    folder : Path
        Results of an earlier run, or files made with
        :func:`tactile_core.formats.npz.arrays_of`.
    kinds : collection of types
        Types of the quantities to read.

    Raises
    ------
    InputError
        It is not a folder.
    """

    def __init__(self, folder: Path, kinds: Collection[type[Quantity]]) -> None:
        if not folder.is_dir():
            raise InputError(f"{folder} is not a folder; name one that an earlier run wrote")
        self._folder, self._kinds = folder, tuple(kinds)

    def __call__(self, frame: Frame) -> tuple[Quantity, ...]:
        """Return the saved quantities of a frame; none if its file is absent.

        Raises
        ------
        InputError
            Its file is corrupt or of another kind.
        """
        path = self._folder / f"{safe_stem(frame.name)}.npz"
        return tuple(read_quantities(path, *self._kinds).values()) if path.is_file() else ()
