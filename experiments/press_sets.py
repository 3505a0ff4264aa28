"""Recordings of ball presses, one set per sensor."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HERE = Path(__file__).resolve().parent / "profiles"


@dataclass(frozen=True)
class Presses:
    """Recordings of one ball pressed on one sensor."""

    name: str
    profile: Path
    folder: str
    pattern: str
    reference: str
    ball_mm: float
    what: str


SETS = (
    Presses(
        "objectfolder",
        ROOT / "examples" / "objectfolder.yaml",
        "three_colour/objectfolder",
        "presses/*.png",
        "reference.png",
        4.0,
        "three simultaneous colours, no markers",
    ),
    Presses(
        "wedge",
        ROOT / "examples" / "wedge" / "wedge.yaml",
        "three_colour/wedge",
        "ball-*.jpg",
        "bg-0.jpg",
        4.84,
        "three simultaneous colours, markers",
    ),
    Presses(
        "gelsight_mini",
        HERE / "gelsight_mini.yaml",
        "gelsight_mini/ball_presses",
        "press_*.png",
        "background.png",
        6.31,
        "three simultaneous colours, no markers",
    ),
    Presses(
        "hex_fingertip",
        HERE / "hex_recorded.yaml",
        "three_colour/hex_fingertip",
        "Im_*.jpg",
        "frame0.jpg",
        3.96,
        "three simultaneous colours, markers",
    ),
)
