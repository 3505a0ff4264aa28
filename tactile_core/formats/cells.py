"""CSV files and their cells: numbers, and the names of image files."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path
from typing import NamedTuple

from tactile_core.errors import InputError
from tactile_core.formats.files import read_text
from tactile_core.formats.images import IMAGE_SUFFIXES
from tactile_core.formats.printable import shown


class Table(NamedTuple):
    """A CSV file: the names of its columns, and its lines as file and number with their cells."""

    columns: list[str]
    lines: list[tuple[str, dict[str, str]]]


def read_table(path: Path) -> Table:
    """Read a CSV file, also one with semicolons and decimal commas, as spreadsheets write it.

    Raises
    ------
    InputError
        The file is missing or not CSV; the message names the line.
    """
    text = read_text(path)
    first = text.partition("\n")[0]
    semicolons = ";" in first and "," not in first
    reader = csv.DictReader(
        text.splitlines(), delimiter=";" if semicolons else ",", skipinitialspace=True, strict=True
    )
    lines = []
    try:
        columns = [(name or "").strip() for name in reader.fieldnames or ()]
        for row in reader:
            cells = {key.strip(): (row[key] or "").strip() for key in row if key is not None}
            if semicolons:
                cells = {key: _with_point(cell) for key, cell in cells.items()}
            lines.append((f"{path}:{reader.line_num}", cells))
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: this is not CSV: {error}") from None
    return Table(columns, lines)


def _with_point(cell: str) -> str:
    number = cell.replace(",", ".", 1)
    return number if re.fullmatch(r"[-+]?\d*\.?\d+(e[-+]?\d+)?", number, re.IGNORECASE) else cell


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
