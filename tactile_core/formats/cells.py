"""Cells of CSV files: numbers, and the names of image files."""

from __future__ import annotations

import math
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.images import IMAGE_SUFFIXES
from tactile_core.formats.printable import shown


def finite_number(text: str, column: str, where: str) -> float:
    """Return the number in a cell.

    Parameters
    ----------
    text : str
    column, where : str
        Name of the column, and file and line, for messages.

    Raises
    ------
    InputError
        It is not a finite number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: {column} must be a number, not {shown(text)}")
    return value


def observation_name(file: str) -> str:
    """Return the name of the observation that an image file or a folder holds; "" for no file."""
    name = Path(file.replace("\\", "/"))
    return name.stem if name.suffix.lower() in IMAGE_SUFFIXES else name.name
