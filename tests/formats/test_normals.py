"""Normals are written to a PNG and read back."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from support.normals import read_normals

from tactile_core.formats.images import write_normals
from tactile_core.quantities import Gradients

SLOPES = arrays(np.float32, (4, 5), elements=st.floats(-20, 20, width=32))


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(SLOPES, SLOPES)
def test_normals_are_read_back_within_2e_5(tmp_path: Path, gx: np.ndarray, gy: np.ndarray) -> None:
    normals = Gradients(gx, gy, np.ones(gx.shape, bool), 0.1).normals
    write_normals(tmp_path / "n.png", normals)
    back = read_normals(tmp_path / "n.png")
    np.testing.assert_allclose(back, normals, atol=2e-5)
    np.testing.assert_allclose(np.linalg.norm(back, axis=2), 1, atol=1e-6)


def test_red_green_and_blue_are_x_y_and_z(tmp_path: Path) -> None:
    normals = np.eye(3, dtype=np.float32)[None]
    write_normals(tmp_path / "n.png", normals)
    stored = cv2.imread(str(tmp_path / "n.png"), cv2.IMREAD_UNCHANGED)[..., ::-1]
    assert stored.dtype == np.uint16
    assert stored[0].argmax(axis=1).tolist() == [0, 1, 2]
    assert stored.max() == 65535
    assert abs(int(stored.min()) - 32768) <= 1
