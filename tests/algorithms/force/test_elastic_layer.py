"""The bonded layer is exact: limits of the compliance, reciprocity, and mean displacement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.response import WaveProducts
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid

GEL = Elastomer(2.0, 0.145, 0.48)
RATIOS = (0.0, 0.3, 0.48, 0.4999, 0.5)


@pytest.fixture(scope="module")
def layer() -> ElasticLayer:
    return ElasticLayer(SurfaceGrid(48, 40, 0.3), GEL, np.float64)


@pytest.mark.parametrize("nu", RATIOS)
def test_short_waves_do_not_depend_on_the_thickness(nu: float) -> None:
    k = np.array([15.0, 40.0])
    near, far = (Elastomer(h, 0.145, nu).compliance(k) for h in (2.0, np.inf))
    np.testing.assert_allclose(np.stack(near), np.stack(far), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("nu", RATIOS)
def test_long_waves_shear_and_compress_the_whole_thickness(nu: float) -> None:
    long, endless = (Elastomer(2.0, 0.145, nu).compliance(np.array([k])) for k in (1e-4, 0.0))
    assert long.along[0] == pytest.approx(2.0 / 0.145, rel=1e-6)
    assert long.across[0] == pytest.approx(2.0 / 0.145, rel=1e-6)
    confined = 2 * 0.145 * (1 - nu) / (1 - 2 * nu) if nu < 0.5 else np.inf
    assert endless.normal[0] == pytest.approx(2.0 / confined)
    assert long.normal[0] == pytest.approx(2.0 / confined, rel=1e-3, abs=1e-6)


@given(nu=st.floats(0.0, 0.5), k=st.floats(1e-3, 1e3))
def test_every_load_does_positive_work(nu: float, k: float) -> None:
    found = Elastomer(2.0, 0.145, nu).compliance(np.array([k]))
    assert found.along[0] > 0
    assert found.across[0] > 0
    assert found.along[0] * found.normal[0] > found.coupling[0] ** 2


def _loads(layer: ElasticLayer, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=layer.grid.shape), rng.normal(size=(2, *layer.grid.shape))


def _displaced(layer: ElasticLayer, p: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return layer.indentation(p) + layer.bulge(q), layer.spread(p) + layer.shift(q)


def test_displacements_of_two_loads_add_up(layer: ElasticLayer) -> None:
    (p1, q1), (p2, q2) = _loads(layer, 1), _loads(layer, 2)
    both = _displaced(layer, p1 + 3 * p2, q1 + 3 * q2)
    for found, one, other in zip(
        both, _displaced(layer, p1, q1), _displaced(layer, p2, q2), strict=True
    ):
        np.testing.assert_allclose(found, one + 3 * other, atol=1e-12)


def test_the_response_is_reciprocal(
    layer: ElasticLayer,
) -> None:
    (p1, q1), (p2, q2) = _loads(layer, 1), _loads(layer, 2)
    (w1, u1), (w2, u2) = _displaced(layer, p1, q1), _displaced(layer, p2, q2)
    assert (p1 * w2).sum() + (q1 * u2).sum() == pytest.approx(
        (p2 * w1).sum() + (q2 * u1).sum(), rel=1e-9
    )


def test_mean_shift_is_thickness_over_modulus_times_mean_traction(layer: ElasticLayer) -> None:
    p, q = _loads(layer, 3)
    _, u = _displaced(layer, p, q)
    np.testing.assert_allclose(u.mean((1, 2)), 2.0 / 0.145 * q.mean((1, 2)), rtol=1e-9)


def test_pressure_spreads_the_gel_outwards(layer: ElasticLayer) -> None:
    x, y = layer.grid.nodes_mm
    u = layer.spread(np.exp(-(x**2 + y**2)))
    ring = np.abs(np.hypot(x, y) - 1.5) < 0.3
    assert (x * u[0] + y * u[1])[ring].min() > 0


def test_single_precision_is_accurate_to_a_millionth(layer: ElasticLayer) -> None:
    p, q = _loads(layer, 4)
    single = ElasticLayer(layer.grid, GEL, np.float32)
    for rough, exact in zip(_displaced(single, p, q), _displaced(layer, p, q), strict=True):
        assert rough.dtype == np.float32
        np.testing.assert_allclose(rough, exact, atol=3e-6 * np.abs(exact).max())


def test_resolvent_inverts_the_response(layer: ElasticLayer) -> None:
    _, q = _loads(layer, 5)
    wanted = layer.shift(q) / 1.4 + 0.7 * q
    np.testing.assert_allclose(layer.resolvent(0.7, 1.4)(wanted), q, atol=1e-9)
    np.testing.assert_allclose(layer.resolvent(0.7, 1.4, gain=1.7)(wanted), 1.7 * q, atol=1e-9)


@given(
    whole=st.tuples(st.integers(2, 24), st.integers(2, 24)),
    part=st.tuples(st.integers(1, 12), st.integers(1, 12)),
    seed=st.integers(0, 1000),
)
def test_products_with_waves_are_fourier_transforms(
    whole: tuple[int, int], part: tuple[int, int], seed: int
) -> None:
    part = min(part[0], whole[0]), min(part[1], whole[1])
    field = np.random.default_rng(seed).standard_normal((2, *part))
    products = WaveProducts.for_part(part, whole, np.float64)
    waves = np.fft.rfft2(field, s=whole, axes=(-2, -1))
    np.testing.assert_allclose(products.forward(field), waves, atol=1e-12)
    np.testing.assert_allclose(products.inverse(waves), field, atol=1e-12)
