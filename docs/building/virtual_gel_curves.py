"""Draw the curves of virtual-gel.md: python docs/building/virtual_gel_curves.py."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from diagrams import Curve, Panel, write_sheet

from tactile_core import load_profile
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import Indenter, make_indenter

OUT = Path(__file__).parents[1] / "images" / "virtual_gel.svg"
COLOURS = {"plate": "#1f6fb4", "cylinder": "#c8553d", "ball": "#3a8f5c"}
PRESSES: dict[str, tuple[Indenter, float, float]] = {
    "plate": (make_indenter("flat", size_mm=(40.0, 40.0)), 0.0, 45.0),
    "cylinder": (make_indenter("cylinder", diameter_mm=38.08), 90.0, 18.0),
    "ball": (make_indenter("sphere", diameter_mm=25.0), 0.0, 6.0),
}


def pressed(kind: str) -> GelSurface:
    """Return the hexagonal fingertip with an object on it."""
    indenter, angle_deg, force_n = PRESSES[kind]
    surface = GelSurface(load_profile("hex_fingertip"), "fast")
    surface.indent_with(indenter, angle_deg=angle_deg)
    surface.press(force_n=force_n)
    return surface


def sheared(kind: str) -> np.ndarray:
    """(N, 5) moved mm, force N, mean and largest displacement mm, entropy bits."""
    surface = pressed(kind)
    before, rows = surface.truth().displacement_mm, []
    for moved in 0.025 * np.arange(1, 41):
        surface.shear(dy_mm=0.025)
        truth = surface.truth()
        since = (truth.displacement_mm - before)[truth.contact]
        size = np.hypot(*since.T)
        counts = np.bincount((size * 256).astype(int))
        share = counts[counts > 0] / counts.sum()
        bits = -(share * np.log2(share)).sum()
        rows.append((moved, truth.wrench[1], since[:, 1].mean(), size.max(), bits))
    return np.array(rows)


def stepped() -> tuple[np.ndarray, np.ndarray]:
    """Time after a shear step of 0.1 mm, s, and shear force, N."""
    surface = pressed("plate")
    surface.shear(dy_mm=0.45, steps=9)
    times, forces = [0.0], [surface.wrench[1]]
    for dy, seconds in [(0.025, 0.1)] * 4 + [(0.0, 0.2)] * 10 + [(0.0, 2.0)] * 28:
        surface.shear(dy_mm=dy, seconds=seconds)
        times.append(surface.time_s)
        forces.append(surface.wrench[1])
    return np.array(times), np.array(forces)


def twisted(angle_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Distance from the middle, mm, and rotation of the gel surface relative to the plate's."""
    surface = pressed("plate")
    markers = np.stack([np.linspace(0.6, 8.6, 60), np.zeros(60)], 1)
    before = surface.carry_points(markers)
    surface.twist(angle_deg, steps=12)
    now = surface.carry_points(markers)
    angles = np.arctan2(now[:, 1], now[:, 0]) - np.arctan2(before[:, 1], before[:, 0])
    return markers[:, 0], np.degrees(angles) / angle_deg


def main() -> None:
    """Draw all panels."""
    runs = {kind: sheared(kind) for kind in PRESSES}
    moved = ("object displacement, mm", 0.0, 1.0)
    force = Panel("Shear force", moved, ("force / maximum", 0.0, 1.1))
    mean = Panel("Mean visible displacement", ("force / maximum", 0.0, 1.1), ("mm", 0.0, 0.8))
    most = Panel("Maximum displacement", moved, ("mm", 0.0, 1.0))
    bands = [(4.5, 6.0, COLOURS["plate"])]
    entropy = Panel("Entropy, with the incipient band", moved, ("bits", 0.0, 8.0), bands)
    for kind, run in runs.items():
        share = run[:, 1] / run[:, 1].max()
        force.curves.append(Curve(kind, COLOURS[kind], run[:, 0], share))
        mean.curves.append(Curve(kind, COLOURS[kind], share, run[:, 2]))
        most.curves.append(Curve(kind, COLOURS[kind], run[:, 0], run[:, 3]))
        entropy.curves.append(Curve(kind, COLOURS[kind], run[:, 0], run[:, 4]))
    step = Panel("Shear force after a step of 0.1 mm", ("s", 0.0, 60.0), ("N", 18.0, 26.0))
    step.curves.append(Curve("plate", COLOURS["plate"], *stepped()))
    radius = ("mm from the middle", 0.0, 9.0)
    twist = Panel("Rotation of the gel surface / plate", radius, ("", 0.5, 1.1))
    for angle, colour in ((0.6, COLOURS["ball"]), (4.5, COLOURS["cylinder"])):
        twist.curves.append(Curve(f"{angle:g}°", colour, *twisted(angle)))
    panels = [force, mean, most, entropy, step, twist]
    write_sheet(OUT, panels, columns=3)


if __name__ == "__main__":
    main()
