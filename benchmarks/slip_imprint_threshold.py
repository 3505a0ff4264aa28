"""Loss of virtual imprints during stick: ``python benchmarks/slip_imprint_threshold.py``.

Objects are pressed, sheared and twisted on the virtual fingertip. The loss of an imprint while at
least half of its contact sticks is due to strain of the gel surface and camera noise. The largest
such loss would be a threshold without any recording. The threshold in use is lower: it is chosen on
recorded lifts, some of which the larger one would miss.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.algorithms.markers import find_marker_diameter
from tactile_core.algorithms.slip.imprint_tracker import IMPRINT, ImprintTracker
from tactile_core.sim.stage import VirtualStage

PROFILE = "hex_fingertip"
OBJECTS = {
    "sphere": (0.4, {"diameter_mm": 8.0}),
    "cylinder": (0.3, {"diameter_mm": 8.0}),
    "coin": (0.15, {}),
    "letters": (0.15, {}),
    "cloth": (0.2, {}),
    "screw": (0.3, {}),
}
FRICTIONS = (0.3, 0.6, 1.2, 3.0)
SHEAR_MM, TURN_DEG, INCREMENTS = 0.05, 1.0, 16
"""Shear in mm and rotation in degrees per frame, and number of such frames."""
RATE_HZ = 30


def main() -> None:
    """Print every sequence, and the largest loss of all."""
    largest = 0.0
    for number, (kind, friction, twisted) in enumerate(_cases()):
        values = np.array(list(_sequence(kind, friction, twisted, number)))
        sticking, lost = values[values[:, 0] >= 0.5], values[:, 1]
        loss = float(sticking[:, 1].max(initial=0.0))
        largest = max(largest, loss)
        print(
            f"{kind:10s} friction {friction:.1f} {'twisted' if twisted else 'sheared':8s}"
            f" final stick share {values[-1, 0]:.2f}, final loss {lost[-1]:.2f};"
            f" largest loss while at least half sticks {loss:.3f}",
            flush=True,
        )
    print(f"largest loss {largest:.3f}, to one digit {largest:.1f}; in use {IMPRINT.slip_share}")


def _cases() -> Iterator[tuple[str, float, bool]]:
    for kind in OBJECTS:
        for friction in FRICTIONS:
            yield kind, friction, False
            yield kind, friction, True


def _sequence(
    kind: str, friction: float, twisted: bool, seed: int
) -> Iterator[tuple[float, float]]:
    """Stick share of the contact and lost share of the imprint in every frame."""
    stage = VirtualStage(PROFILE, seed=seed, overrides={"gel": {"friction": friction}})
    pixels, markers_px = stage.frame().pixels, stage.truth().markers_px
    found = find_marker_diameter(pixels)
    if found is None:
        raise SystemExit(f"{PROFILE} shows no markers")
    follower = ImprintTracker(pixels, markers_px, found[0])
    depth_mm, options = OBJECTS[kind]
    stage.indenter(kind, **options)
    for number in range(4 + INCREMENTS):
        if number < 4:
            stage.press(depth_mm * (number + 1) / 4)
        elif twisted:
            stage.twist(TURN_DEG)
        else:
            stage.shear(0.8 * SHEAR_MM, 0.6 * SHEAR_MM)
        truth = stage.truth()
        motion = follower.update(stage.frame().pixels, truth.markers_px, number / RATE_HZ)
        # during the press, new contact always sticks where it first touches
        stick = float(truth.stick[truth.contact].mean()) if number >= 4 else 1.0
        yield stick, motion.lost


if __name__ == "__main__":
    main()
