"""HTML pages, and quantities in notebooks."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.formats.files import plain_text
from tactile_core.quantities import Frame
from tactile_core.quantities.fields import Layer
from tactile_core.views.maps import Overlay
from tactile_core.views.pictures import draw_on_frame, picture_of

_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;
color:#1c2630;background:#fbfbfa}
h1{font-size:1.6rem}h2{font-size:1.15rem;margin-top:2rem}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
td,th{padding:.25rem .8rem;border-bottom:1px solid #ddd;text-align:left}
figure{display:inline-block;margin:.5rem 1rem .5rem 0;vertical-align:top}
img{max-width:100%;border:1px solid #ddd}figcaption{color:#56616b;font-size:.9rem}
.row{display:grid;grid-template-columns:repeat(4,1fr);gap:1rem;
margin:1rem calc(50% - min(48vw,52rem))}
.row figure{margin:0}
"""
"""CSS of every page."""


def page(title: str, parts: Sequence[str]) -> str:
    """Return a complete HTML document that can be encoded as UTF-8."""
    return plain_text(
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}'
        f"</title><style>{_STYLE}</style></head><body><h1>{escape(title)}</h1>"
        f"{''.join(parts)}</body></html>\n"
    )


def heading(text: str) -> str:
    """Return the heading of a section."""
    return f"<h2>{escape(text)}</h2>"


def paragraph(text: str) -> str:
    """Return a paragraph of plain text."""
    return f"<p>{escape(text)}</p>"


def table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table; cells are escaped."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def row(figures: Sequence[str]) -> str:
    """Return figures side by side, four per line; a line is as wide as the window."""
    return f'<div class="row">{"".join(figures)}</div>'


def figure(rgb: NDArray[np.uint8], caption: str, *, photo: bool = False) -> str:
    """Return a picture with its caption, embedded as PNG or, for a photo, as the smaller JPEG."""
    import cv2

    # [%] of photos
    kind, options = ("jpeg", [cv2.IMWRITE_JPEG_QUALITY, 90]) if photo else ("png", [])
    _, encoded = cv2.imencode(f".{kind}", np.ascontiguousarray(rgb[..., ::-1]), options)
    data = base64.b64encode(encoded.tobytes()).decode()
    return (
        f'<figure><img src="data:image/{kind};base64,{data}" alt="{escape(caption)}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


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
        picture = draw_on_frame(frame, Overlay())
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
