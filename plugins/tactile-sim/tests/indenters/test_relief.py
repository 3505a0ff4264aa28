"""Textures on any shape."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_sim.indenters import make_indenter

X, Y = np.meshgrid(np.linspace(-4, 4, 321), np.linspace(-4, 4, 321))


def relief_mm(**texture: Any) -> np.ndarray:
    """Depth of a texture on a flat plate."""
    plate = make_indenter("flat", size_mm=(40.0, 40.0), texture=texture)
    return plate.gap_mm(X, Y)


@pytest.mark.parametrize("kind", ["ribs", "rough", "weave"])
def test_a_texture_is_a_gap_of_its_own_height_on_any_shape(kind: str) -> None:
    texture = {"kind": kind, "relief_mm": 0.05}
    bare = make_indenter("sphere", diameter_mm=20.0)
    textured = make_indenter("sphere", diameter_mm=20.0, texture=texture)
    np.testing.assert_allclose(
        textured.gap_mm(X, Y) - bare.gap_mm(X, Y), relief_mm(**texture), atol=1e-9
    )
    assert textured.rolling_radius_mm == 10.0
    assert textured.detail_mm is not None


def test_ribs_have_their_pitch_and_direction() -> None:
    gap = relief_mm(kind="ribs", pitch_mm=2.0, relief_mm=0.1, angle_deg=90.0)
    np.testing.assert_allclose(gap, gap[:, :1] * np.ones_like(gap), atol=1e-12)
    np.testing.assert_allclose(gap[0], gap[80], atol=1e-12)  # 80 points are 2 mm
    assert (gap.min(), gap.max()) == (pytest.approx(0.0), pytest.approx(0.1))


def test_roughness_has_its_height_and_correlation_length() -> None:
    gap = relief_mm(kind="rough", grain_mm=0.4, relief_mm=0.03, seed=5)
    assert gap.min() >= 0
    assert gap.std() == pytest.approx(0.03, rel=0.15)
    height = gap - gap.mean()
    shift = round(0.4 / 0.025)
    correlation = (height[:, shift:] * height[:, :-shift]).mean() / (height**2).mean()
    assert correlation == pytest.approx(np.exp(-1), abs=0.15)
    assert not np.array_equal(gap, relief_mm(kind="rough", grain_mm=0.4, relief_mm=0.03, seed=6))


@pytest.mark.parametrize(
    ("texture", "message"),
    [
        ({"kind": "rib"}, "do you mean 'ribs'"),
        ({"pitch_mm": 1.0}, "needs its kind: ribs, rough, weave"),
        ({"kind": "ribs", "pitch_mm": 0.0}, "above 0"),
        ({"kind": "rough", "seed": 0.5}, "0, 1, 2"),
        ({"kind": "weave", "size_mm": 3}, "no option 'size_mm'"),
    ],
)
def test_an_impossible_texture_is_refused(texture: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_indenter("sphere", diameter_mm=5.0, texture=texture)
