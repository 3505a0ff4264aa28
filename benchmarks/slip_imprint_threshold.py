"""Virtual imprints that stick and slip: ``python benchmarks/slip_imprint_threshold.py``.

Objects are pressed, sheared and twisted on the virtual fingertip. While at least half of a contact
sticks, its imprint moves no further than elastic deformation and uncertainty explain (``moved``
below 1). The unexplained change is larger at high friction, because the light changes as the
surface moves. After a shear, the measured distance is compared with the true one: the motion of the
object minus the mean displacement of the surface in contact.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.algorithms.markers.count import find_marker_lattice
from tactile_core.algorithms.slip.imprint_tracker import ImprintTracker
from tactile_sim.stage import VirtualStage

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
PRESSED = 6
"""Frames before the object moves, two of them at rest."""

DIRECTION = np.array([0.8, 0.6])


def main() -> None:
    """Print every sequence, and the largest values while at least half of a contact sticks."""
    largest, within, sheared = np.zeros(2), 0, 0
    for number, (kind, friction, twisted) in enumerate(_cases()):
        values = np.array(list(_sequence(kind, friction, twisted, number)))
        half = values[values[:, 0] >= 0.5, 1:3].max(axis=0, initial=0.0)
        largest = np.maximum(largest, half)
        stick, _, _, distance, std, true = values[-1]
        line = (
            f"{kind:10s} friction {friction:.1f} {'twisted' if twisted else 'sheared':8s} "
            f"final stick share {stick:.2f}; while at least half sticks, changed {half[0]:.3f}, "
            f"moved {half[1]:.2f}; distance {distance:.3f} ± {std:.3f} mm"
        )
        if not twisted:
            line += f", truly {true:.3f} mm"
            sheared, within = sheared + 1, within + (abs(distance - true) <= 2 * std)
        print(line, flush=True)
    print(
        f"while at least half sticks: changed at most {largest[0]:.3f}, moved {largest[1]:.2f}; "
        f"{within} of {sheared} distances within two standard deviations"
    )


def _cases() -> Iterator[tuple[str, float, bool]]:
    for kind in OBJECTS:
        for friction in FRICTIONS:
            yield kind, friction, False
            yield kind, friction, True


def _sequence(
    kind: str, friction: float, twisted: bool, seed: int
) -> Iterator[tuple[float, float, float, float, float, float]]:
    """Stick share, change, motion, distance in mm, its deviation, and true distance by frame."""
    stage = VirtualStage(PROFILE, seed=seed, overrides={"gel": {"friction": friction}})
    pixels, markers_px = stage.frame().pixels, stage.truth().markers_px
    found = find_marker_lattice(pixels)
    if found is None:
        raise SystemExit(f"{PROFILE} shows no markers")
    tracker = ImprintTracker(pixels, markers_px, found.diameter_px, stage.profile.image.mm_per_px)
    depth_mm, options = OBJECTS[kind]
    stage.indenter(kind, **options)
    for number in range(PRESSED):
        stage.press(depth_mm * min(number + 1, 4) / 4)
        tracker.update(stage.frame().pixels, stage.truth().markers_px, number / RATE_HZ)
    tracker.restart()
    before = stage.truth().displacement_mm
    for number in range(1, INCREMENTS + 1):
        if twisted:
            stage.twist(TURN_DEG)
        else:
            stage.shear(*(SHEAR_MM * DIRECTION))
        truth = stage.truth()
        time_s = (PRESSED + number) / RATE_HZ
        change = tracker.update(stage.frame().pixels, truth.markers_px, time_s)
        stick = float(truth.stick[truth.contact].mean())
        surface = (truth.displacement_mm - before)[truth.contact]
        slid = np.linalg.norm(number * SHEAR_MM * DIRECTION - surface, axis=1).mean()
        yield stick, change.changed, change.moved, change.distance_mm, change.distance_std_mm, slid


if __name__ == "__main__":
    main()
