import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.virtual_rigs import QUIET, level, rig

from tactile_core.errors import InputError
from tactile_sim.optics import RigOptics
from tactile_sim.optics.camera import Chip, Noise, crosstalk_matrix, vignette

WELL_E = 5000.0


def chip(**options: object) -> Chip:
    defaults = {"full_well_e": WELL_E, "read_noise_e": 0.0, "gamma": 1.0, "bit_depth": 16}
    return Chip(**(defaults | {"jpeg_quality": None} | options))  # type: ignore[arg-type]


def spread(light: float, **options: object) -> float:
    noise = np.random.default_rng(1).standard_normal((200, 200, 1), np.float32)
    pixels = chip(**options).read_out(np.full_like(noise, light), noise)
    return float(pixels.std() / (2**16 - 1))


@given(light=st.floats(0.01, 0.2))
def test_noise_grows_as_the_square_root_of_light(light: float) -> None:
    assert spread(4 * light) == pytest.approx(2 * spread(light), rel=0.01)
    assert spread(light) == pytest.approx(np.sqrt(light / WELL_E), rel=0.02)


def test_noise_without_light_is_read_noise() -> None:
    assert spread(0.01, full_well_e=1e6, read_noise_e=1000.0) == pytest.approx(1e-3, rel=0.02)


@pytest.mark.parametrize(("gamma", "bits"), [(1.0, 8), (1.0, 12), (2.2, 8), (2.2, 16)])
def test_noise_may_be_in_steps(gamma: float, bits: int) -> None:
    one = chip(gamma=gamma, bit_depth=bits, read_noise_e=10.0)
    rng = np.random.default_rng(2)
    light = rng.uniform(0, 1.1, (3, 20, 30)).astype(np.float32)
    steps = rng.integers(-127, 128, light.shape, np.int8)
    pixels = one.read_out(light, steps, -1 / 32)
    same = one.read_out(light, steps.astype(np.float32) / -32)
    assert pixels.shape == light.shape
    assert pixels.max() == 2**bits - 1
    assert (np.abs(pixels.astype(int) - same) <= 1).all()


@pytest.mark.parametrize("from_table", [True, False])
def test_noise_is_normal_although_it_is_rounded(from_table: bool) -> None:
    steps, scale = Noise(400_000, 3, from_table=from_table).draw_samples(5, 0)
    numbers = steps * scale
    assert numbers.mean() == pytest.approx(0, abs=0.01)
    assert numbers.std() == pytest.approx(1, abs=0.005)
    assert (numbers**4).mean() == pytest.approx(3, abs=0.05)
    for apart in (1, 640):
        assert abs(np.corrcoef(numbers[apart:], numbers[:-apart])[0, 1]) < 0.01


@pytest.mark.parametrize("mode", ["fast", "accurate"])
def test_the_noise_of_frames_is_independent(mode: str) -> None:
    optics = RigOptics(rig(optics={"sensor": {"full_well_e": 1000.0}}), mode=mode)  # type: ignore[arg-type]
    frames = np.array([optics.expose(level()).astype(float) for _ in range(4)])
    noise = (frames - frames.mean(0)).reshape(4, -1)
    others = np.corrcoef(noise)[~np.eye(4, dtype=bool)]
    # Subtraction of their mean gives a correlation of −1/3.
    np.testing.assert_allclose(others, -1 / 3, atol=0.05)


@pytest.mark.parametrize("mode", ["fast", "accurate"])
def test_the_noise_of_sequential_exposures_is_independent(mode: str) -> None:
    noisy, alike = {"sensor": {"full_well_e": 1000.0}}, (0.0, 0.0, 0.0)
    optics = RigOptics(rig(alike, in_turn=True, optics=noisy), mode=mode)  # type: ignore[arg-type]
    first, second, _ = optics.expose(level()).astype(float).reshape(-1, 3).T
    # the frame's own light is the same in both
    still = RigOptics(rig(alike, in_turn=True, optics={"sensor": {"full_well_e": 1e9}}))
    light = still.expose(level()).astype(float).reshape(-1, 3).T[0]
    assert abs(np.corrcoef(first - light, second - light)[0, 1]) < 0.05


@given(coded=st.floats(0.05, 0.95), gamma=st.sampled_from([1.0, 1.8, 2.2]))
def test_an_exposure_gives_the_requested_pixel_value(coded: float, gamma: float) -> None:
    one = chip(gamma=gamma, full_well_e=1e12)
    light = np.full((4, 4, 1), one.light_of(coded), np.float32)
    pixels = one.read_out(light, np.zeros_like(light))
    assert pixels.mean() / (2**16 - 1) == pytest.approx(coded, abs=0.01)


@pytest.mark.parametrize(
    ("bits", "dtype"), [(8, np.uint8), (10, np.uint16), (12, np.uint16), (16, np.uint16)]
)
def test_pixel_values_saturate_at_full_scale(bits: int, dtype: type) -> None:
    profile = rig(image={"bit_depth": bits}, optics={"sensor": {"exposure": 0.999}})
    optics = RigOptics(profile)
    frame = optics.expose(level())
    assert frame.dtype == dtype
    assert frame.max() == optics.full_scale == 2**bits - 1


def test_the_undeformed_gel_has_the_profiles_exposure() -> None:
    frame = RigOptics(rig(optics={"sensor": QUIET | {"exposure": 0.3}})).expose(level())
    assert np.median(frame) / (2**16 - 1) == pytest.approx(0.3, rel=0.01)


def test_compression_changes_little_and_needs_8_bits() -> None:
    plain, pressed = (
        RigOptics(
            rig(image={"bit_depth": 8}, optics={"sensor": QUIET | {"jpeg_quality": quality}})
        ).expose(level())
        for quality in ("none", 80)
    )
    assert 0 < np.abs(plain.astype(int) - pressed).max() < 8
    with pytest.raises(InputError, match=r"optics\.sensor\.jpeg_quality"):
        RigOptics(rig(optics={"sensor": {"jpeg_quality": 90}}))


@given(share=st.floats(0, 0.4))
def test_crosstalk_leaves_white_white(share: float) -> None:
    matrix = crosstalk_matrix(share)
    np.testing.assert_allclose(matrix @ np.ones(3), 1, atol=1e-6)
    assert matrix[0, 1] >= matrix[0, 2]


def test_vignetting_darkens_the_corners() -> None:
    through = vignette((101, 201), 0.3)
    assert through[50, 100] == pytest.approx(1.0)
    assert through[0, 0] == pytest.approx(0.7)
