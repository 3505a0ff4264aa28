"""The twin of a recorded press beside the recording: statistics and shading, within a quarter.

Only what belongs to that one unit is told: its scale, its marks and where its lamps stand.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_core.formats.target import read_target
from tactile_core.profiles.loader import load_profile
from tactile_core.sim.ball import BallPress
from tactile_core.sim.optics import RigOptics

QUARTER = 0.25

HEX_AZIMUTHS_DEG = {"red": 67.3, "green": -177.6, "blue": -59.7}
"""As a calibration with the two presses learns them."""
HEX_MM_PER_PX, HEX_BALL_MM = 0.03026, 3.96
HEX_PRESSES = {
    "Im_235_1336917.jpg": ((317.6, 252.0), 48.9),
    "Im_335_1337253.jpg": ((421.2, 107.9), 45.8),
}

GRID_AZIMUTHS_DEG = (-90, -151, 150, 91, 32, -29)
GRID_ELEVATION_DEG = 56
"""The brightest slope of the recorded balls, 35°, is as far from level as this from the zenith."""
GRID_MM_PER_PX = 0.0136152


def near(virtual: np.ndarray, real: np.ndarray, share: float = QUARTER) -> None:
    np.testing.assert_allclose(virtual / real, 1, atol=share)


def along(image: np.ndarray, centre: tuple[float, float], azimuth: float, reach_px: float):
    """(N,) intensities on a line through a ball towards a lamp, from one side to the other."""
    way = np.linspace(-1.3, 1.3, 27) * reach_px
    x = centre[0] + way * np.cos(np.radians(azimuth))
    y = centre[1] + way * np.sin(np.radians(azimuth))
    smooth = cv2.GaussianBlur(cv2.medianBlur(image.astype(np.float32), 5), (0, 0), reach_px / 15)
    at = x[None].astype(np.float32), y[None].astype(np.float32)
    return cv2.remap(smooth, *at, cv2.INTER_LINEAR)[0]


def bare(*images: np.ndarray) -> np.ndarray:
    """(H, W) bool: skin that carries a mark in none of the images."""
    marked = np.zeros(images[0].shape[:2], bool)
    for image in images:
        grey = cv2.GaussianBlur(image.mean(2).astype(np.float32), (0, 0), 1)
        dark = (cv2.blur(grey, (41, 41)) - grey > 20).astype(np.uint8)
        marked |= cv2.dilate(dark, np.ones((9, 9), np.uint8)) > 0
    return ~marked


@pytest.mark.recordings
def test_the_three_colour_fingertip(recordings: Path) -> None:
    folder = recordings / "three_colour" / "hex_fingertip"
    lights = [
        {"name": name, "azimuth_deg": azimuth, "elevation_deg": 19}
        for name, azimuth in HEX_AZIMUTHS_DEG.items()
    ]
    profile = load_profile(
        "hex_fingertip",
        overrides={
            "image": {"mm_per_px": HEX_MM_PER_PX},
            "gel": {"markers": {"pitch_mm": 1.71, "diameter_mm": 0.43}},
            "illumination": {"lights": lights},
        },
    )
    optics = RigOptics(profile, seed=3, mode="accurate")
    rest = optics.expose(np.zeros((480, 640))).astype(float)
    real_rest = cv2.imread(str(folder / "frame0.jpg"))[..., ::-1].astype(float)
    near(rest.mean((0, 1)), real_rest.mean((0, 1)))
    near(rest.std((0, 1)), real_rest.std((0, 1)))
    for name, (centre, contact_px) in HEX_PRESSES.items():
        real = cv2.imread(str(folder / name))[..., ::-1].astype(float)
        radius = HEX_BALL_MM / 2
        depth = radius - np.sqrt(radius**2 - (contact_px * HEX_MM_PER_PX) ** 2)
        press = BallPress(centre, HEX_BALL_MM, float(depth))
        seen = optics.expose(press.height_mm((480, 640), HEX_MM_PER_PX)).astype(float)
        # The ball model moves no marks, so they are left out; one channel may be off by a third.
        change = (seen - rest)[bare(seen, rest)].std(0)
        real_change = (real - real_rest)[bare(real, real_rest)].std(0)
        near(change.mean(), real_change.mean())
        near(change, real_change, share=0.35)
        for k, azimuth in enumerate(HEX_AZIMUTHS_DEG.values()):
            virtual_line, real_line = (
                along(difference[..., k], centre, azimuth, contact_px)
                for difference in (seen - rest, real - real_rest)
            )
            near(np.ptp(virtual_line), np.ptp(real_line))
            assert np.corrcoef(virtual_line, real_line)[0, 1] > 0.95


@pytest.mark.recordings
def test_the_six_lamps_over_a_grid_of_balls(recordings: Path) -> None:
    folder = recordings / "six_led" / "ball_grid"

    def recorded(scan: str) -> np.ndarray:
        paths = sorted((folder / scan).glob("image*.png"))
        images = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in paths]
        return np.dstack(
            [cv2.resize(i, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA) for i in images]
        ).astype(float)

    real, real_rest = recorded("BGA-001"), recorded("Flat-001")
    grid = read_target(folder / "BGA-001" / "bgatarget.yaml")
    centres = (np.asarray(grid.centres_px) - 1.5) / 4
    lights = [
        {"name": f"lamp{k}", "azimuth_deg": azimuth, "elevation_deg": GRID_ELEVATION_DEG}
        for k, azimuth in enumerate(GRID_AZIMUTHS_DEG)
    ]
    profile = load_profile(
        "desktop_six_led",
        overrides={"image": {"mm_per_px": GRID_MM_PER_PX}, "illumination": {"lights": lights}},
    )
    optics = RigOptics(profile, seed=3, mode="accurate")
    shape = real.shape[:2]
    height = np.zeros(shape)
    for x, y in centres:
        press = BallPress((x, y), 2 * grid.radius_mm, 0.5 * grid.radius_mm)
        height = np.maximum(height, press.height_mm(shape, GRID_MM_PER_PX))
    rest, seen = (optics.expose(h).astype(float) for h in (np.zeros(shape), height))
    near(rest.mean((0, 1)), real_rest.mean((0, 1)))
    near(rest.std((0, 1)), real_rest.std((0, 1)))
    near((seen - rest).std((0, 1)), (real - real_rest).std((0, 1)))
    reach_px = grid.radius_mm / GRID_MM_PER_PX
    whole = [c for c in centres if 40 < c[0] < shape[1] - 40 and 40 < c[1] < shape[0] - 40]
    for k, azimuth in enumerate(GRID_AZIMUTHS_DEG):
        virtual_line, real_line = (
            np.median([along(image[..., k], c, azimuth, reach_px) for c in whole], axis=0)
            for image in (seen / rest, real / real_rest)
        )
        # Within the ball; what the skin does around it is mechanics.
        inside = slice(5, 22)
        near(np.ptp(virtual_line[inside]), np.ptp(real_line[inside]))
        assert np.corrcoef(virtual_line[inside], real_line[inside])[0, 1] > 0.95
