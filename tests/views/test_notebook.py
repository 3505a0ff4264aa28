"""What a notebook shows of a reading."""

from __future__ import annotations

import base64
import re
from dataclasses import replace

import cv2
import numpy as np
from support.readings import contact, height, markers, reading

from tactile_core.quantities import SlipState


def shown(html: str) -> np.ndarray:
    (encoded,) = re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    return cv2.imdecode(np.frombuffer(base64.b64decode(encoded), np.uint8), cv2.IMREAD_COLOR)


def test_a_reading_shows_its_picture_and_its_numbers() -> None:
    taken = reading(height(0.25), contact(), markers(), SlipState("stick", 0.5))
    html = taken._repr_html_()
    assert shown(html).ndim == 3
    assert "<td>max_height_mm</td><td>0.25</td>" in html
    assert "<td>slip state</td><td>stick</td>" in html
    assert "None" not in html


def test_without_quantities_the_frame_is_shown() -> None:
    assert shown(reading()._repr_html_()).size


def test_text_from_files_cannot_become_markup() -> None:
    taken = replace(reading(source="<script>alert(1)</script>"), warnings=("a < b",))
    html = taken._repr_html_()
    assert "<script>" not in html
    assert "a &lt; b" in html
