"""Catalogues of a folder's images, and addresses of streams."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.scan import read_table
from tactile_core.formats.text import printable, shorten_repr

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


def place_name(place: str) -> str:
    """Return the name of the observation in a folder that a catalogue lists."""
    return place.replace("/", "_")


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
            f"{where}: {shorten_repr(text)} should be a path inside the folder of the catalogue"
        )
    return str(path)


def _diameter_mm(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise InputError(
            f"{where}: the diameter must be a positive number of mm, not {shorten_repr(text)}"
        )
    return value


_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
_ADDRESS = re.compile(_SCHEME.pattern + r"\S*")
_HOST = re.compile(r"(?:[^:\[\]]*|\[.*\])(?::\d*)?")

# fmt: off
_HARMLESS = frozenset(
    {"action", "camera", "cam", "channel", "ch", "codec", "compression", "device", "format",
     "fps", "framerate", "height", "input", "profile", "quality", "resolution", "rotation",
     "source", "stream", "subtype", "view", "width"}
)
# fmt: on
"""Keys that choose a picture; the value of any other may be a password."""


def without_secrets(address: str) -> str:
    """Return an address without user, password, and values that may be secret.

    The user and the password end at the last ``@`` before the path, and at the last of all if
    they contain a slash. Of ``key=value`` in query and path, what chooses a picture stays, such as
    ``channel=1``.
    """
    scheme = _SCHEME.match(address)
    begin = 0 if scheme is None else scheme.end()
    start, rest = address[:begin], address[begin:]
    authority = rest.partition("/")[0]
    if "@" in authority:
        rest = authority.rpartition("@")[2] + rest[len(authority) :]
    elif not _HOST.fullmatch(re.split("[?#]", authority)[0]):
        rest = rest.rpartition("@")[2]
    place, _, query = rest.partition("#")[0].partition("?")
    kept = [pair for pair in re.split("[&;]", query) if _is_harmless(pair)]
    folders = [part for part in place.split("/") if "=" not in part or _keep_harmless(part)]
    return start + "/".join(map(_keep_harmless, folders)) + ("?" + "&".join(kept) if kept else "")


def hide_secrets(value: Any) -> Any:
    """Return JSON-ready values in which no address has a secret."""
    if isinstance(value, dict):
        return {key: hide_secrets(one) for key, one in value.items()}
    if isinstance(value, list):
        return [hide_secrets(one) for one in value]
    if not isinstance(value, str):
        return value
    if _SCHEME.match(value):  # all of it, for a password may contain a space
        return without_secrets(value)
    return _ADDRESS.sub(lambda found: without_secrets(found[0]), value)


def _keep_harmless(part: str) -> str:
    """Return a part of the path with its harmless pairs only."""
    if "=" not in part:
        return part
    return "&".join(pair for pair in re.split("[&;]", part) if _is_harmless(pair))


def _is_harmless(pair: str) -> bool:
    key, _, value = pair.partition("=")
    return bool(value) and key.lower() in _HARMLESS
