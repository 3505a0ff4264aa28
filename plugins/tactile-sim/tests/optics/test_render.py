import numpy as np
from support.virtual_lab import VirtualLab

from tactile_sim.optics.rig import render


def test_images_are_reproducible_by_seed(lab: VirtualLab) -> None:
    flat = np.zeros((120, 160))
    same = [render(lab.profile, flat, seed=4) for _ in range(2)]
    np.testing.assert_array_equal(*same)
    assert (same[0] != render(lab.profile, flat, seed=5)).any()


def test_a_surface_that_faces_a_light_is_brighter_in_its_colour(lab: VirtualLab) -> None:
    # Red comes from azimuth 90°, the bottom: a surface that descends towards +y faces it.
    y = np.arange(120)[:, None] * lab.profile.image.mm_per_px * np.ones(160)
    flat, facing = (render(lab.profile, s * y)[..., 0].mean() for s in (0.0, -0.2))
    assert facing > flat
