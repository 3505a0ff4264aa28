"""A mesh matches its header and the sensor frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.formats.tmd import write_ply
from tactile_core.quantities import HeightMap


def parse(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and triangles as the header describes them."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    assert list(counts) == ["vertex", "face"]
    assert [line for line in lines if line.startswith("property")] == [
        "property float x",
        "property float y",
        "property float z",
        "property list uchar int vertex_indices",
    ]
    vertices = np.frombuffer(body, "<f4", 3 * counts["vertex"]).reshape(-1, 3)
    faces = np.frombuffer(body[vertices.nbytes :], np.dtype("u1, (3,)<i4"), counts["face"])
    assert len(body) == vertices.nbytes + faces.nbytes
    assert (faces["f0"] == 3).all()
    return vertices, faces["f1"]


def points(height_mm: np.ndarray) -> np.ndarray:
    return HeightMap(height_mm, np.ones(height_mm.shape, bool), 0.5).points_mm


def test_vertices_are_on_the_gel_surface(tmp_path: Path) -> None:
    height = np.random.default_rng(0).normal(size=(4, 6)).astype(np.float32)
    write_ply(tmp_path / "a.ply", points(height))
    vertices, _ = parse(tmp_path / "a.ply")
    np.testing.assert_array_equal(vertices[:, 2], -height.ravel())
    np.testing.assert_allclose(vertices[:, :2].mean(0), 0, atol=1e-6)
    assert vertices[1, 0] - vertices[0, 0] == pytest.approx(0.5)
    assert vertices[6, 1] - vertices[0, 1] == pytest.approx(0.5)


def test_triangles_cover_the_map_once_and_face_the_camera(tmp_path: Path) -> None:
    write_ply(tmp_path / "a.ply", points(np.zeros((4, 6), np.float32)))
    vertices, faces = parse(tmp_path / "a.ply")
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.cross(b - a, c - a) / 2
    assert (area[:, 2] < 0).all()  # the camera is on the side of negative z
    assert -area[:, 2].sum() == pytest.approx(5 * 0.5 * 3 * 0.5)
    assert np.unique(faces).tolist() == list(range(24))


def test_a_map_of_one_row_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="2 × 2"):
        write_ply(tmp_path / "a.ply", points(np.zeros((1, 6), np.float32)))
