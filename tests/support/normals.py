"""Normals of surfaces, and what a run writes of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactile_core.formats.images import read_image


def to_gradient(normal_xy: np.ndarray) -> np.ndarray:
    """(..., 2) slopes of unit normals with these x and y components, shorter than 0.98."""
    facing = np.sqrt(1 - np.minimum((normal_xy**2).sum(-1, keepdims=True), 0.98**2))
    return np.asarray(normal_xy / facing, np.float32)


def read_normals(path: Path) -> np.ndarray:
    """Return (H, W, 3) float32 unit normals, accurate to 2e-5."""
    codes = read_image(path)
    assert codes.dtype == np.uint16
    normals = codes.astype(np.float32) * np.float32(2 / 65535) - 1
    return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True), np.float32)
