"""The network, in torch. This module imports torch; import it inside functions."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import nn

from tactile_core.algorithms.arrays.types import Float32, Float64
from tactile_core.sim.force_data import CELL_PX, cell_centres_mm


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
