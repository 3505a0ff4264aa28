"""The artefact interface: a value fitted to one physical unit and stored in its bundle."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Self


class Artefact(ABC):
    """An immutable fitted value that belongs to one unit.

    A bundle stores each artefact in its own folder under the class name that the hook
    ``tactile_artefacts`` registers.
    """

    @abstractmethod
    def save(self, directory: Path) -> None:
        """Write the artefact's files into an existing, empty directory, without pickles."""

    @classmethod
    @abstractmethod
    def load(cls, directory: Path) -> Self:
        """Read what :meth:`save` wrote.

        Raises
        ------
        CalibrationError
            The files are missing, damaged or from a newer version.
        """
