"""A frame that does not show the gel of the reference is recognised, and why."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core import Frame, Reference, load_profile
from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.bundles.manifest import LightRange
from tactile_core.conditioning.conditioning import DriftCompensator
from tactile_core.conditioning.gel_check import GelCheck
from tactile_core.interfaces.image import ImageSection
from tactile_sim import VirtualStage
from tactile_sim.stage import vary

RIGS = "hex_fingertip_unmarked", "desktop_six_led_portable"
SMALL = {"image": {"width_px": 320, "height_px": 240, "mm_per_px": 0.055}}
Image = NDArray[np.uint8]


@cache
def stage(rig: str, seed: int) -> VirtualStage:
    profile = load_profile(rig, sim=True, overrides=SMALL)
    return VirtualStage(vary(profile, seed) if seed else profile, seed)


@cache
def reference(rig: str) -> Reference:
    frame = rest(rig)
    return Reference(frame.pixels.astype(np.float32), frame.channels, frame.full_scale)


def response(rig: str) -> NDArray[np.float64]:
    """Change of each channel's logarithm per slope, measured under a shallow ball."""
    undeformed = reference(rig).pixels
    seen = pressed(rig, "sphere", 0.12, diameter_mm=30.0).pixels
    truth = stage(rig, 0).truth().gradients.reshape(-1, 2)
    change = np.log(np.maximum(seen, 1) / np.maximum(undeformed, 1)).reshape(len(truth), -1)
    fit, *_ = np.linalg.lstsq(np.column_stack([truth, np.ones(len(truth))]), change, rcond=None)
    return fit[:2].T


@cache
def check(rig: str) -> GelCheck:
    """The check of a calibrated unit whose light hardly changes."""
    tilt = response(rig)
    light = LightRange(
        response=tuple(map(tuple, tilt.tolist())),
        drift=((0.0, 0.0),) * (len(tilt) - 2),
        ramp=0.001,
        field=0.004,
        agreement=0.8,
    )
    return GelCheck(reference(rig), light)


def pressed(rig: str, kind: str, depth: float, seed: int = 0, **options: object) -> Frame:
    """A frame of an object pressed by a share of the gel's thickness."""
    unit = stage(rig, seed)
    unit.reset()
    unit.indenter(kind, **options)
    unit.press(depth_mm=depth * (unit.profile.gel.thickness_mm or 2.0))
    return unit.frame()


def touched(rig: str, seed: int = 0) -> Frame:
    return pressed(rig, "sphere", 0.25, seed, diameter_mm=5.0, x_mm=2.0, y_mm=1.0)


def rest(rig: str, seed: int = 0) -> Frame:
    stage(rig, seed).reset()
    return stage(rig, seed).frame()


def altered(frame: Frame, change: Callable[[Image], Image]) -> Frame:
    return replace(frame, pixels=np.ascontiguousarray(change(np.array(frame.pixels))))


def cropped(share: float) -> Callable[[Image], Image]:
    def crop(pixels: Image) -> Image:
        height, width = pixels.shape[:2]
        top, left = (round((1 - share) / 2 * size) for size in (height, width))
        shown = pixels[top : height - top, left : width - left]
        planes = [cv2.resize(plane, (width, height)) for plane in np.moveaxis(shown, 2, 0).copy()]
        return np.dstack(planes)

    return crop


def one_sided(share: float) -> Callable[[Image], Image]:
    def brighten(pixels: Image) -> Image:
        ramp = 1 + share * np.linspace(0, 1, pixels.shape[1])[:, None]
        return np.clip(np.rint(pixels * ramp), 0, 255).astype(np.uint8)

    return brighten


MISTAKES: dict[str, list[Callable[[Image], Image]]] = {
    "turned": [
        lambda p: p[::-1, ::-1],
        lambda p: np.stack(
            [cv2.resize(np.rot90(c), c.shape[::-1]) for c in np.moveaxis(p, 2, 0)], axis=-1
        ),
    ],
    "mirrored": [lambda p: p[:, ::-1], lambda p: p[::-1]],
    "cropped": [cropped(0.6), cropped(0.75), cropped(0.9)],
    "one_sided_light": [one_sided(0.06), one_sided(0.1)],
    "rolled": [lambda p: np.roll(p, 12, axis=0), lambda p: np.roll(p, -90, axis=1)],
}
COLOURED: dict[str, list[Callable[[Image], Image]]] = {
    "channels_swapped": [lambda p: p[..., ::-1], lambda p: p[..., [1, 0, 2]]],
    "grey": [lambda p: np.repeat(p.mean(axis=2, keepdims=True).astype(np.uint8), 3, axis=2)],
}


