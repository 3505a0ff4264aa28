"""Small networks, and the planes that they see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import scaling
from tactile_core.algorithms.arrays.types import Array, Float32


class NETWORK_TRAINING:
    """Parameters of evaluation and training that no argument of :func:`train` sets.

    Nothing sets them from outside: they depend on the method or the processor, not on a sensor.
    """

    # [length of normal_xy] Errors count as their square up to this and linearly beyond, so that
    # outliers (surface that has left the ball, dirt) do not dominate the fit.
    huber_error = 0.25
    block = 4096  # [count] Samples that are evaluated together and stay in the cache
    smallest_batch = 32  # [count] Lower bound of the samples in a batch
    # [share of the peak rate] Added to the cosine schedule, so that the last steps are not zero.
    least_rate_share = 1e-3
    # [ratio] Decay of the moments of the gradient. Source: Kingma and Ba, Algorithm 1 (default
    # values).
    beta_1 = 0.9
    beta_2 = 0.999
    # [root of the second moment] Lower bound of the divisor. Source: Kingma and Ba, Algorithm 1
    # (default value).
    epsilon = 1e-8


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
        block = NETWORK_TRAINING.block
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


class Committee:
    """Sum of the outputs of networks of equal shape, evaluated together.

    Parameters
    ----------
    members : sequence of Network
        At least one, with the same scale of the inputs.
    """

    def __init__(self, members: Sequence[Network]) -> None:
        first = members[0]
        layers = [
            (np.stack([weight.T for weight, _ in same]), np.stack([bias for _, bias in same]))
            for same in zip(*(member.layers for member in members), strict=True)
        ]
        # the first layer scales the features, too
        weight, bias = layers[0]
        weight = weight / first.std
        bias = bias - weight @ first.mean
        scaled = [(weight, bias), *layers[1:]]
        *self._hidden, (weight, bias) = [(w, b[..., None]) for w, b in scaled]
        # the last layers of all members add up
        self._last = np.concatenate(list(weight), axis=1), bias.sum(axis=0)

    def __call__(self, features: Float32) -> Float32:
        """Map (N, D) features to (N, M) outputs, in blocks that stay in the cache."""
        block = NETWORK_TRAINING.block
        weight, bias = self._last
        out = np.empty((len(features), len(weight)), np.float32)
        for start in range(0, len(features), block):
            z = np.ascontiguousarray(features[start : start + block].T)
            for layer, shift in self._hidden:
                z = layer @ z
                z += shift
                np.tanh(z, out=z)
            out[start : start + block] = (weight @ z.reshape(-1, z.shape[-1]) + bias).T
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
    seeds: Sequence[int] = (0,),
) -> list[Network]:
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
    list of Network

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
    # A sample per column, as in the network; a row of ones multiplies the biases.
    scaled = np.ascontiguousarray(((features - mean) / std).T)
    wanted = np.ascontiguousarray(targets.T)
    sizes = [features.shape[1], *hidden, targets.shape[1]]
    parameters = _Weights.draw_weights(sizes, rngs)
    adam = _Adam(parameters.flat.shape, np.float32(decay) * parameters.decaying)
    count = scaled.shape[1]
    batch = min(count, max(NETWORK_TRAINING.smallest_batch, count // steps))
    batches = count // batch
    total = epochs * batches
    activations = [np.ones((len(rngs), size + 1, batch), np.float32) for size in sizes[:-1]]
    inputs = np.empty((len(rngs), sizes[0], batches * batch), np.float32)
    outputs = np.empty((len(rngs), sizes[-1], batches * batch), np.float32)
    for step in range(total):
        if step % batches == 0:
            for rng, one_input, one_output in zip(rngs, inputs, outputs, strict=True):
                order = rng.permutation(count)[: batches * batch]
                rng.standard_normal(dtype=np.float32, out=one_input)
                one_input *= np.float32(noise)
                one_input += scaled.take(order, axis=1)
                wanted.take(order, axis=1, out=one_output)
        part = np.s_[:, :, (step % batches) * batch : (step % batches + 1) * batch]
        activations[0][:, :-1] = inputs[part]
        parameters.write_slope(activations, outputs[part])
        cosine = 0.5 * (1 + np.cos(np.pi * step / total)) + NETWORK_TRAINING.least_rate_share
        adam.update(parameters.flat, parameters.slope, rate * cosine)
    return [Network(mean, std, layers) for layers in parameters.layers()]


@dataclass(frozen=True, eq=False)
class _Weights:
    """Weights and biases of all networks in one array, so that Adam updates them at once.

    Attributes
    ----------
    flat, slope : (E, P) float32
        Those of each network, and the derivative of its loss by them.
    matrices, slopes : list of (E, A + 1, B) float32
        Views of both for each layer: weights, and the biases as the last row.
    """

    flat: Float32
    slope: Float32
    matrices: list[Float32]
    slopes: list[Float32]

    @classmethod
    def draw_weights(cls, sizes: Sequence[int], rngs: Sequence[np.random.Generator]) -> _Weights:
        """Draw the weights of each network at random; biases are 0."""
        count = sum((a + 1) * b for a, b in pairwise(sizes))
        flat, slope = np.zeros((2, len(rngs), count), np.float32)
        made = cls(flat, slope, _views(flat, sizes), _views(slope, sizes))
        for number, rng in enumerate(rngs):
            for matrix in made.matrices:
                weight = matrix[number, :-1]
                weight[...] = rng.standard_normal(weight.shape) / np.sqrt(len(weight))
        return made

    @property
    def decaying(self) -> Float32:
        """(P,) 1 for weights, 0 for biases."""
        ones = [np.ones_like(matrix[0]) for matrix in self.matrices]
        for matrix in ones:
            matrix[-1] = 0
        return np.concatenate([matrix.ravel() for matrix in ones])

    def layers(self) -> list[tuple[tuple[Float32, Float32], ...]]:
        """Weight and bias of each layer, for each network."""
        return [
            tuple((matrix[n, :-1].copy(), matrix[n, -1].copy()) for matrix in self.matrices)
            for n in range(len(self.flat))
        ]

    def write_slope(self, activations: Sequence[Float32], wanted: Float32) -> None:
        """Write the derivatives of the losses into ``slope``.

        Parameters
        ----------
        activations : sequence of (E, A + 1, N) float32
            Input of each layer above a row of ones; the first is read, the others are written.
        wanted : (E, M, N) float32
        """
        for matrix, below, above in zip(self.matrices, activations, activations[1:], strict=False):
            z = np.matmul(matrix.transpose(0, 2, 1), below, out=above[:, :-1])
            np.tanh(z, out=z)
        error = self.matrices[-1].transpose(0, 2, 1) @ activations[-1]
        error -= wanted
        size = np.sqrt(np.einsum("emn,emn->en", error, error))
        size /= np.float32(NETWORK_TRAINING.huber_error)
        np.maximum(size, 1, out=size)
        size *= np.float32(error.shape[2])
        error /= size[:, None]
        for depth in range(len(self.matrices) - 1, -1, -1):
            below = activations[depth]
            np.matmul(below, error.transpose(0, 2, 1), out=self.slopes[depth])
            if depth:
                bend = np.square(below[:, :-1])
                np.subtract(1, bend, out=bend)
                bend *= self.matrices[depth][:, :-1] @ error
                error = bend


def _views(flat: Float32, sizes: Sequence[int]) -> list[Float32]:
    ends = np.cumsum([0, *((a + 1) * b for a, b in pairwise(sizes))])
    return [
        flat[:, start:end].reshape(len(flat), a + 1, b)
        for (start, end), (a, b) in zip(pairwise(ends), pairwise(sizes), strict=True)
    ]


class _Adam:
    def __init__(self, shape: tuple[int, ...], decay: Float32) -> None:
        self._first, self._second, self._size, self._scratch = np.zeros((4, *shape), np.float32)
        self._decay = decay
        self._steps = 0

    def update(self, parameters: Float32, slope: Float32, rate: float) -> None:
        self._steps += 1
        beta_1, beta_2 = NETWORK_TRAINING.beta_1, NETWORK_TRAINING.beta_2
        first_bias, second_bias = 1 - beta_1**self._steps, 1 - beta_2**self._steps
        size, scratch = self._size, self._scratch
        self._first *= np.float32(beta_1)
        self._first += np.multiply(slope, np.float32(1 - beta_1), out=scratch)
        np.multiply(slope, slope, out=scratch)
        scratch *= np.float32(1 - beta_2)
        self._second *= np.float32(beta_2)
        self._second += scratch
        np.sqrt(self._second, out=size)
        size *= np.float32(first_bias / np.sqrt(second_bias))
        size += np.float32(first_bias * NETWORK_TRAINING.epsilon)
        step = np.divide(self._first, size, out=size)
        step += np.multiply(self._decay, parameters, out=scratch)
        step *= np.float32(rate)
        parameters -= step


def shrunk_planes(values: Array, size: tuple[int, int]) -> Float32:
    """Resize planes: by area where they shrink, and linearly where they grow.

    Parameters
    ----------
    values : (H, W) or (H, W, K)
    size : (width, height)

    Returns
    -------
    (height, width, K) float32
    """
    height, width = values.shape[:2]
    shrinks = size[0] <= width and size[1] <= height
    found = cv2.resize(
        np.asarray(values, np.float32),
        size,
        interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR,
    )
    return np.asarray(found, np.float32).reshape(size[1], size[0], -1)


def normalise_planes(
    planes: Float32,
    divisor: Float32 | float = 1.0,
    mean: Sequence[float] | float = 0.0,
    std: Sequence[float] | float = 1.0,
) -> Float32:
    """(H, W, K) ``(planes / divisor - mean) / std``, each a number or one number per plane."""
    scale = 1 / (np.asarray(divisor, np.float32) * np.asarray(std, np.float32))
    shift = np.asarray(mean, np.float32) / np.asarray(std, np.float32)
    return np.asarray(planes * scale - shift, np.float32)


def tensor(planes: Sequence[Float32], order: str = "nchw") -> Float32:
    """Stack groups of planes, each (H, W, K), to a contiguous tensor of one observation.

    Parameters
    ----------
    planes : sequence of (H, W, K) float32
    order : "nchw" or "nhwc"
    """
    stacked = np.concatenate(planes, axis=2)
    if order == "nchw":
        stacked = stacked.transpose(2, 0, 1)
    return np.ascontiguousarray(stacked[None], np.float32)
