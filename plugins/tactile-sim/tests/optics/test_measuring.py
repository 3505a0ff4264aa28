"""Calibrations on virtual presses generalise to held-out ones, with errors like real rigs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactile_core.acquisition.acquisition import average
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.algorithms.poisson import integrate
from tactile_core.calibration.presses import angles_deg
from tactile_core.conditioning.marker_finder import MarkerFinder
from tactile_core.interfaces.calibration import Press
from tactile_core.interfaces.component import Component
from tactile_core.plugins.options import calibrator_of
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame
from tactile_sim.optics import RigOptics

SCORED = 0.8


@pytest.mark.parametrize(
    ("name", "model", "normals_deg", "depth_mm"),
    [
        ("hex_fingertip", "core.lookup_table", 5.5, 0.040),
        ("hex_fingertip", "core.mlp", 3.5, 0.040),
        ("baxter_fingertip_flat", "baxter_fingertip.hue_intensity", 6.0, 0.040),
        ("baxter_fingertip_marked", "baxter_fingertip.hue_intensity", 6.0, 0.040),
        ("desktop_six_led", "desktop_six_led.photometric_stereo", 2.5, 0.015),
    ],
)
def test_held_out_presses_are_measured(
    name: str, model: str, normals_deg: float, depth_mm: float
) -> None:
    profile = load_profile(name)
    image = profile.image
    shape = (image.height_px, image.width_px)
    optics = RigOptics(profile, seed=5)
    ball_mm = 0.22 * image.width_px * image.mm_per_px
    rng = np.random.default_rng(3)

    def frame(height: np.ndarray) -> Frame:
        pixels = optics.expose(height)
        return Frame(pixels, optics.channels, image.mm_per_px, optics.full_scale)

    undeformed = average([frame(np.zeros(shape)) for _ in range(4)])
    finder = MarkerFinder.for_gel(profile, undeformed)
    if finder is not None:
        undeformed = replace(undeformed, marker_mask=finder.find(undeformed.pixels))

    def press() -> tuple[Frame, np.ndarray, np.ndarray, np.ndarray]:
        """A frame, the true height and slopes, and the scored pixels."""
        centre = rng.uniform(0.15, 0.85, 2) * shape[::-1]
        ball = BallPress(tuple(centre), ball_mm, rng.uniform(0.06, 0.12) * ball_mm)
        height = ball.height_mm(shape, image.mm_per_px)
        seen = frame(height)
        y, x = np.mgrid[: shape[0], : shape[1]]
        r_mm = np.hypot(x - centre[0], y - centre[1]) * image.mm_per_px
        inside = r_mm < SCORED * ball.contact_radius_mm
        if finder is not None:
            seen = replace(seen, marker_mask=finder.find(seen.pixels))
            inside &= ~seen.marker_mask
        slope_y, slope_x = np.gradient(height, image.mm_per_px)
        return seen, height, np.dstack([slope_x, slope_y]), inside

    samples = []
    for _ in range(12):
        seen, height, slopes, inside = press()
        at_rest = rng.random(shape) < 0.25 * inside.mean()
        rows, columns = np.nonzero(inside | (at_rest & (height < 1e-3)))
        known = slopes[rows, columns].astype(np.float32)
        samples.append(Press(seen, rows.astype(np.int32), columns.astype(np.int32), known, ""))
    component = profile.calibration if profile.calibration.use == model else Component(use=model)
    fitted = calibrator_of(component).fit(samples, undeformed)
    angles, depths = [], []
    for _ in range(4):
        seen, height, slopes, inside = press()
        measured = fitted.measure(seen, undeformed)
        found = np.stack([measured.x[inside], measured.y[inside]], 1)
        angles.append(angles_deg(found, slopes[inside]).mean())
        error = integrate(measured.x, measured.y, mm_per_px=image.mm_per_px)[inside]
        error = error - height[inside]
        depths.append(error.std())
    assert np.mean(angles) < normals_deg
    assert np.mean(depths) < depth_mm
