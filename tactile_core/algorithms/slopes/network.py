"""Small networks from features to slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tactile_core.algorithms.arrays.regression import scaling
from tactile_core.algorithms.arrays.types import Float32

_BLOCK = 4096  # [count] Samples that are evaluated together and stay in the cache


@dataclass(frozen=True, eq=False)
class Networks:
    """Networks of equal shape, whose outputs are averaged.

    Attributes
    ----------
    mean, std : (D,) float32
        Scale of the features.
    layers : sequence of (E, A + 1, B) float32
        Weights of the E networks, and their biases as the last row.
    """

    mean: Float32
    std: Float32
    layers: Sequence[Float32]

    def __call__(self, features: Float32) -> Float32:
        """Map (N, D) features to (N, M) outputs."""
        out = np.empty((len(features), self.layers[-1].shape[2]), np.float32)
        for start in range(0, len(features), _BLOCK):
            # a sample per column: numpy adds a bias to a long row much faster than to short ones
            z = ((features[start : start + _BLOCK] - self.mean) / self.std).T
            for layer in self.layers[:-1]:
                z = _through(layer, z)
                np.tanh(z, out=z)
            out[start : start + _BLOCK] = _through(self.layers[-1], z).mean(axis=0).T
        return out


def _through(layer: Float32, z: Float32) -> Float32:
    """Weighted sums of (E, A, N) or (A, N) columns in a layer, and biases: (E, B, N)."""
    found = layer[:, :-1].transpose(0, 2, 1) @ z
    found += layer[:, -1, :, None]
    return found


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
    seeds: Sequence[int] = (0,),
) -> Networks:
    """Train networks with Adam [1]_ on the Huber loss [2]_ of the length of the error.

    The rate follows half a cosine [3]_; the weight decay is decoupled from the gradient [4]_.
    The networks are independent; training them together takes fewer calls.

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
    seeds : sequence of int
        One per network; the same seed gives the same network.

    Returns
    -------
    Networks

    References
    ----------
    .. [1] D. P. Kingma and J. Ba, "Adam: a method for stochastic optimization", ICLR, 2015.
    .. [2] P. J. Huber, "Robust estimation of a location parameter", Annals of Mathematical
       Statistics 35(1), 1964.
    .. [3] I. Loshchilov and F. Hutter, "SGDR: stochastic gradient descent with warm restarts",
       ICLR, 2017 (without restarts).
    .. [4] I. Loshchilov and F. Hutter, "Decoupled weight decay regularization", ICLR, 2019.
    """
    rngs = [np.random.default_rng(seed) for seed in seeds]
    mean, std = scaling(features)
    # A sample per column, as in the networks.
    scaled = np.ascontiguousarray(((features - mean) / std).T)
    wanted = np.ascontiguousarray(targets.T)
    layers = [
        np.stack([_draw_layer(*shape, rng) for rng in rngs])
        for shape in pairwise([len(scaled), *hidden, len(wanted)])
    ]
    adam = [_Adam(layer, decay) for layer in layers]
    count = scaled.shape[1]
    batch = min(count, max(32, count // steps))  # fewer samples have a noisy gradient
    batches = count // batch
    total = epochs * batches
    for step in range(total):
        if step % batches == 0:
            orders = [rng.permutation(count)[: batches * batch] for rng in rngs]
            inputs = np.stack([scaled[:, order] for order in orders])
            outputs = np.stack([wanted[:, order] for order in orders])
            for rng, one in zip(rngs, inputs, strict=True):
                one += np.float32(noise) * rng.standard_normal(one.shape, dtype=np.float32)
        part = np.s_[:, :, (step % batches) * batch : (step % batches + 1) * batch]
        # a thousandth of the peak rate remains at the end, so that the last steps are not zero
        cosine = 0.5 * (1 + np.cos(np.pi * step / total)) + 1e-3
        for one, slope in zip(adam, _slopes(layers, inputs[part], outputs[part]), strict=True):
            one.update(slope, rate * cosine)
    return Networks(mean, std, layers)


def _draw_layer(inputs: int, outputs: int, rng: np.random.Generator) -> Float32:
    """Draw weights at random, (inputs + 1, outputs); the biases in the last row are 0."""
    layer = np.zeros((inputs + 1, outputs), np.float32)
    layer[:-1] = rng.standard_normal((inputs, outputs)) / np.sqrt(inputs)
    return layer


def _slopes(layers: Sequence[Float32], inputs: Float32, wanted: Float32) -> list[Float32]:
    """Derivatives of the losses by each layer, for (E, D, N) inputs and (E, M, N) outputs."""
    seen = [inputs]
    for layer in layers[:-1]:
        z = _through(layer, seen[-1])
        seen.append(np.tanh(z, out=z))
    error = _through(layers[-1], seen[-1])
    error -= wanted
    # Errors count as their square up to a quarter of a normal's length, and linearly beyond, so
    # that surface that has left the ball, and dirt, do not dominate.
    size = np.sqrt(np.einsum("emn,emn->en", error, error)) * np.float32(4)
    error /= (np.maximum(size, 1) * np.float32(error.shape[2]))[:, None]
    found = []
    for layer, below in zip(layers[::-1], seen[::-1], strict=True):
        across = error.transpose(0, 2, 1)
        found.append(np.concatenate([below @ across, across.sum(axis=1, keepdims=True)], axis=1))
        error = (layer[:, :-1] @ error) * (1 - below * below)
    return found[::-1]


class _Adam:
    """Updates one layer (E, A + 1, B) in place; its biases do not decay."""

    def __init__(self, layer: Float32, decay: float) -> None:
        self._layer, self._decay = layer, np.float32(decay)
        self._first, self._second = np.zeros((2, *layer.shape), np.float32)
        self._steps = 0

    def update(self, slope: Float32, rate: float) -> None:
        # Kingma and Ba, Algorithm 1, with its default values
        self._steps += 1
        self._first += np.float32(0.1) * (slope - self._first)
        self._second += np.float32(0.001) * (slope * slope - self._second)
        size = np.sqrt(self._second * np.float32(1 / (1 - 0.999**self._steps))) + np.float32(1e-8)
        step = self._first * np.float32(1 / (1 - 0.9**self._steps)) / size
        step[:, :-1] += self._decay * self._layer[:, :-1]
        self._layer -= np.float32(rate) * step
