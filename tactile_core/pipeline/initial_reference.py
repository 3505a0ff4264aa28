"""The reference with which a sensor begins."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_core.acquisition.acquisition import average
from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import InputError, TactileError
from tactile_core.pipeline.frame_check import check_reference
from tactile_core.pipeline.frame_source import FrameSource
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference

if TYPE_CHECKING:
    from tactile_core.recordings.recorded_source import RecordedSource, Turn

# Words in place of a reference: the first frame, relative to which every reading is marked, and the
# median of the recording
FIRST, MEDIAN = "first", "median"


def is_word(reference: Reference | Path | str | None, word: str) -> bool:
    """Whether a word was given in place of a reference."""
    return isinstance(reference, str | Path) and str(reference) == word


def reference_path(reference: Path | str | None) -> Path | None:
    """Return the path of a reference; None for a word or nothing."""
    if reference is None or str(reference) in (FIRST, MEDIAN):
        return None
    return Path(reference)


class InitialReference:
    """The reference as the user gave it, or that of a recording; the bundle's if there is none.

    Parameters
    ----------
    profile : Profile
    given : Reference, path, "first" or None
    recorded : RecordedSource or None
        The recording that is measured, if a sensor wrote it.
    otherwise : "first" or None
        Taken if there is neither.
    """

    def __init__(
        self,
        profile: Profile,
        given: Reference | Path | str | None,
        recorded: RecordedSource | None,
        otherwise: str | None = None,
    ) -> None:
        if is_word(given, MEDIAN):
            raise InputError(
                "only a recording has a median; give --input, or 'first' as the reference of a "
                "camera"
            )
        self._profile = profile
        self.is_given = given is not None
        self._recorded = recorded
        self._wanted = given
        if given is None and recorded is not None:
            self._wanted = recorded.own_reference()
        if self._wanted is None:
            self._wanted = otherwise
        if not isinstance(self._wanted, str | Path):
            check_reference(self._wanted)

    @property
    def is_first(self) -> bool:
        """Whether it is the sensor's first frame."""
        return is_word(self._wanted, FIRST)

    def known_reference(self) -> Reference | None:
        """Return it, as far as it is known before the sensor is open; a file is read once.

        Raises
        ------
        InputError
            The file cannot be read.
        """
        if isinstance(self._wanted, str | Path) and not self.is_first:
            from tactile_core.pipeline.playback import read_reference

            self._wanted = read_reference(self._profile, Path(self._wanted))
        return self._wanted if isinstance(self._wanted, Reference) else None

    def fetch_reference(self, source: FrameSource) -> Reference | None:
        """Return it, from the first frame of an open sensor if that is wanted.

        Raises
        ------
        InputError
            The file cannot be read, or there is no frame.
        """
        if not self.is_first:
            return self.known_reference()
        return Reference(**{**vars(average([source.first()])), "relative": True})

    def recorded_start(self, bundle: Bundle | None) -> Reference | None:
        """Return what a recording that changes its reference began with; None if one is given."""
        if self.is_given or self._recorded is None or not self._recorded.changes_reference:
            return None
        return self._recorded.session.reference or (None if bundle is None else bundle.reference)

    def recorded_change(self, turn: Turn) -> Reference | None:
        """Return the reference that the recording changes to, if it does and none is given."""
        if self.is_given or self._recorded is None or turn.reference is None:
            return None
        return self._recorded.reference(turn.reference)

    def warm(self, bundle: Bundle | None) -> None:
        """Load code before a camera is opened: measure made-up frames as the sensor its own."""
        with suppress(TactileError):  # reported when the devices are open
            pipeline = Pipeline(self._profile, bundle, self.known_reference())
            if self.is_first and pipeline.reference is None:
                from tactile_core.pipeline.made_up_frames import made_up_reference

                made_up = made_up_reference(self._profile.image, pipeline.channels)
                pipeline = pipeline.with_reference(made_up)
            pipeline.warm()
