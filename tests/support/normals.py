"""Reads the normals that a run writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactile_core.formats.images import read_image


def read_normals(path: Path) -> np.ndarray:
    """Return (H, W, 3) float32 unit normals, accurate to 2e-5."""
    codes = read_image(path)
    assert codes.dtype == np.uint16
    normals = codes.astype(np.float32) * np.float32(2 / 65535) - 1
    return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True), np.float32)
