"""Circles that somebody marked by hand: CSV ``file,centre_x_px,centre_y_px,contact_radius_px``."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes
from tactile_core.formats.images import IMAGE_SUFFIXES

if TYPE_CHECKING:
    from tactile_core.algorithms.circles import Circle

_NUMBERS = ("centre_x_px", "centre_y_px", "contact_radius_px")


def read_labels(path: Path) -> dict[str, Circle]:
    """Read one circle per press.

    Returns
    -------
    dict of observation name to Circle
        The name is what :func:`tactile_core.recording.open_recording` calls the observation: an
        image's name without folder and ending, a scan's folder.

    Raises
    ------
    InputError
        The file is missing or a line cannot be used; the message names it.
    """
    from tactile_core.algorithms.circles import Circle

    path = Path(path)
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is no text file in UTF-8") from None
    reader = csv.DictReader(text.splitlines(), skipinitialspace=True, strict=True)
    circles: dict[str, Circle] = {}
    try:
        missing = {"file", *_NUMBERS} - {(name or "").strip() for name in reader.fieldnames or ()}
        if missing:
            raise InputError(
                f"{path}:1: column {sorted(missing)[0]!r} is missing; the first line must be "
                f"file,{','.join(_NUMBERS)}"
            )
        for row in reader:
            where = f"{path}:{reader.line_num}"
            cells = {key.strip(): (row[key] or "").strip() for key in row if key is not None}
            name = _observation(cells["file"])
            x, y, radius = (_number(cells[key], key, where) for key in _NUMBERS)
            if not name or not radius > 0:
                what = "contact_radius_px must be positive" if name else "'file' is empty"
                raise InputError(f"{where}: {what}")
            if name in circles:
                raise InputError(f"{where}: {cells['file']} has a circle already; keep one line")
            circles[name] = Circle((x, y), radius, True, "", 1.0)
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: this is not CSV: {error}") from None
    return circles


def _observation(file: str) -> str:
    name = Path(file.replace("\\", "/"))
    return name.stem if name.suffix.lower() in IMAGE_SUFFIXES else name.name


def _number(text: str, column: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: {column} must be a number, not {text!r}")
    return value
