"""Height maps of scanners: grids of cells with a pitch."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import NamedTuple

from tactile_core.errors import InputError
from tactile_core.formats.files import read_text
from tactile_core.formats.images import IMAGE_SUFFIXES
from tactile_core.formats.text import number, shorten_repr
from tactile_core.formats.yaml_tree import read_mapping

SCAN_FILE = "scan.yaml"  # Name of the file in a scan's folder

Crop = tuple[int, int, int, int]  # x, y, width and height in the camera's pixels

_MIN_MM_PER_PX, _MAX_MM_PER_PX = 1e-6, 100.0  # Limits of the size of a pixel on the gel, mm

_MAX_PX = 100_000  # Largest coordinate or size of a crop, px


@dataclass(frozen=True)
class Scan:
    """What is used of a ``scan.yaml``.

    Attributes
    ----------
    images : tuple of str
        Files relative to the scan's folder, in order. Other images there are not part of the scan.
    mm_per_px : float or None
        None if unknown: the file has 0 or no such key.
    crop : (x, y, width, height) or None
        In the camera's pixels. None if unknown: the file has only zeros or no such key.
    """

    images: tuple[str, ...]
    mm_per_px: float | None = None
    crop: Crop | None = None


def read_scan(path: Path) -> Scan:
    """Read a ``scan.yaml``.

    Raises
    ------
    InputError
        The file is missing or not a scan. Missing images are not an error here.
    """
    path = Path(path)
    content = read_mapping(path)
    images = content.get("images")
    if not isinstance(images, list) or not images or not all(isinstance(i, str) for i in images):
        raise InputError(f"{path}: 'images' must list the scan's image files")
    images = [image.replace("\\", "/") for image in images]
    outside = next((image for image in images if _leaves(image)), None)
    if outside is not None:
        raise InputError(
            f"{path}: images must be in the scan's folder, but {shorten_repr(outside)} is outside "
            f"it; move the file there"
        )
    scale, crop = _scale(content.get("mmperpixel"), path), _crop(content.get("crop"), path)
    return Scan(tuple(images), scale, crop)


def _leaves(image: str) -> bool:
    """Whether a path leaves the folder that it is relative to."""
    return (
        PurePosixPath(image).is_absolute()
        or PureWindowsPath(image).anchor != ""
        or ".." in PurePosixPath(image).parts
    )


def _scale(value: object, path: Path) -> float | None:
    scale = 0.0 if value is None else number(value, path, "mmperpixel")
    if scale and not _MIN_MM_PER_PX <= scale <= _MAX_MM_PER_PX:
        raise InputError(
            f"{path}: mmperpixel must be positive, from {_MIN_MM_PER_PX:g} to "
            f"{_MAX_MM_PER_PX:g}, or 0 for unknown, not {scale:g}"
        )
    return scale or None


def _crop(value: object, path: Path) -> Crop | None:
    if value is None or value == []:
        return None
    if not isinstance(value, list) or len(value) != 4:
        raise InputError(f"{path}: crop must be [x, y, width, height], not {shorten_repr(value)}")
    x, y, width, height = (round(number(part, path, "crop", high=_MAX_PX)) for part in value)
    if not any((x, y, width, height)):
        return None
    if min(x, y) < 0 or min(width, height) < 1:
        raise InputError(f"{path}: crop {shorten_repr(value)} is empty or begins outside the image")
    return (x, y, width, height)


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
        raise InputError(f"{where}: {column} must be a number, not {shorten_repr(text)}")
    return value


def observation_name(file: str) -> str:
    """Return the name of the observation that an image file or a folder holds; "" for no file."""
    name = Path(file.replace("\\", "/"))
    return name.stem if name.suffix.lower() in IMAGE_SUFFIXES else name.name