@pytest.mark.parametrize("look", [rest, touched])
@pytest.mark.parametrize(
    ("rig", "cause"),
    [(rig, cause) for rig in RIGS for cause in MISTAKES] + [(RIGS[0], cause) for cause in COLOURED],
)
def test_each_mistake_is_named(rig: str, cause: str, look: Callable[[str], Frame]) -> None:
    for change in (MISTAKES | COLOURED)[cause]:
        assert check(rig)(altered(look(rig), change)).cause == cause


@pytest.mark.parametrize("look", [rest, touched])
@pytest.mark.parametrize("rig", RIGS)
def test_another_unit_of_the_same_design_is_recognised(
    rig: str, look: Callable[[str, int], Frame]
) -> None:
    assert check(rig)(look(rig, 1)).cause == "another_unit"


@pytest.mark.parametrize("rig", RIGS)
def test_a_dark_or_unrelated_image_is_nothing_that_the_gel_can_look_like(rig: str) -> None:
    noise = np.random.default_rng(0).integers(40, 200, rest(rig).pixels.shape, dtype=np.uint8)
    noise = cv2.blur(noise[..., :3], (15, 15)) if noise.shape[2] == 3 else noise
    assert check(rig)(altered(rest(rig), np.zeros_like)).cause == "unknown"
    assert not check(rig)(altered(rest(rig), lambda _: noise)).this_gel


WIDE = (
    ("flat", 0.1, {"size_mm": (40, 40)}),
    ("flat", 0.1, {"size_mm": (8, 30), "x_mm": 5.0}),
    ("flat", 0.1, {"size_mm": (40, 5), "y_mm": 3.0}),
    ("cylinder", 0.25, {"diameter_mm": 12.0, "length_mm": 40.0, "angle_deg": 40.0}),
    ("sphere", 0.3, {"diameter_mm": 30.0}),
    ("sphere", 0.4, {"diameter_mm": 4.0}),
    ("coin", 0.1, {}),
)


@pytest.mark.parametrize(("kind", "depth", "options"), WIDE)
@pytest.mark.parametrize("rig", RIGS)
def test_no_contact_is_taken_for_a_mistake(
    rig: str, kind: str, depth: float, options: dict[str, object]
) -> None:
    shown = check(rig)(pressed(rig, kind, depth, **options))
    assert shown.this_gel
    assert shown.cause is None
    assert not shown.warnings()


@pytest.mark.parametrize("rig", RIGS)
def test_a_black_rim_is_nothing_that_a_contact_makes(rig: str) -> None:
    def smaller(pixels: Image) -> Image:
        rim = np.zeros_like(pixels)
        rim[15:-15, 20:-20] = np.stack(
            [cv2.resize(plane, (280, 210)) for plane in np.moveaxis(pixels, 2, 0)], axis=-1
        )
        return rim

    for look in (rest(rig), touched(rig)):
        assert not check(rig)(altered(look, smaller)).this_gel


def test_large_markers_that_moved_are_not_black() -> None:
    rig = RIGS[0]
    hidden = np.zeros(rest(rig).pixels.shape[:2], np.bool_)
    hidden[60:180, 60:180] = True
    dark = altered(rest(rig), lambda p: np.where(hidden[..., None], 0, p).astype(np.uint8))
    assert not check(rig)(dark).this_gel
    assert check(rig)(replace(dark, marker_mask=hidden)).this_gel


def test_a_black_reference_shows_no_gel() -> None:
    rig = RIGS[0]
    black = replace(reference(rig), pixels=np.zeros_like(reference(rig).pixels))
    assert replace(check(rig), reference=black)(rest(rig)).cause == "unknown"


@pytest.mark.parametrize("rig", RIGS)
def test_the_gain_of_a_channel_is_no_mistake(rig: str) -> None:
    gains = 1 + 0.06 * np.cos(np.arange(rest(rig).pixels.shape[2]))
    brighter = altered(rest(rig), lambda p: np.clip(p * gains, 0, 255).astype(np.uint8))
    assert check(rig)(brighter).this_gel


