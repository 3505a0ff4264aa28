"""Manually labelled circles: CSV with ``file,centre_x_px,centre_y_px,contact_radius_px``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tactile_core.errors import InputError
from tactile_core.formats.cells import finite_number, observation_name, read_table
from tactile_core.formats.printable import printable

if TYPE_CHECKING:
    from tactile_core.algorithms.circles import Circle

_NUMBERS = ("centre_x_px", "centre_y_px", "contact_radius_px")  # Columns with numbers, px


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
    from tactile_core.algorithms.circles import Circle

    path = Path(path)
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
        circles[name] = Circle((x, y), radius, True, "", 1.0)
    return circles


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
