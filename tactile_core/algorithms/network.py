"""A small multilayer perceptron in plain numpy: tanh layers, Adam, Huber loss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tactile_core.algorithms.arrays.regression import scaling
from tactile_core.algorithms.arrays.types import Float32

HUBER = 0.25
"""Errors (in sines) above it pull linearly, so that lifted skin and dirt do not rule the fit."""

_BLOCK = 4096
_SMALLEST_BATCH = 32


@dataclass(frozen=True, eq=False)
class Network:
    """Weights and biases of each layer, and the scale of the inputs.

    Attributes
    ----------
    mean, std : (D,) float32
    layers : tuple of (weight (A, B), bias (B,)) float32
    """

    mean: Float32
    std: Float32
    layers: tuple[tuple[Float32, Float32], ...]

    def __call__(self, features: Float32) -> Float32:
        """Map (N, D) features to (N, M) outputs, in blocks that stay in the cache."""
        out = np.empty((len(features), self.layers[-1][1].shape[0]), np.float32)
        for start in range(0, len(features), _BLOCK):
            # a sample per column: numpy adds a bias to a long row much faster than to short ones
            z = ((features[start : start + _BLOCK] - self.mean) / self.std).T
            for weight, bias in self.layers[:-1]:
                z = weight.T @ z
                z += bias[:, None]
                np.tanh(z, out=z)
            weight, bias = self.layers[-1]
            out[start : start + _BLOCK] = (weight.T @ z).T + bias
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
    """Fit a network.

    Parameters
    ----------
    features : (N, D) float32
    targets : (N, M) float32
    hidden : sequence of int
        Width of each hidden layer.
    epochs, steps : int
        Passes over the samples, and batches in each: few samples are learnt as long as many.
    rate, decay : float
        Adam's peak step (cosine schedule) and weight decay.
    noise : float
        Standard deviation of the noise added to each scaled feature while training, which keeps
        the network smooth between presses.
    seed : int
        Same seed, same network.
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
    batch = min(len(scaled), max(_SMALLEST_BATCH, len(scaled) // steps))
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
        cosine = 0.5 * (1 + np.cos(np.pi * step / total)) + 1e-3
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
    error /= np.maximum(1, size / HUBER) * np.float32(len(x))
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
        first_bias, second_bias = 1 - 0.9**self._steps, 1 - 0.999**self._steps
        for p, slope, m, v in zip(parameters, slopes, self._first, self._second, strict=True):
            m += np.float32(0.1) * (slope - m)
            v += np.float32(0.001) * (slope * slope - v)
            step = (m / np.float32(first_bias)) / (
                np.sqrt(v / np.float32(second_bias)) + np.float32(1e-8)
            )
            if p.ndim == 2:
                step = step + self._decay * p
            p -= np.float32(rate) * step
