"""Generated pictures of the site, rendered from the shipped profiles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities.fields import Surface
from tactile_core.views.maps import relief
from tactile_core.views.pictures import side_by_side
from tactile_sim.optics.rig import render

RIGS = ("hex_fingertip", "baxter_fingertip", "desktop_six_led", "desktop_three_colour")

_COLOURS = 3
_WIDTH_PX = 1200


def pictures() -> Iterator[tuple[str, bytes]]:
    """Yield every picture's name and its PNG."""
    for name in RIGS:
        yield f"{name}.png", _png(_rig(load_profile(name)))
    yield "presses.png", _png(_good_and_bad(load_profile("hex_fingertip_unmarked")))


def _rig(profile: Profile) -> NDArray[np.uint8]:
    """Camera image of a ball press, and its height map."""
    ball_mm = 0.3 * profile.image.width_px * profile.image.mm_per_px
    height = _surface(profile, [(0.45, 0.5)], ball_mm)
    pixels = render(profile, height, seed=1)
    scale = profile.image.mm_per_px
    drawn = relief(Surface(height.astype(np.float32), scale))
    if pixels.shape[2] == _COLOURS:
        return side_by_side([pixels, drawn], ["camera image", "height map"])
    lights = [np.repeat(pixels[..., k : k + 1], _COLOURS, axis=2) for k in range(pixels.shape[2])]
    rows = [np.hstack(lights[i : i + _COLOURS]) for i in range(0, len(lights), _COLOURS)]
    return side_by_side([np.vstack(rows), drawn], ["one exposure per light", "height map"])


def _good_and_bad(profile: Profile) -> NDArray[np.uint8]:
    """Presses that suit a calibration, and presses that are excluded or contribute little."""
    cases = {
        "good: complete, single": [(0.4, 0.5)],
        "truncated by the border": [(0.02, 0.5)],
        "two contacts": [(0.22, 0.5), (0.78, 0.5)],
    }
    views = [render(profile, _surface(profile, at, 4.0), seed=1) for at in cases.values()]
    return side_by_side(views, list(cases))


def _surface(
    profile: Profile, at: Sequence[tuple[float, float]], ball_mm: float
) -> NDArray[np.float64]:
    """(H, W) height map of balls at these fractions of the image, mm."""
    image = profile.image
    shape = (image.height_px, image.width_px)
    presses = [
        BallPress((x * image.width_px, y * image.height_px), ball_mm, 0.2 * ball_mm) for x, y in at
    ]
    return np.asarray(
        np.max([press.height_mm(shape, image.mm_per_px) for press in presses], axis=0)
    )


def _png(picture: NDArray[np.uint8]) -> bytes:
    """Encode an (H, W, 3) picture as PNG, at most as wide as a page."""
    height, width = picture.shape[:2]
    if width > _WIDTH_PX:
        size = (_WIDTH_PX, round(height * _WIDTH_PX / width))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    return bytes(cv2.imencode(".png", picture[..., ::-1])[1].tobytes())
