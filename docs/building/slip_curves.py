"""Draw the curves of slip.md: python docs/building/slip_curves.py."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from diagrams import Curve, Panel, write_sheet
from virtual_gel_curves import COLOURS

from experiments.slip_sequences import GROSS, Judged, Plan, judged

OUT = Path(__file__).parents[1] / "images" / "slip.svg"
STATES = {"stick": 0.0, "incipient": 0.5, "slip": 1.0}


def key_height_mm() -> np.ndarray:
    """Height map of a key's blade, 8 × 22 mm at 0.1 mm per pixel, with two grooves and a rim."""
    key = np.zeros((220, 80), np.float32)
    key[:, 24:32] = -0.25
    key[:, 48:54] = -0.15
    key[:, :4] = key[:, -4:] = 0.05
    return key


CAN = Plan(
    "can",
    "cylinder",
    {"diameter_mm": 66.0, "length_mm": 40.0},
    friction=0.5,
    depth_mm=0.2,
    press_frames=3,
    place_mm=(0.0, 0.0),
    angle_deg=90.0,
    turned=False,
    step=0.025,
    direction_rad=np.pi / 2,
    speed_mm_s=None,
    seed=1,
)
KEY = replace(
    CAN,
    kind="key",
    shape="heightmap",
    options={"height_mm": key_height_mm(), "mm_per_px": 0.1},
    friction=0.4,
    angle_deg=0.0,
    depth_mm=0.25,
)
GRASPS: dict[str, tuple[Plan, tuple[float, float], str]] = {
    "A can is pulled": (CAN, (4.0, 6.5), "cylinder"),
    "A key is pulled": (KEY, (4.5, 6.0), "plate"),
    "A can is twisted": (replace(CAN, turned=True, step=0.4), (4.0, 6.5), "ball"),
}


def panel(title: str, run: Judged, band: tuple[float, float], colour: str) -> Panel:
    """Entropy over the motion, with the paper's band, the true stick share and the state."""
    moved = abs(run.plan.step) * np.arange(1, len(run.states) + 1)
    unit = "degrees" if run.plan.turned else "mm"
    entropy = np.array([state.entropy_bits or 0.0 for state in run.states])
    state = np.array([STATES[one.state] for one in run.states])
    drawn = Panel(
        title,
        (f"object motion, {unit}", 0.0, float(moved[-1])),
        ("bits", 0.0, 8.0),
        [(*band, COLOURS[colour])],
    )
    drawn.curves.append(Curve("entropy, bits", COLOURS[colour], moved, entropy))
    drawn.curves.append(Curve("8 × stick share (truth)", "#888888", moved, 8 * run.stick_share))
    drawn.curves.append(Curve("8 × degree", "#c8a03d", moved, 8 * run.degree))
    drawn.curves.append(Curve("state: stick, incipient, slip", "#222222", moved, 8 * state))
    return drawn


def summary(title: str, run: Judged, band: tuple[float, float]) -> str:
    """Describe the motion at which each event occurs."""
    unit = "°" if run.plan.turned else "mm"
    entropy = np.array([state.entropy_bits or 0.0 for state in run.states])
    states = np.array([state.state for state in run.states])

    def when(happens: np.ndarray) -> str:
        return (
            f"{abs(run.plan.step) * (np.argmax(happens) + 1):.3g} {unit}" if any(happens) else "–"
        )

    return (
        f"{title}: entropy in the band {when(entropy >= band[0])}, incipient slip reported "
        f"{when(states == 'incipient')}, half sticks {when(run.stick_share < 0.5)}, slip reported "
        f"{when(states == 'slip')}, gross slip {when(run.stick_share < GROSS)}, entropy then "
        f"{entropy[np.argmax(run.stick_share < GROSS)]:.1f}, kind {run.states[-1].kind}"
    )


def main() -> None:
    """Draw all panels and print a summary of each."""
    panels = []
    for title, (plan, band, colour) in GRASPS.items():
        run = judged(plan)
        print(summary(title, run, band))
        panels.append(panel(title, run, band, colour))
    write_sheet(OUT, panels, columns=len(panels))


if __name__ == "__main__":
    main()