@pytest.mark.parametrize(
    ("gain", "shown"), [(0.95, True), (1.07, True), (0.5, False), (1.2, False)]
)
def test_more_light_than_is_compensated_is_no_light_of_the_calibration(
    gain: float, shown: bool
) -> None:
    rig = RIGS[0]
    brighter = altered(rest(rig), lambda p: np.clip(np.rint(p * gain), 0, 255).astype(np.uint8))
    conditioned = DriftCompensator(reference(rig)).compensate_frame(brighter)
    assert replace(check(rig), compensated=True)(conditioned).this_gel == shown


def test_dark_corners_of_the_reference_are_left_out() -> None:
    rig = RIGS[0]
    y, x = np.mgrid[-1:1:240j, -1:1:320j]
    vignette = (np.hypot(x, y) < 1.2)[..., None]
    dark = replace(reference(rig), pixels=reference(rig).pixels * vignette)
    seen = altered(touched(rig), lambda p: (p * vignette).astype(np.uint8))
    assert GelCheck(dark, check(rig).light)(seen).this_gel


def test_a_change_that_a_tilt_can_cause_is_none_of_the_light() -> None:
    """The same smooth change of brightness, in the direction of a tilt and across it."""
    rig = RIGS[0]
    tilt = response(rig)
    y, x = np.mgrid[-1:1:240j, -1:1:320j]
    wave = 0.04 * np.sin(2 * x + y)
    along = tilt[:, 0] / np.linalg.norm(tilt[:, 0])
    across = np.cross(tilt[:, 0], tilt[:, 1])
    across /= np.linalg.norm(across)

    def changed(direction: NDArray[np.float64]) -> Frame:
        factor = np.exp(wave[..., None] * direction)
        return altered(rest(rig), lambda p: np.clip(np.rint(p * factor), 0, 255).astype(np.uint8))

    assert check(rig)(changed(along)).this_gel
    assert check(rig)(changed(across)).cause in ("another_unit", "one_sided_light")


WARP = {
    "source": ((40.0, 20.0), (280.0, 24.0), (70.0, 200.0), (250.0, 204.0)),
    "target": ((0.0, 0.0), (320.0, 0.0), (0.0, 240.0), (320.0, 240.0)),
}


@pytest.mark.parametrize(
    ("cause", "change"),
    [
        ("turned", lambda p: p[::-1, ::-1]),
        ("mirrored", lambda p: p[::-1]),
        ("cropped", MISTAKES["cropped"][1]),
    ],
)
def test_mistakes_are_made_in_the_camera_and_seen_after_the_warp(
    cause: str, change: Callable[[Image], Image]
) -> None:
    geometry = ImageGeometry(ImageSection(width_px=320, height_px=240, mm_per_px=0.1, warp=WARP))
    y, x = np.mgrid[-1:1:240j, -1:1:320j]
    waves = [3 * x + y, 4 * y - x, 2 * x - 3 * y + x * y]
    raw = np.stack([120 + 60 * np.sin(wave) for wave in waves], axis=-1).astype(np.uint8)
    channels = "red", "green", "blue"
    undeformed = Reference(geometry.apply(raw).astype(np.float32), channels)
    shown = Frame(geometry.apply(np.ascontiguousarray(change(raw))), channels, 0.1)
    assert GelCheck(undeformed, view=geometry.view())(shown).cause == cause


def test_an_even_reference_looks_alike_whatever_was_done_to_it() -> None:
    even = Reference(np.full((120, 160, 3), 120, np.float32), ("red", "green", "blue"))
    shown = Frame(np.full((120, 160, 3), 120, np.uint8), even.channels, 0.1)
    assert GelCheck(even)(shown).this_gel


def test_an_image_of_a_few_pixels_cannot_be_compared() -> None:
    for height, width in ((1, 1), (2, 9), (5, 3)):
        tiny = Reference(np.full((height, width, 3), 90, np.float32), ("red", "green", "blue"))
        shown = Frame(np.full((height, width, 3), 90, np.uint8), tiny.channels, 0.1)
        assert GelCheck(tiny)(shown).this_gel


def test_without_a_calibration_only_plain_mistakes_are_named() -> None:
    rig = RIGS[0]
    unknown = GelCheck(reference(rig))
    assert unknown(rest(rig)).this_gel
    assert unknown(touched(rig)).this_gel
    assert unknown(altered(touched(rig), lambda p: p[..., ::-1])).cause == "channels_swapped"
