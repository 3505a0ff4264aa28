"""The training of a network for force."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from tactile_core.algorithms.arrays.types import Float32, Float64
from tactile_core.interfaces.calibration import Progress
from tactile_train.samples import UnitSamples
from tactile_train.virtual_forces import CELL_PX, cell_centres_mm


class LoadMap(nn.Module):
    """Estimates the loads on a grid of cells, and sums them to force and torque.

    Parameters
    ----------
    planes : int
        Of the input.
    size : (width, height)
        Of the input in px, multiples of 8.
    view_mm : (2,)
        Width and height of the view.
    load_std : (4,)
        Standard deviations of the loads on a cell, which scale the output.
    """

    def __init__(
        self, planes: int, size: tuple[int, int], view_mm: Float64, load_std: Float32
    ) -> None:
        super().__init__()
        columns, rows = cells = size[0] // CELL_PX, size[1] // CELL_PX
        half = (rows + 1) // 2, (columns + 1) // 2
        quarter = (half[0] + 1) // 2, (half[1] + 1) // 2
        self.stem = nn.Sequential(
            _convolution(planes, 16, 5, 2), _convolution(16, 40, 3, 2), _convolution(40, 64, 3, 2)
        )
        self.down1 = _convolution(64, 96, 3, 2)
        self.down2 = _convolution(96, 128, 3, 2)
        self.middle = _convolution(128, 128)
        self.up1 = _enlargement(128, 96, quarter, half)
        self.up2 = _enlargement(96, 64, half, (rows, columns))
        self.last = nn.Sequential(_convolution(64, 64), _convolution(64, 64), nn.Conv2d(64, 4, 1))
        self.register_buffer("load_std", torch.from_numpy(load_std).float().view(1, 4, 1, 1))
        self.register_buffer("sums", torch.from_numpy(wrench_of_loads(view_mm, cells)))

    def loads(self, planes: Any) -> Any:
        """(N, 4, rows, columns) loads on the cells."""
        fine = self.stem(planes)
        coarse = self.down1(fine)
        coarse = coarse + self.up1(self.middle(self.down2(coarse)))
        return self.last(fine + self.up2(coarse)) * self.load_std

    def sum_loads(self, loads: Any) -> Any:
        """(N, 4) wrenches of loads."""
        return nn.functional.linear(loads.flatten(1), self.sums)

    def forward(self, planes: Any) -> Any:
        """(N, 4) wrenches."""
        return self.sum_loads(self.loads(planes))


def wrench_of_loads(view_mm: Float64, cells: tuple[int, int]) -> Float32:
    """(4, 4 · rows · columns) matrix that sums loads on cells to a wrench about the centre."""
    columns, rows = cells
    x_mm, y_mm = cell_centres_mm(view_mm, cells)
    matrix = np.zeros((4, 4, rows, columns), np.float32)
    for component in range(3):
        matrix[component, component] = 1
    matrix[3, 0] = -y_mm[:, None]
    matrix[3, 1] = x_mm
    matrix[3, 3] = 1
    return matrix.reshape(4, -1)


def _convolution(given: int, made: int, size: int = 3, stride: int = 1) -> Any:
    return nn.Sequential(
        nn.Conv2d(given, made, size, stride, size // 2, bias=False),
        nn.BatchNorm2d(made),
        nn.ReLU(inplace=True),
    )


def _enlargement(given: int, made: int, small: tuple[int, int], large: tuple[int, int]) -> Any:
    """Transposed convolution from one grid to the one before it was halved."""
    missing = tuple(n - (2 * m - 1) for m, n in zip(small, large, strict=True))
    return nn.Sequential(
        nn.ConvTranspose2d(given, made, 3, 2, 1, missing, bias=False),
        nn.BatchNorm2d(made),
        nn.ReLU(inplace=True),
    )


_SIGNS = np.array([-1, 1, 1, -1], np.float32)  # Of a wrench in the mirror: fx and tz change

_BATCH = 64  # Images per step


class TrainingBatch(NamedTuple):
    """Some samples.

    Attributes
    ----------
    images, references : (N, H, W, K) float32
    wrenches : (N, 4) float32
    loads : (N, 4, rows, columns) float32
    known : (N,) float32
        1 where the loads are known.
    """

    images: Float32
    references: Float32
    wrenches: Float32
    loads: Float32
    known: Float32


class TrainingSet:
    """Samples of several units in random access."""

    def __init__(self, units: Sequence[UnitSamples], cells: tuple[int, int]) -> None:
        self._units = units
        self._cells = cells
        self._relative = [unit.relative for unit in units]
        self.index = np.concatenate(
            [[(number, k) for k in range(len(unit.images))] for number, unit in enumerate(units)]
        )
        self.wrench_std = _equalise_axes(np.concatenate(self._relative).std(0))
        known = [unit for unit in units if unit.loads is not None]
        spread = np.full(4, 1.0, np.float32)
        if known:
            all_loads = [
                unit.loads / unit.shear_modulus_mpa for unit in known if unit.loads is not None
            ]
            spread = _equalise_axes(np.concatenate(all_loads).std((0, 2, 3)))
        else:
            spread = self.wrench_std / np.float32(cells[0] * cells[1]) ** 0.5
        self.load_std = np.asarray(spread, np.float32)

    def batch(self, chosen: Any) -> TrainingBatch:
        """Return the samples of these numbers."""
        places = self.index[chosen]
        columns, rows = self._cells
        nothing = np.zeros((4, rows, columns), np.float32)
        loads, known = [], []
        for number, k in places:
            unit = self._units[number]
            known.append(unit.loads is not None)
            loads.append(nothing if unit.loads is None else unit.loads[k] / unit.shear_modulus_mpa)
        return TrainingBatch(
            np.stack([self._units[u].images[k] for u, k in places]).astype(np.float32),
            np.stack([self._units[u].reference for u, _ in places]),
            np.stack([self._relative[u][k] for u, k in places]),
            np.stack(loads).astype(np.float32),
            np.array(known, np.float32),
        )


def planes_of(images: Float32, references: Float32) -> Any:
    """(N, 2 K, H, W) difference to the reference, and reference, over the reference's mean."""
    seen, undeformed = torch.from_numpy(images), torch.from_numpy(references)
    scale = 1 / undeformed.mean((1, 2), keepdim=True)
    ratio = undeformed * scale
    return torch.cat([seen * scale - ratio, ratio - 1], 3).permute(0, 3, 1, 2)


