"""The artefact interface: anything that is fitted to one physical unit and kept in its bundle."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Self


class Artefact(ABC):
    """An immutable fitted value that belongs to one unit.

    A bundle holds artefacts by name, each in a folder of its own, and names the class of each as
    the hook ``tactile_artefacts`` registers it.
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
            The files are missing, broken or newer than this version.
        """
