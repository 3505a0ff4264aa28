import pickle
from pathlib import Path

import numpy as np
import pytest
from support.virtual_rigs import HEIGHT, QUIET, SHAPE, WIDTH, bump, level, rig, shift, slope

import sensor_profiles
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.errors import InputError
from tactile_core.interfaces.illumination import Exposure
from tactile_core.profiles.loader import load_profile
from tactile_sim.optics import Faults, RigOptics

ROOT = Path(__file__).resolve().parents[4]
# profiles of a package are tested by its conformance test
EXAMPLES = [path for path in ROOT.glob("examples/**/*.yaml") if path.parent.name != "profiles"]
EVERY = sorted([*sensor_profiles.DIRECTORY.glob("*.yaml"), *EXAMPLES])


@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_every_profile_renders_a_press(path: Path) -> None:
    profile = load_profile(path)
    image = profile.image
    optics = RigOptics(profile, seed=1)
    shape = (image.height_px, image.width_px)
    ball_mm = 0.2 * image.width_px * image.mm_per_px
    press = BallPress((0.5 * shape[1], 0.5 * shape[0]), ball_mm, 0.15 * ball_mm)
    rest = optics.expose(np.zeros(shape))
    frame = optics.expose(press.height_mm(shape, image.mm_per_px))
    assert frame.shape == (*shape, len(optics.channels))
    assert frame.dtype == (np.uint8 if image.bit_depth == 8 else np.uint16)
    assert 0.1 < rest.mean() / optics.full_scale < 0.7
    assert (rest == optics.full_scale).mean() < 0.01
    change = np.abs(frame.astype(float) - rest).mean(2)
    middle = change[
        shape[0] // 2 - 20 : shape[0] // 2 + 20, shape[1] // 2 - 20 : shape[1] // 2 + 20
    ]
    assert middle.mean() > 4 * np.median(change[: shape[0] // 10])


def test_the_same_seed_gives_the_same_frames() -> None:
    def run(seed: int) -> list[np.ndarray]:
        optics = RigOptics(
            rig((0.0, 120.0, 240.0), in_turn=True), seed=seed, faults=Faults(dust=3, drift=0.1)
        )
        return [optics.expose(bump()) for _ in range(3)]

    for a, b, other in zip(run(1), run(1), run(2), strict=True):
        np.testing.assert_array_equal(a, b)
        assert (a != other).any()


def test_a_frame_depends_on_its_number_and_not_on_earlier_frames() -> None:
    optics = RigOptics(rig(), seed=3)
    first = optics.expose(level())
    optics.expose(bump())
    np.testing.assert_array_equal(optics.expose(level(), frame=0), first)
    assert (optics.expose(level()) != first).any()


def test_it_pickles_and_continues() -> None:
    optics = RigOptics(rig(), seed=3)
    optics.expose(level())
    copy = pickle.loads(pickle.dumps(optics))
    np.testing.assert_array_equal(copy.expose(bump()), optics.expose(bump()))


def test_sequential_exposures_add_up_to_a_simultaneous_one() -> None:
    azimuths = (0.0, 120.0, 240.0)
    turn, once = (
        RigOptics(rig(azimuths, in_turn=t, optics={"sensor": QUIET})).expose(bump(), frame=0)
        for t in (True, False)
    )
    added = turn.sum(2, dtype=float)
    ratio = added / once[..., 0]
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=1e-3)


def test_an_exposure_shows_the_lights_that_are_on() -> None:
    optics = RigOptics(rig((0.0, 180.0), optics={"sensor": QUIET}))
    surface = optics.surface(level())
    left, right, both = (
        optics.photograph(surface, levels).astype(float)
        for levels in ({"led1": 1.0}, {"led0": 0.5}, {"led1": 1.0, "led0": 0.5})
    )
    np.testing.assert_allclose(left + right, both, atol=2)
    assert optics.exposures == (Exposure({"led0": 1.0, "led1": 1.0}, ("grey",)),)


def test_a_dome_is_darker_on_the_side_away_from_the_light() -> None:
    # Its border is closer to the camera: the surface beyond the apex faces the light.
    gel = {"shape": "dome", "radius_mm": 20.0}
    flat, domed = (
        RigOptics(rig(gel=g, optics={"sensor": QUIET, "lights": {"distance_mm": 500.0}})).expose(
            level()
        )[HEIGHT // 2, :, 0]
        for g in ({}, gel)
    )
    change = domed.astype(float) / flat
    assert change[5] > change[WIDTH // 2] > change[-5]


def test_a_plane_has_one_brightness_up_to_the_border() -> None:
    optics = RigOptics(rig(optics={"sensor": QUIET, "lights": {"distance_mm": 5000.0}}))
    frame = optics.expose(slope(x=-0.1, y=0.05)).astype(float)
    assert np.ptp(frame) < 0.02 * frame.mean()


def test_both_modes_agree_except_for_noise_and_penumbrae() -> None:
    profile = rig((0.0, 120.0), optics={"sensor": QUIET})
    fast, accurate = (
        RigOptics(profile, mode=mode).expose(bump(1.0)).astype(float)
        for mode in ("fast", "accurate")
    )
    assert np.abs(fast - accurate).mean() < 0.02 * accurate.mean()


def test_arrays_of_another_size_are_refused() -> None:
    optics = RigOptics(rig())
    with pytest.raises(InputError, match=r"height_mm has the shape \(3, 4\)"):
        optics.expose(np.zeros((3, 4)))
    with pytest.raises(InputError, match="displacement_mm has the shape"):
        optics.expose(level(), shift(1.0)[..., 0])
    with pytest.raises(InputError, match="height_mm has values that are not finite"):
        optics.expose(np.full(SHAPE, np.nan))


@pytest.mark.parametrize("elevation", [0.0, 1.0, 89.0, 90.0])
@pytest.mark.parametrize("coating", ["matte", "semi_specular"])
def test_lights_may_have_any_elevation(elevation: float, coating: str) -> None:
    profile = rig((0.0, 120.0), elevation_deg=elevation, gel={"coating": coating})
    frame = RigOptics(profile).expose(bump())
    assert frame.max() > 0


def coloured_lights(**sensor: float) -> RigOptics:
    """Return a rig of three colours that are lit one after another."""
    lights = [
        {"name": name, "color": name, "azimuth_deg": azimuth, "elevation_deg": 25}
        for name, azimuth in (("red", 0), ("green", 120), ("blue", 240))
    ]
    overrides = {
        "illumination": {"use": "core.sequential", "lights": lights},
        "optics": {"sensor": {"jpeg_quality": "none", **sensor}},
    }
    return RigOptics(load_profile("hex_fingertip_unmarked", sim=True, overrides=overrides))


def test_a_coloured_light_alone_is_in_its_own_colour_and_leaks_into_the_others() -> None:
    still = np.zeros((480, 640))
    clean, leaking = (coloured_lights(crosstalk=share) for share in (0.0, 0.3))
    for number, image in enumerate(clean.take_images(still)):
        others = np.delete(np.median(image, axis=(0, 1)), number)
        assert np.median(image[..., number]) > 80
        assert others.max() < 15  # read noise
    for number, image in enumerate(leaking.take_images(still)):
        others = np.delete(np.median(image, axis=(0, 1)), number)
        assert 20 < others.min() < np.median(image[..., number])


def test_the_channels_of_coloured_lights_are_those_of_the_lights() -> None:
    optics = coloured_lights()
    images = optics.take_images(np.zeros((480, 640)), frame=3)
    pixels = optics.expose(np.zeros((480, 640)), frame=3)
    assert optics.channels == ("red", "green", "blue")
    for number, image in enumerate(images):
        np.testing.assert_array_equal(pixels[..., number], image[..., number])
