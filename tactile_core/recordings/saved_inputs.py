"""Replays the external inputs of an earlier run."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_quantities
from tactile_core.quantities import Frame, Quantity
from tactile_core.recordings.output_folder import safe_stem


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
