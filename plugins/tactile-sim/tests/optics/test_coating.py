import numpy as np
from support.virtual_rigs import QUIET, level, rig, slope

from tactile_sim.optics import RigOptics

MIDDLE = (slice(50, 70), slice(70, 90))
TILTS_DEG = (5, 10, 15, 20, 25, 30, 35, 40, 45)


def curve(**coat: object) -> np.ndarray:
    """Reflected light for each tilt towards a light at 30°, relative to a level surface."""
    profile = rig(
        gel={"coating": "semi_specular" if coat else "matte"},
        optics={"sensor": QUIET | {"exposure": 0.01}, "coat": {"grain": 0.0} | coat},
    )
    optics = RigOptics(profile)
    rest = optics.expose(level())[MIDDLE].mean()
    tilts = [float(np.tan(np.radians(t))) for t in TILTS_DEG]
    return np.array([optics.expose(-slope(x=t))[MIDDLE].mean() / rest for t in tilts])


def test_a_matte_gel_is_lambertian() -> None:
    expected = [np.sin(np.radians(30 + t)) / np.sin(np.radians(30)) for t in TILTS_DEG]
    np.testing.assert_allclose(curve(), expected, rtol=0.02)


def test_highlights_are_where_the_normal_bisects_light_and_camera() -> None:
    # To reflect light from 30° above the surface vertically, a mirror tilts by (90° − 30°) / 2.
    matte, flakes = curve(), curve(specular=0.5, roughness=0.12)
    assert TILTS_DEG[int(np.argmax(flakes - matte))] == 30


def test_lower_roughness_gives_sharper_highlights() -> None:
    rough, smooth = (curve(specular=0.5, roughness=r) for r in (0.4, 0.15))
    assert np.ptp(np.diff(smooth)) > np.ptp(np.diff(rough))


def test_grain_moves_with_the_gel_and_differs_from_light_to_light() -> None:
    profile = rig(
        (0.0, 120.0, 240.0),
        in_turn=True,
        optics={
            "sensor": QUIET,
            "coat": {"grain": 0.05, "grain_mm": 0.3},
            "lights": {"scatter": 1},
        },
    )
    optics = RigOptics(profile)
    moved = np.zeros((120, 160, 2), np.float32)
    moved[..., 0] = 1.0
    here, there = (optics.expose(level(), u).astype(float) for u in (None, moved))
    at_rest, carried = here[:, 20:130, 0], there[:, 30:140, 0]
    assert np.corrcoef(at_rest.ravel(), carried.ravel())[0, 1] > 0.95
    assert abs(np.corrcoef(here[..., 0].ravel(), here[..., 1].ravel())[0, 1]) < 0.1


def test_a_translucent_gel_darkens_exponentially_with_depth() -> None:
    optics = RigOptics(
        rig(optics={"sensor": QUIET, "coat": {"grain": 0.0, "absorption_per_mm": 0.8}})
    )
    rest = optics.expose(level())[MIDDLE].mean()
    shares = [optics.expose(level() + depth)[MIDDLE].mean() / rest for depth in (-0.2, 0.5, 1.0)]
    np.testing.assert_allclose(shares, [1, np.exp(-0.4), np.exp(-0.8)], rtol=0.03)


def test_a_gel_that_scatters_within_is_as_bright_as_it_is_thick_whatever_its_slope() -> None:
    coat = {"grain": 0.0, "absorption_per_mm": 0.8, "scatters": "volume"}
    optics = RigOptics(rig(optics={"sensor": QUIET, "coat": coat}))
    ramp_mm = level() + np.linspace(-0.5, 1.5, 160, dtype=np.float32)
    shares = optics.expose(ramp_mm)[MIDDLE] / optics.expose(level())[MIDDLE]
    expected = np.exp(-0.8 * ramp_mm)[MIDDLE]
    np.testing.assert_allclose(shares.mean(axis=(0, 2)), expected.mean(axis=0), rtol=0.03)
