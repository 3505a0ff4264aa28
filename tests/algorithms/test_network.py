import numpy as np
import pytest

from tactile_core.algorithms.network import Committee, train


@pytest.fixture(scope="module")
def samples() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (3000, 3)).astype(np.float32)
    y = np.stack([np.sin(2 * x[:, 0]) * 0.5, x[:, 1] * x[:, 2]], 1).astype(np.float32)
    return x, y


def test_a_smooth_function_is_learned(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    (network,) = train(x[:2500], y[:2500], epochs=40, noise=0.0)
    error = network(x[2500:]) - y[2500:]
    assert np.sqrt(np.mean(error**2)) < 0.03


def test_the_same_seed_gives_the_same_network(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    first, second, other = (network(x[:10]) for network in train(x, y, epochs=2, seeds=(1, 1, 2)))
    np.testing.assert_array_equal(first, second)
    assert (first != other).any()


def test_a_network_does_not_depend_on_those_beside_it(
    samples: tuple[np.ndarray, np.ndarray],
) -> None:
    x, y = samples
    (alone,), (_, beside) = (train(x, y, epochs=2, seeds=seeds) for seeds in ((1,), (0, 1)))
    np.testing.assert_allclose(alone(x[:10]), beside(x[:10]), atol=1e-5)


def test_a_few_outliers_do_not_dominate_the_fit(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    with_outliers = y.copy()
    with_outliers[::40] += 5
    (network,) = train(x, with_outliers, epochs=30, noise=0.0)
    assert np.median(np.abs(network(x) - y)) < 0.06


def test_outputs_do_not_depend_on_the_block(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    (network,) = train(x, y, epochs=1)
    many = np.tile(x, (4, 1))
    np.testing.assert_allclose(network(many)[-5:], network(many[-5:]), atol=1e-6)


def test_a_committee_adds_up_its_networks(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    members = train(x, y, epochs=2, seeds=(1, 2, 3), hidden=(8, 8))
    expected = sum(member(x) for member in members)
    assert Committee(members)(x) == pytest.approx(expected, abs=1e-5)
