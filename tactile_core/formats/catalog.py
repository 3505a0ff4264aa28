"""``catalog.csv`` of a folder of presses: the diameter of the ball in each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from tactile_core.errors import InputError
from tactile_core.formats.cells import read_table
from tactile_core.formats.printable import printable, shown

CATALOG_FILE = "catalog.csv"  # File name of the catalogue

FOLDER_COLUMN = "experiment_reldir"  # Column of a catalogue that lists folders

_PLACES = (FOLDER_COLUMN, "file")
_DIAMETERS = ("diameter(mm)", "diameter_mm")


@dataclass(frozen=True)
class Catalog:
    """Diameters of balls by the paths of folders or files.

    Attributes
    ----------
    path : Path
    diameters_mm : mapping of str to float
        By paths relative to the catalogue's folder, with ``/`` between their parts, in its order.
    of_folders : bool
        The paths are those of folders.
    """

    path: Path
    diameters_mm: Mapping[str, float]
    of_folders: bool

    def diameter_mm(self, file: Path) -> float | None:
        """Return the ball's diameter in an image; None if neither it nor its folder is listed."""
        relative = PurePosixPath(file.relative_to(self.path.parent).as_posix())
        for place in (relative, relative.with_suffix(""), *relative.parents):
            if str(place) in self.diameters_mm:
                return self.diameters_mm[str(place)]
        return None

    def check_listed(self) -> None:
        """Check that every path of the catalogue is there.

        Raises
        ------
        InputError
            One is not; the message names it.
        """
        for place in self.diameters_mm:
            path = self.path.parent / place
            if not (path.exists() or any(path.parent.glob(f"{path.name}.*"))):
                raise InputError(
                    f"{self.path} lists {printable(place)}, which is not in that folder; correct "
                    f"the line or copy it there"
                )


def find_catalog(folder: Path) -> Catalog | None:
    """Read the catalogue of a folder; None if there is none, or another kind of file of this name.

    Raises
    ------
    InputError
        A line of it is invalid; the message names the line.
    """
    path = folder / CATALOG_FILE
    if not path.is_file():
        return None
    columns, lines = read_table(path)
    place = next((name for name in _PLACES if name in columns), None)
    size = next((name for name in _DIAMETERS if name in columns), None)
    if place is None or size is None:
        return None
    diameters_mm: dict[str, float] = {}
    for where, cells in lines:
        name = _relative(cells[place], where)
        if name in diameters_mm:
            raise InputError(f"{where}: {printable(name)} already has a diameter; keep one line")
        diameters_mm[name] = _diameter_mm(cells[size], where)
    return Catalog(path, diameters_mm, place == FOLDER_COLUMN)


def _relative(text: str, where: str) -> str:
    path = PurePosixPath(text.replace("\\", "/"))
    if not path.parts or path.is_absolute() or ".." in path.parts:
        raise InputError(
            f"{where}: {shown(text)} should be a path inside the folder of the catalogue"
        )
    return str(path)


def _diameter_mm(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise InputError(
            f"{where}: the diameter must be a positive number of mm, not {shown(text)}"
        )
    return value
