import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.virtual_rigs import QUIET, SHAPE, level, rig, slope

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.gel import LightBuild
from tactile_core.interfaces.illumination import Exposure, Illumination, Light
from tactile_sim.optics import Faults, RigOptics
from tactile_sim.optics.lights import LedArray, led_arrays_of, light_field

SCALE_MM = 0.05


def led_array(*, distance_mm: float = 30.0, azimuth_deg: float = 0.0, **build: object) -> LedArray:
    return LedArray("one", azimuth_deg, 30.0, distance_mm, (), LightBuild.model_validate(build))


def strength(one: LedArray, **options: object) -> np.ndarray:
    field = light_field(one, (200, 200), mm_per_px=SCALE_MM, **options)  # type: ignore[arg-type]
    return np.asarray(np.linalg.norm(field, axis=0))


def test_light_falls_with_the_square_of_the_distance() -> None:
    # With a lobe of almost 180° the irradiance depends on 1/r² alone.
    one = led_array(lobe_deg=179.0)
    found = strength(one)[100, ::20]
    x = (np.arange(200)[::20] - 99.5) * SCALE_MM
    far = np.linalg.norm(one.leds_mm[0] - np.stack([x, 0 * x + 0.025, 0 * x], 1), axis=1)
    np.testing.assert_allclose(found * far**2, np.mean(found * far**2), rtol=0.06)


@given(azimuth=st.floats(-180, 180))
def test_light_comes_from_its_direction(azimuth: float) -> None:
    field = light_field(led_array(azimuth_deg=azimuth), (64, 64), mm_per_px=0.05)
    x, y, up = field[:, 31:33, 31:33].mean((1, 2))
    turn = np.degrees(np.arctan2(y, x)) - azimuth
    assert abs((turn + 180) % 360 - 180) < 1
    assert np.degrees(np.arctan2(up, np.hypot(x, y))) == pytest.approx(30, abs=1)


def test_a_narrow_lobe_that_aims_beyond_the_middle_lights_the_far_side() -> None:
    near, far = (strength(led_array(lobe_deg=20.0, aim_mm=aim))[100] for aim in (0.0, 10.0))
    assert np.argmax(near) > np.argmax(far)


def test_scatter_makes_the_light_uniform() -> None:
    spread = [strength(led_array(scatter=share)).std() for share in (0.0, 0.5, 1.0)]
    assert spread[0] > spread[1] > spread[2]
    assert spread[2] < 1e-6


def test_a_gel_that_faces_the_light_is_brightest() -> None:
    # A slope of 60° faces a light at 30° of elevation; other slopes are darker.
    optics = RigOptics(
        rig(elevation_deg=30, optics={"sensor": QUIET | {"exposure": 0.1}, "ambient": 0.0})
    )
    middle = (slice(50, 70), slice(70, 90))
    seen = [
        optics.expose(-slope(x=float(np.tan(np.radians(tilt)))))[middle].mean()
        for tilt in (30, 45, 60, 75)
    ]
    assert int(np.argmax(seen)) == 2


def test_a_rig_without_light_directions_gets_evenly_spaced_lights() -> None:
    profile = rig(image={"color": "rgb", "bit_depth": 8}).model_copy()
    data = profile.model_dump(by_alias=True) | {"illumination": {"use": "core.constant"}}
    optics = RigOptics(type(profile).model_validate(data))
    frame = optics.expose(level())
    assert frame.shape == (*SHAPE, 3)
    assert len({tuple(np.unravel_index(frame[..., k].argmax(), SHAPE)) for k in range(3)}) == 3


def test_a_light_may_override_its_led_array() -> None:
    class Near(Illumination):
        channels = ("x", "y", "z")
        lights = (Light("a", 0.0, 30.0, ("x", "y"), LightBuild(distance_mm=7.0)),)

        def exposures(self) -> tuple[Exposure, ...]:
            return (Exposure({"a": 1.0}, self.channels),)

    (one,) = led_arrays_of(rig(optics={"lights": {"array": (2, 4)}}), Near(Options()))
    assert one.build.array == (2, 4)
    assert (one.distance_mm, one.feeds, one.build.lobe_deg) == (7.0, ("x", "y"), 120.0)


def test_a_dead_light_is_dark_and_the_others_are_unchanged() -> None:
    profile = rig((0.0, 120.0, 240.0), in_turn=True, optics={"sensor": QUIET})
    whole, dead = (
        RigOptics(profile, faults=faults).expose(level(), frame=3)
        for faults in (Faults(), Faults(dim_lights={"led1": 0.0}))
    )
    assert dead[..., 1].max() == 0
    np.testing.assert_array_equal(dead[..., ::2], whole[..., ::2])
