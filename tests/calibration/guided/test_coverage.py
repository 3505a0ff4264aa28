"""Coverage says what presses cover, and asks for what they do not."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.circles.circle import Circle
from tactile_core.calibration.guided.coverage import COVERAGE, Coverage, Target

SIZE, BALL_PX = (320, 240), 35.0


def led(count: int) -> tuple[Coverage, list[Circle], list[Target]]:
    """Press exactly where asked."""
    coverage, kept, targets = Coverage(SIZE, BALL_PX), list[Circle](), list[Target]()
    for _ in range(count):
        targets.append(coverage.target(kept))
        kept.append(Circle(targets[-1].centre_px, targets[-1].contact_radius_px))
    return coverage, kept, targets


def test_the_first_press_is_in_the_middle() -> None:
    (first,) = led(1)[2]
    assert np.allclose(first.centre_px, (160, 120), atol=8)


def test_every_target_leaves_its_circle_whole() -> None:
    for (x, y), radius in led(24)[2]:
        assert radius <= x <= SIZE[0] - 1 - radius
        assert radius <= y <= SIZE[1] - 1 - radius


def test_presses_where_asked_cover_the_surface_and_the_slopes() -> None:
    coverage, kept, _ = led(COVERAGE.presses)
    assert coverage.is_complete(kept)
    assert not coverage.is_complete(kept[:8])
    covered = [float(coverage.surface(kept[:n]).mean()) for n in range(25)]
    assert covered == sorted(covered)
    assert coverage.slopes(kept).min() > 0


def test_contacts_of_all_sizes_are_asked_for() -> None:
    shares = {round(target.contact_radius_px / BALL_PX, 2) for target in led(6)[2]}
    assert shares == set(COVERAGE.contacts)


def test_light_presses_do_not_cover_steep_slopes() -> None:
    coverage = Coverage(SIZE, BALL_PX)
    light = [Circle((160.0, 120.0), 0.3 * BALL_PX)] * 5
    by_ring = coverage.slopes(light).max(axis=1)
    assert by_ring[0] == 1
    assert by_ring[-1] == 0


def test_another_place_is_asked_for_where_presses_fail() -> None:
    coverage, kept, _ = led(5)
    failed = coverage.target(kept)
    other = coverage.target(kept, [failed])
    assert np.hypot(*np.subtract(other.centre_px, failed.centre_px)) > BALL_PX