def train(
    samples: TrainingSet,
    network: LoadMap,
    *,
    epochs: int,
    seed: int,
    mirrored: tuple[int, ...] | None,
    progress: Progress,
) -> Any:
    """Train a network and return the moving average of its weights.

    Parameters
    ----------
    samples : TrainingSet
    network : LoadMap
    epochs : int
        Passes over the samples.
    seed : int
    mirrored : tuple of int or None
        Order of the channels of a mirrored image; None if it is no image of the same design.
    progress : Progress
    """
    rng = np.random.default_rng(seed)
    table = rng.standard_normal(4_000_000, np.float32)  # [samples]
    network = network.to(memory_format=torch.channels_last).train()
    averaged = deepcopy(network)
    optimiser = torch.optim.AdamW(network.parameters(), weight_decay=1e-2)
    count = len(samples.index)
    batch = min(_BATCH, count)
    steps, step = epochs * (count // batch), 0
    wrench_std = torch.from_numpy(samples.wrench_std)
    load_std = torch.from_numpy(samples.load_std).view(1, 4, 1, 1)
    for _ in range(epochs):
        order = rng.permutation(count)
        for start in range(0, count - batch + 1, batch):
            warm = min(1.0, (step + 1) / 100)
            falling = 0.5 * (1 + np.cos(np.pi * step / steps)) + 1e-3
            for group in optimiser.param_groups:
                group["lr"] = 2e-3 * warm * falling
            seen = augment_batch(samples.batch(order[start : start + batch]), rng, table, mirrored)
            loss = _loss(network, seen, wrench_std, load_std)
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
            optimiser.step()
            step += 1
            _average(averaged, network, min(0.998, step / (step + 20)))
            progress.fraction(step / steps)
    return averaged.eval()


def predict_wrenches(network: Any, unit: UnitSamples) -> Float64:
    """(N, 4) wrenches that a network estimates, over the gel's shear modulus."""
    found = []
    with torch.no_grad():
        for start in range(0, len(unit.images), _BATCH):
            images = unit.images[start : start + _BATCH].astype(np.float32)
            references = np.broadcast_to(unit.reference, images.shape).copy()
            found.append(network(planes_of(images, references)).numpy())
    return np.asarray(np.concatenate(found), np.float64)


def augment_batch(
    batch: TrainingBatch, rng: np.random.Generator, table: Float32, mirrored: tuple[int, ...] | None
) -> TrainingBatch:
    """Mirror half of the samples, vary light and colour, and add noise."""
    images, references, wrenches, loads, known = batch
    count, channels = len(images), images.shape[3]
    if mirrored is not None:
        turned = rng.random(count) < 0.5
        for stack in (images, references):
            stack[turned] = stack[turned][:, :, ::-1][..., list(mirrored)]
        wrenches[turned] *= _SIGNS
        loads[turned] = loads[turned][..., ::-1] * _SIGNS[:, None, None]
    each = (count, 1, 1, channels)
    # lights differ by 15 %; their drift is compensated to 1 %, that of each colour to half of it
    colour = 1 + 0.15 * rng.uniform(-1, 1, each)
    drift = 1 + 0.01 * rng.standard_normal((count, 1, 1, 1))
    drift = drift * (1 + 0.005 * rng.standard_normal(each))
    images *= (colour * drift).astype(np.float32)
    references *= colour.astype(np.float32)
    for image in images:
        start = int(rng.integers(0, table.size - image.size))
        noise = table[start : start + image.size].reshape(image.shape)
        # up to that of a webcam in 8-bit intensities, averaged over 16 pixels
        image += noise * np.float32(rng.uniform(0, 0.6))
    return TrainingBatch(images, references, wrenches, loads, known)


def _loss(network: Any, seen: TrainingBatch, wrench_std: Any, load_std: Any) -> Any:
    planes = planes_of(seen.images, seen.references)
    true = torch.from_numpy(seen.wrenches) / wrench_std
    loads = network.loads(planes)
    found = network.sum_loads(loads) / wrench_std
    wrench = functional.smooth_l1_loss(found, true, beta=0.3)
    each = functional.smooth_l1_loss(
        loads / load_std,
        torch.from_numpy(seen.loads) / load_std,
        beta=0.5,
        reduction="none",
    )
    maps = (each.mean((1, 2, 3)) * torch.from_numpy(seen.known)).mean()
    return wrench + 2 * maps


def _average(averaged: Any, network: Any, past: float) -> None:
    with torch.no_grad():
        pairs = zip(averaged.state_dict().values(), network.state_dict().values(), strict=True)
        for kept, new in pairs:
            if kept.dtype.is_floating_point:
                kept.mul_(past).add_(new, alpha=1 - past)
            else:
                kept.copy_(new)


def _equalise_axes(std: Any) -> Float32:
    """Return standard deviations in which x and y have the same, and none is 0."""
    spread = np.maximum(np.asarray(std, np.float32), np.float32(1e-6))
    spread[:2] = spread[:2].mean()
    return np.asarray(spread, np.float32)
