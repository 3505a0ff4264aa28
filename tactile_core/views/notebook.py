"""A measurement in a notebook: its picture and a small table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tactile_core.quantities import Frame
from tactile_core.quantities.layers import Layer
from tactile_core.views.html import figure, paragraph, table
from tactile_core.views.pictures import picture_of, points_on_frame

_DIGITS = 4  # Significant digits of a number in the table


def notebook_html(
    frame: Frame, layers: Sequence[Layer], line: Mapping[str, Any], warnings: Sequence[str]
) -> str:
    """Return HTML for a notebook.

    Parameters
    ----------
    frame : Frame
    layers : sequence of Layer
        Of all quantities; without any, the frame itself is shown.
    line : mapping
        The line of ``tactile run --json``; values that are None are left out.
    warnings : sequence of str
    """
    picture = picture_of(frame, layers)
    if picture is None:
        picture = points_on_frame(frame, ())
    rows = list(_rows(line, ""))
    return "".join(
        [
            "<div>",
            figure(np.asarray(picture, np.uint8), frame.name),
            table(["quantity", "value"], rows),
            *map(paragraph, warnings),
            "</div>",
        ]
    )


def _rows(line: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
    """Yield names and values; those of nested mappings have the outer name in front."""
    for name, value in line.items():
        if isinstance(value, Mapping):
            yield from _rows(value, f"{prefix}{name} ")
        elif value is not None and name not in ("source", "warnings"):
            number = isinstance(value, float)
            yield f"{prefix}{name}", f"{value:.{_DIGITS}g}" if number else str(value)
