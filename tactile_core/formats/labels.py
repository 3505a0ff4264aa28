"""Labels: the circles of presses, and forces with their times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.errors import InputError
from tactile_core.formats.catalog import find_catalog, place_name
from tactile_core.formats.npz import read_npz
from tactile_core.formats.scan import finite_number, observation_name, read_table
from tactile_core.formats.text import printable, shorten_repr

if TYPE_CHECKING:
    from tactile_core.algorithms.circles.circle import Circle


_NUMBERS = ("centre_x_px", "centre_y_px", "contact_radius_px")  # Columns with numbers, px

_CIRCLE_FILE = "label.npz"  # Name of the file with a circle in a folder that gs_sdk has written


def read_labels(
    path: Path,
    *,
    size_px: tuple[int, int] | None = None,
    largest_radius_px: float | None = None,
) -> dict[str, Circle]:
    """Read one circle per press.

    Parameters
    ----------
    path : Path
        A table; or the folder of a catalogue that lists folders, of which some hold a circle as
        gs_sdk writes it: ``label.npz`` with ``center``, x and y in px, and ``radius``.
    size_px : (width, height), optional
        Size of the image that contains the circles.
    largest_radius_px : float, optional
        Largest radius that this ball's contact circle can have.

    Returns
    -------
    dict of observation name to Circle
        The name is an image's without folder and extension, or that of a scan's folder.

    Raises
    ------
    InputError
        The file is missing, or a line is invalid or its circle is impossible for this ball and
        image; the message names the line.
    """
    path = Path(path)
    if path.is_dir():
        return _read_folders(path, size_px, largest_radius_px)
    return _read_lines(path, size_px, largest_radius_px)


def _read_lines(
    path: Path, size_px: tuple[int, int] | None, largest_radius_px: float | None
) -> dict[str, Circle]:
    from tactile_core.algorithms.circles.circle import Circle

    columns, lines = read_table(path)
    circles: dict[str, Circle] = {}
    missing = {"file", *_NUMBERS} - set(columns)
    if missing:
        raise InputError(
            f"{path}:1: column {sorted(missing)[0]!r} is missing; the first line must be "
            f"file,{','.join(_NUMBERS)}"
        )
    for where, cells in lines:
        name = observation_name(cells["file"])
        x, y, radius = (finite_number(cells[key], key, where) for key in _NUMBERS)
        if not name or not radius > 0:
            what = "contact_radius_px must be positive" if name else "'file' is empty"
            raise InputError(f"{where}: {what}")
        if name in circles:
            raise InputError(
                f"{where}: {printable(cells['file'][:80])} already has a circle; keep one line"
            )
        _check_circle(x, y, radius, size_px, largest_radius_px, where)
        circles[name] = Circle((x, y), radius)
    return circles


def _read_folders(
    folder: Path, size_px: tuple[int, int] | None, largest_radius_px: float | None
) -> dict[str, Circle]:
    from tactile_core.algorithms.circles.circle import Circle

    catalog = find_catalog(folder)
    places = catalog.diameters_mm if catalog is not None and catalog.of_folders else ()
    files = {place_name(place): folder / place / _CIRCLE_FILE for place in places}
    circles = {}
    for name, file in files.items():
        if file.is_file():
            x, y, radius = _drawn_circle(file)
            _check_circle(x, y, radius, size_px, largest_radius_px, str(file))
            circles[name] = Circle((x, y), radius)
    if not circles:
        raise InputError(
            f"{folder} has no circles: no catalog.csv there lists a folder with a {_CIRCLE_FILE}; "
            "give such a folder, or a CSV file"
        )
    return circles


def _drawn_circle(file: Path) -> tuple[float, float, float]:
    """Read x, y and radius in px."""
    arrays = read_npz(file)
    try:
        numbers = np.array([*arrays["center"].ravel(), *arrays["radius"].ravel()], float)
        x, y, radius = (float(number) for number in numbers)
    except (LookupError, TypeError, ValueError):
        x = y = radius = math.nan
    if not (math.isfinite(x + y) and 0 < radius < math.inf):
        raise InputError(
            f"{file} has no circle: it should hold 'center', x and y in px, and a positive 'radius'"
        )
    return x, y, radius


def _check_circle(
    x: float,
    y: float,
    radius: float,
    size_px: tuple[int, int] | None,
    largest_radius_px: float | None,
    where: str,
) -> None:
    if size_px is not None and not (0 <= x + 0.5 <= size_px[0] and 0 <= y + 0.5 <= size_px[1]):
        raise InputError(
            f"{where}: the circle's centre ({x:g}, {y:g}) is outside the image of "
            f"{size_px[0]} × {size_px[1]} px; give it in the pixels of the profile's image"
        )
    if largest_radius_px is not None and radius > largest_radius_px:
        raise InputError(
            f"{where}: contact_radius_px {radius:g} is more than the {largest_radius_px:.4g} px "
            f"that this ball's circle can have; correct it, --ball-diameter-mm or the profile's "
            f"mm_per_px"
        )


_COMPONENTS = ("fx_n", "fy_n", "fz_n", "tz_nmm")

Key = Literal["frame", "file", "time_s"]


@dataclass(frozen=True, eq=False)
class ForceTable:
    """Measured forces, one row for each frame, file or time.

    Attributes
    ----------
    path : Path
    key : {"frame", "file", "time_s"}
        What the rows are named by.
    rows : tuple of str
        The frame numbers or the files' names without their endings; empty for times.
    times_s : (M,) float64
        Increasing; empty unless the key is the time.
    forces : (M, 4) float64
        fx, fy, fz in N and tz in N·mm; NaN where a column is missing or a cell is empty.
    sequences : tuple of str
        The column ``sequence``, such as the name of a press, or "" for each row.
    """

    path: Path
    key: Key
    rows: tuple[str, ...]
    times_s: Float64
    forces: Float64
    sequences: tuple[str, ...] = ()

    def name_of(self, number: int, source: str) -> str:
        """Return the name in :attr:`rows` of a frame with this sequence number and source."""
        return str(number) if self.key == "frame" else observation_name(source)


def read_forces(path: Path) -> ForceTable:
    """Read measured forces.

    Raises
    ------
    InputError
        The file is missing, or a line is invalid; the message names the line.
    """
    path = Path(path)
    header, lines = read_table(path)
    if not lines:
        raise InputError(f"{path} has no line with a force")
    key: Key | None = next((k for k in ("frame", "file", "time_s") if k in header), None)
    columns = [name for name in _COMPONENTS if name in header]
    if key is None or not columns:
        missing = "frame, file or time_s" if key is None else ", ".join(_COMPONENTS)
        raise InputError(
            f"{path}:1: no column {missing}; the first line must be "
            f"frame,{','.join(_COMPONENTS)}, where some components may be missing"
        )
    forces = np.full((len(lines), 4), np.nan)
    names: list[str] = []
    for row, (where, cells) in enumerate(lines):
        names.append(_name(cells[key], key, where))
        for name in columns:
            if cells[name]:
                forces[row, _COMPONENTS.index(name)] = finite_number(cells[name], name, where)
    if not np.isfinite(forces).any():
        raise InputError(f"{path} has no line with a force")
    return _table(path, key, names, forces, [cells.get("sequence", "") for _, cells in lines])


def read_weights(path: Path) -> ForceTable:
    """Read masses laid on the sensor, ``file,mass_g``, as normal forces.

    Raises
    ------
    InputError
        As :func:`read_forces`.
    """
    path = Path(path)
    header, lines = read_table(path)
    if not lines:
        raise InputError(f"{path} has no line with a force")
    if not {"file", "mass_g"} <= set(header):
        raise InputError(f"{path}:1: the first line must be file,mass_g")
    names = [_name(cells["file"], "file", where) for where, cells in lines]
    forces = np.full((len(lines), 4), np.nan)
    masses_g = [finite_number(cells["mass_g"], "mass_g", where) for where, cells in lines]
    if min(masses_g) < 0:
        raise InputError(f"{path}: a mass is negative; give masses in grams")
    forces[:, 2] = np.array(masses_g) * 1e-3 * 9.80665  # [m/s²] standard gravity
    return _table(path, "file", names, forces, [""] * len(names))


def _table(
    path: Path, key: Key, names: list[str], forces: Float64, sequences: list[str]
) -> ForceTable:
    if key != "time_s":
        repeated = next((name for name in names if names.count(name) > 1), None)
        if repeated is not None:
            raise InputError(f"{path}: {shorten_repr(repeated)} has several lines; keep one")
        return ForceTable(path, key, tuple(names), np.zeros(0), forces, tuple(sequences))
    times_s = np.array([float(name) for name in names])
    if not (np.diff(times_s) > 0).all():
        raise InputError(f"{path}: time_s must increase from line to line")
    return ForceTable(path, key, (), times_s, forces, tuple(sequences))


def _name(text: str, key: Key, where: str) -> str:
    if key == "time_s":
        return str(finite_number(text, key, where))
    if key == "frame":
        value = finite_number(text, key, where)
        if value != int(value) or value < 0:
            raise InputError(f"{where}: frame must be a number from 0 on, not {shorten_repr(text)}")
        return str(int(value))
    name = observation_name(text)
    if not name:
        raise InputError(f"{where}: 'file' is empty")
    return name
