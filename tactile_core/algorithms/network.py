"""Small multilayer perceptron in plain numpy: tanh layers, Adam, Huber loss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.regression import scaling
from tactile_core.algorithms.arrays.types import Float32


class TrainingParameters(NamedTuple):
    """Parameters of evaluation and training that no argument of :func:`train` sets.

    Nothing sets them from outside: they depend on the method or the processor, not on a sensor.

    Attributes
    ----------
    huber_error : float, length of normal_xy
        Errors count as their square up to this and linearly beyond, so that outliers (surface that
        has left the ball, dirt) do not dominate the fit.
        Source: chosen by hand; no script derives it.
    block : int, count
        Samples that are evaluated together and stay in the cache.
        Source: chosen by hand; no script derives it.
    smallest_batch : int, count
        Lower bound of the samples in a batch.
        Source: chosen by hand; no script derives it.
    least_rate_share : float, share of the peak rate
        Added to the cosine schedule, so that the last steps are not zero.
        Source: chosen by hand; no script derives it.
    beta_1, beta_2 : float, ratio
        Decay of the moments of the gradient.
        Source: Kingma and Ba, Algorithm 1 (default values).
    epsilon : float, root of the second moment
        Lower bound of the divisor.
        Source: Kingma and Ba, Algorithm 1 (default value).
    """

    huber_error: float = 0.25
    block: int = 4096
    smallest_batch: int = 32
    least_rate_share: float = 1e-3
    beta_1: float = 0.9
    beta_2: float = 0.999
    epsilon: float = 1e-8


TRAINING = TrainingParameters()
"""The values in use."""


@dataclass(frozen=True, eq=False)
class Network:
    """Weights and biases of each layer, and the scale of the inputs.

    Attributes
    ----------
    mean, std : (D,) float32
        Scale of the features.
    layers : tuple of (weight (A, B), bias (B,)) float32
    """

    mean: Float32
    std: Float32
    layers: tuple[tuple[Float32, Float32], ...]

    def __call__(self, features: Float32) -> Float32:
        """Map (N, D) features to (N, M) outputs, in blocks that stay in the cache."""
        block = TRAINING.block
        out = np.empty((len(features), self.layers[-1][1].shape[0]), np.float32)
        for start in range(0, len(features), block):
            # a sample per column: numpy adds a bias to a long row much faster than to short ones
            z = ((features[start : start + block] - self.mean) / self.std).T
            for weight, bias in self.layers[:-1]:
                z = weight.T @ z
                z += bias[:, None]
                np.tanh(z, out=z)
            weight, bias = self.layers[-1]
            out[start : start + block] = (weight.T @ z).T + bias
        return out


def train(
    features: Float32,
    targets: Float32,
    *,
    hidden: Sequence[int] = (24, 24, 24),
    epochs: int = 60,
    rate: float = 1e-2,
    steps: int = 24,
    decay: float = 1e-2,
    noise: float = 0.05,
    seed: int = 0,
) -> Network:
    """Train a network with Adam [1]_ on the Huber loss [2]_ of the length of the error.

    The rate follows half a cosine [3]_; the weight decay is decoupled from the gradient [4]_.

    Parameters
    ----------
    features : (N, D) float32
    targets : (N, M) float32
    hidden : sequence of int
        Width of each hidden layer.
    epochs, steps : int
        Passes over the samples, and batches in each pass. Their number does not depend on N, so
        few samples are trained for as long as many.
    rate, decay : float
        Peak step of Adam, and weight decay.
    noise : float
        Standard deviation of the noise added to each scaled feature in training. It keeps the
        network smooth between presses.
    seed : int
        The same seed gives the same network.

    Returns
    -------
    Network

    References
    ----------
    .. [1] D. P. Kingma and J. Ba, "Adam: a method for stochastic optimization", ICLR, 2015.
    .. [2] P. J. Huber, "Robust estimation of a location parameter", Annals of Mathematical
       Statistics 35(1), 1964.
    .. [3] I. Loshchilov and F. Hutter, "SGDR: stochastic gradient descent with warm restarts",
       ICLR, 2017 (without restarts).
    .. [4] I. Loshchilov and F. Hutter, "Decoupled weight decay regularization", ICLR, 2019.
    """
    rng = np.random.default_rng(seed)
    mean, std = scaling(features)
    scaled = (features - mean) / std
    sizes = [features.shape[1], *hidden, targets.shape[1]]
    parameters: list[Float32] = []
    for a, b in pairwise(sizes):
        parameters += [
            (rng.standard_normal((a, b)) / np.sqrt(a)).astype(np.float32),
            np.zeros(b, np.float32),
        ]
    adam = _Adam(parameters, decay)
    batch = min(len(scaled), max(TRAINING.smallest_batch, len(scaled) // steps))
    batches = len(scaled) // batch
    total = epochs * batches
    for step in range(total):
        if step % batches == 0:
            order = rng.permutation(len(scaled))
        pick = order[(step % batches) * batch : (step % batches + 1) * batch]
        x = scaled[pick]
        if noise:
            x = x + np.float32(noise) * rng.standard_normal(x.shape, dtype=np.float32)
        slope = _gradients(parameters, x, targets[pick])
        cosine = 0.5 * (1 + np.cos(np.pi * step / total)) + TRAINING.least_rate_share
        adam.update(parameters, slope, rate * cosine)
    return Network(mean, std, _pairs(parameters))


def _pairs(parameters: Sequence[Float32]) -> tuple[tuple[Float32, Float32], ...]:
    return tuple(zip(parameters[0::2], parameters[1::2], strict=True))


def _forward(layers: Sequence[tuple[Float32, Float32]], x: Float32) -> list[Float32]:
    activations = [x]
    for weight, bias in layers[:-1]:
        z = activations[-1] @ weight
        z += bias
        activations.append(np.tanh(z, out=z))
    weight, bias = layers[-1]
    activations.append(activations[-1] @ weight + bias)
    return activations


def _gradients(parameters: Sequence[Float32], x: Float32, y: Float32) -> list[Float32]:
    layers = _pairs(parameters)
    activations = _forward(layers, x)
    error = activations[-1] - y
    size = np.linalg.norm(error, axis=1, keepdims=True)
    error /= np.maximum(1, size / TRAINING.huber_error) * np.float32(len(x))
    slopes: list[Float32] = []
    for depth in range(len(layers) - 1, -1, -1):
        below = activations[depth]
        slopes = [below.T @ error, error.sum(0), *slopes]
        if depth:
            error = (error @ layers[depth][0].T) * (1 - below * below)
    return slopes


class _Adam:
    def __init__(self, parameters: Sequence[Float32], decay: float) -> None:
        self._first = [np.zeros_like(p) for p in parameters]
        self._second = [np.zeros_like(p) for p in parameters]
        self._decay = np.float32(decay)
        self._steps = 0

    def update(self, parameters: list[Float32], slopes: list[Float32], rate: float) -> None:
        self._steps += 1
        beta_1, beta_2 = TRAINING.beta_1, TRAINING.beta_2
        first_bias, second_bias = 1 - beta_1**self._steps, 1 - beta_2**self._steps
        for p, slope, m, v in zip(parameters, slopes, self._first, self._second, strict=True):
            m += np.float32(1 - beta_1) * (slope - m)
            v += np.float32(1 - beta_2) * (slope * slope - v)
            step = (m / np.float32(first_bias)) / (
                np.sqrt(v / np.float32(second_bias)) + np.float32(TRAINING.epsilon)
            )
            if p.ndim == 2:
                step = step + self._decay * p
            p -= np.float32(rate) * step
