"""Small line plots as SVG, for pages of the documentation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, MARGIN = 300, 190, 46


@dataclass(frozen=True)
class Curve:
    """A line through points; a curve without a name is not in the legend."""

    name: str
    colour: str
    x: np.ndarray
    y: np.ndarray
    dashed: bool = False


@dataclass
class Panel:
    """One small plot."""

    title: str
    across: tuple[str, float, float]
    up: tuple[str, float, float]
    bands: list[tuple[float, float, str]] = field(default_factory=list)
    curves: list[Curve] = field(default_factory=list)

    def svg(self, left: float, top: float) -> str:
        """Return the plot as SVG, with its upper left corner at this position."""
        (x_name, x0, x1), (y_name, y0, y1) = self.across, self.up

        def place(x: np.ndarray, y: np.ndarray) -> str:
            px = left + MARGIN + (x - x0) / (x1 - x0) * WIDTH
            py = top + HEIGHT + 24 - (y - y0) / (y1 - y0) * HEIGHT
            return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(px, py, strict=True))

        box = place(np.array([x0, x1, x1, x0]), np.array([y0, y0, y1, y1]))
        parts = [f'<polygon points="{box}" fill="white" stroke="#888"/>']
        for low, high, colour in self.bands:
            band = place(np.array([x0, x1, x1, x0]), np.array([low, low, high, high]))
            parts.append(f'<polygon points="{band}" fill="{colour}" opacity="0.15"/>')
        for curve in self.curves:
            line = f'fill="none" stroke="{curve.colour}" stroke-width="1.6"'
            line += ' stroke-dasharray="5 4"' if curve.dashed else ""
            parts.append(f'<polyline points="{place(curve.x, curve.y)}" {line}/>')
        for number, curve in enumerate(curve for curve in self.curves if curve.name):
            row = top + 40 + 14 * number
            at = f'x="{left + MARGIN + 8}" y="{row}" fill="{curve.colour}"'
            parts.append(f"<text {at}>{curve.name}</text>")
        foot = top + HEIGHT + 38
        parts += [
            f'<text x="{left + MARGIN}" y="{top + 16}" font-weight="bold">{self.title}</text>',
            f'<text x="{left + MARGIN}" y="{foot}">{x0:g}</text>',
            f'<text x="{left + MARGIN + WIDTH}" y="{foot}" text-anchor="end">{x1:g}</text>',
            f'<text x="{left + MARGIN + 150}" y="{foot}" text-anchor="middle">{x_name}</text>',
            f'<text x="{left + MARGIN - 4}" y="{foot - 16}" text-anchor="end">{y0:g}</text>',
            f'<text x="{left + MARGIN - 4}" y="{top + 34}" text-anchor="end">{y1:g}</text>',
            f'<text text-anchor="middle" transform="translate({left + 14} {top + HEIGHT / 2 + 24}) '
            f'rotate(-90)">{y_name}</text>',
        ]
        return "\n".join(parts)


def write_sheet(path: Path, panels: Sequence[Panel], columns: int) -> None:
    """Write plots as a grid with this number of columns."""
    across, down = WIDTH + MARGIN + 24, HEIGHT + 56
    rows = -(-len(panels) // columns)
    drawn = [p.svg(across * (i % columns), down * (i // columns)) for i, p in enumerate(panels)]
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {columns * across} {rows * down}" '
        f'font-family="sans-serif" font-size="11">\n'
        f'<rect width="100%" height="100%" fill="#fcfcfa"/>\n' + "\n".join(drawn) + "\n</svg>\n"
    )
