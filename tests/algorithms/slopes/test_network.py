import numpy as np
import pytest

from tactile_core.algorithms.slopes.network import train


@pytest.fixture(scope="module")
def samples() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (3000, 3)).astype(np.float32)
    y = np.stack([np.sin(2 * x[:, 0]) * 0.5, x[:, 1] * x[:, 2]], 1).astype(np.float32)
    return x, y


def test_a_smooth_function_is_learned(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    network = train(x[:2500], y[:2500], epochs=40, noise=0.0)
    error = network(x[2500:]) - y[2500:]
    assert np.sqrt(np.mean(error**2)) < 0.03


def test_the_same_seed_gives_the_same_network(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    first, second, other = (train(x, y, epochs=2, seeds=(seed,))(x[:10]) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, second)
    assert (first != other).any()


def test_a_few_outliers_do_not_dominate_the_fit(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    with_outliers = y.copy()
    with_outliers[::40] += 5
    network = train(x, with_outliers, epochs=30, noise=0.0)
    assert np.median(np.abs(network(x) - y)) < 0.06


def test_outputs_do_not_depend_on_the_block(samples: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = samples
    network = train(x, y, epochs=1)
    many = np.tile(x, (4, 1))
    np.testing.assert_allclose(network(many)[-5:], network(many[-5:]), atol=1e-6)


def test_networks_that_are_trained_together_are_those_trained_alone_and_are_averaged(
    samples: tuple[np.ndarray, np.ndarray],
) -> None:
    x, y = samples
    together = train(x, y, epochs=2, seeds=(1, 2, 3), hidden=(8, 8))
    alone = [train(x, y, epochs=2, seeds=(seed,), hidden=(8, 8))(x) for seed in (1, 2, 3)]
    assert together(x) == pytest.approx(np.mean(alone, axis=0), abs=1e-5)
