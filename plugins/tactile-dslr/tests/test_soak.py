"""A camera that is opened a thousand times leaves nothing behind."""

from __future__ import annotations

import pytest
from support.soak import Held, growth, share_of

from tactile_dslr.camera import DslrCamera, DslrOptions

CYCLES, WARM, SAMPLES = 1000, 20, 20
"""Openings; those after which caches are filled; looks at what the process holds."""

MIB = 0.5
"""What may not be lost."""

LIBRARY_KIB = 3.0
"""What gphoto2 loses by itself with each opening of its virtual camera, half of it from half of the
samples to the other."""


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.usefixtures("card")
def test_a_thousand_openings_leave_nothing() -> None:
    cycles, samples = share_of(CYCLES), []
    for number in range(WARM + cycles):
        camera = DslrCamera(DslrOptions())
        with camera:
            assert camera.read(20.0) is not None
        if number >= WARM and number % max(1, cycles // SAMPLES) == 0:
            samples.append(Held.now())
    left = growth(samples)
    print(f"\ndslr, {cycles} openings: {left}")
    assert left.threads <= 0
    assert left.files <= 0
    assert left.mib < MIB + LIBRARY_KIB * cycles / 1024
