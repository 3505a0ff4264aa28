"""What virtual imprints lose while they stick: ``python benchmarks/slip_imprint_threshold.py``.

Objects are pressed, dragged and turned on the virtual fingertip. What an imprint loses while at
least half of its contact sticks comes of the skin's own strain and of the camera's noise. The most
that any of them loses would be a threshold that no recording enters; the one in use is lower, for
it was chosen on recorded lifts, some of which this one would miss.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.algorithms.markers import find_marker_diameter
from tactile_core.algorithms.slip.imprint import IMPRINT, ImprintTracker
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
RATE_HZ = 30


def main() -> None:
    """Print every sequence, and the most that any loses."""
    most = 0.0
    for number, (kind, friction, turned) in enumerate(_cases()):
        told = np.array(list(_sequence(kind, friction, turned, number)))
        sticking, lost = told[told[:, 0] >= 0.5], told[:, 1]
        here = float(sticking[:, 1].max(initial=0.0))
        most = max(most, here)
        print(
            f"{kind:10s} friction {friction:.1f} {'turned' if turned else 'sheared':8s}"
            f" sticks at the end {told[-1, 0]:.2f}, lost {lost[-1]:.2f};"
            f" lost while half or more of it stuck {here:.3f}",
            flush=True,
        )
    print(f"most while sticking {most:.3f}, to one digit {most:.1f}; in use {IMPRINT.slip_share}")


def _cases() -> Iterator[tuple[str, float, bool]]:
    for kind in OBJECTS:
        for friction in FRICTIONS:
            yield kind, friction, False
            yield kind, friction, True


def _sequence(kind: str, friction: float, turned: bool, seed: int) -> Iterator[tuple[float, float]]:
    """Share of the contact that sticks, and of the imprint that is lost, in every frame."""
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
        elif turned:
            stage.twist(TURN_DEG)
        else:
            stage.shear(0.8 * SHEAR_MM, 0.6 * SHEAR_MM)
        truth = stage.truth()
        motion = follower.update(stage.frame().pixels, truth.markers_px, number / RATE_HZ)
        # while it is pressed, what is new always sticks to where it came down
        stick = float(truth.stick[truth.contact].mean()) if number >= 4 else 1.0
        yield stick, motion.lost


if __name__ == "__main__":
    main()
