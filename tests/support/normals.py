"""Slopes of surfaces whose normals are known."""

import numpy as np


def to_gradient(normal_xy: np.ndarray) -> np.ndarray:
    """(..., 2) slopes of unit normals with these x and y components, shorter than 0.98."""
    facing = np.sqrt(1 - np.minimum((normal_xy**2).sum(-1, keepdims=True), 0.98**2))
    return np.asarray(normal_xy / facing, np.float32)
