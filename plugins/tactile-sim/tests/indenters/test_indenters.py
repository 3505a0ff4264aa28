"""Indenters have the right shape, and invalid options are refused in one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.errors import InputError
from tactile_sim.indenters import KINDS, make_indenter

EXAMPLES: dict[str, dict[str, Any]] = {
    "sphere": {"diameter_mm": 4.0},
    "cylinder": {"diameter_mm": 38.08, "length_mm": 30.0},
    "flat": {"size_mm": (8.0, 6.0)},
    "cone": {},
    "heightmap": {"height_mm": np.eye(5), "mm_per_px": 0.5},
    "coin": {},
    "screw": {},
    "letters": {"text": "GEL"},
    "cloth": {},
}


@pytest.mark.parametrize("kind", list(EXAMPLES))
def test_every_object_has_a_lowest_point_at_zero(kind: str) -> None:
    x, y = np.meshgrid(np.linspace(-8, 8, 641), np.linspace(-8, 8, 641))
    gap = make_indenter(kind, **EXAMPLES[kind]).gap_mm(x, y)
    assert gap.shape == x.shape
    assert np.isfinite(gap).all()
    assert gap.min() == pytest.approx(0, abs=2e-3)
    assert gap.min() >= 0


def test_every_kind_except_files_is_tested_above() -> None:
    assert set(KINDS) == set(EXAMPLES) | {"mesh"}


@given(x=st.floats(-1.9, 1.9), y=st.floats(-1.9, 1.9))
def test_sphere_is_round(x: float, y: float) -> None:
    ball = make_indenter("sphere", diameter_mm=6.0)
    gap = float(ball.gap_mm(np.array([x]), np.array([y]))[0])
    assert x**2 + y**2 + (3 - gap) ** 2 == pytest.approx(9)


def test_cylinder_axis_is_along_x() -> None:
    gap = make_indenter("cylinder", diameter_mm=10.0, length_mm=8.0).gap_mm
    zero = np.zeros(1)
    assert gap(np.array([3.0]), zero) == 0
    assert gap(zero, np.array([3.0])) == pytest.approx(5 - 4)
    assert gap(np.array([4.5]), zero) > 100


def test_cone_has_its_angle() -> None:
    gap = make_indenter("cone", half_angle_deg=60.0, tip_mm=0.0).gap_mm
    assert gap(np.array([2.0]), np.zeros(1)) == pytest.approx(2 / np.tan(np.radians(60)))


@pytest.mark.parametrize("half_angle_deg", [30.0, 60.0, 75.0])
def test_the_tip_of_a_cone_is_tangent_to_its_side(half_angle_deg: float) -> None:
    gap = make_indenter("cone", half_angle_deg=half_angle_deg, tip_mm=0.5).gap_mm
    r = np.linspace(0, 2, 2001)
    slope = np.gradient(gap(r, np.zeros_like(r)), r)
    side = 1 / np.tan(np.radians(half_angle_deg))
    assert slope[0] == pytest.approx(0, abs=0.01)
    assert slope[-1] == pytest.approx(side)
    assert slope.max() <= side + 1e-6
    assert np.abs(np.diff(slope)).max() < 0.02


def test_flat_punch_has_the_given_size() -> None:
    gap = make_indenter("flat", size_mm=(8.0, 6.0), edge_mm=0.2).gap_mm
    x, y = np.meshgrid(np.linspace(-5, 5, 1001), np.linspace(-5, 5, 1001))
    area = (gap(x, y) < 0.21).sum() * 0.01**2
    assert area == pytest.approx(48.0, rel=0.02)
    assert gap(np.array([3.7]), np.array([2.7])) == 0


def test_height_map_is_exact_at_its_points_and_empty_at_nan() -> None:
    height = np.random.default_rng(1).uniform(0, 1, (7, 9))
    height[0, 0] = np.nan
    gap = make_indenter("heightmap", height_mm=height, mm_per_px=0.5).gap_mm
    x, y = np.meshgrid((np.arange(9) - 4) * 0.5, (np.arange(7) - 3) * 0.5)
    found = gap(x, y)
    seen = np.isfinite(height)
    np.testing.assert_allclose(found[seen], (np.nanmax(height) - height)[seen], atol=1e-6)
    assert found[0, 0] > 100
    assert gap(np.array([30.0]), np.array([0.0])) > 100


def test_screw_has_its_pitch() -> None:
    gap = make_indenter("screw", diameter_mm=6.0, pitch_mm=1.0).gap_mm
    x = np.linspace(-2, 2, 401)
    along = gap(x, np.zeros_like(x))
    np.testing.assert_allclose(along[:301], along[100:], atol=1e-9)
    assert np.ptp(along) == pytest.approx(5 / 8 * np.sqrt(3) / 2, rel=0.01)


def test_cloth_alternates_over_and_under() -> None:
    gap = make_indenter("cloth", pitch_mm=0.8).gap_mm
    crossings = np.array([0.0, 0.8, 1.6])
    over = gap(crossings, np.zeros(3))
    np.testing.assert_allclose(over, 0, atol=1e-9)  # one thread or the other is always on top


@pytest.mark.parametrize(
    ("kind", "options", "message"),
    [
        ("spere", {"diameter_mm": 4.0}, "do you mean 'sphere'"),
        ("sphere", {}, "needs diameter_mm"),
        ("sphere", {"radius_mm": 2.0}, "no option 'radius_mm'"),
        ("sphere", {"diameter_mm": -4.0}, "above 0, not -4"),
        ("flat", {}, "either diameter_mm or size_mm"),
        ("flat", {"diameter_mm": 1.0, "edge_mm": 3.0}, "0 to 0.5 mm"),
        ("cone", {"half_angle_deg": 95.0}, "below 90, not 95"),
        ("heightmap", {"height_mm": np.zeros(5), "mm_per_px": 0.1}, "two dimensions"),
        ("heightmap", {"height_mm": np.full((3, 3), np.nan), "mm_per_px": 0.1}, "finite"),
        ("letters", {"text": "  "}, "printable ASCII"),
        ("screw", {"pitch_mm": 9.0}, "half its diameter"),
    ],
)
def test_invalid_options_are_refused_in_one_sentence(
    kind: str, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        make_indenter(kind, **options)
    assert "\n" not in str(caught.value)


@pytest.fixture
def trimesh() -> Any:
    return pytest.importorskip("trimesh")


def test_mesh_of_a_ball_is_a_ball(trimesh: Any, tmp_path: Path) -> None:
    file = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=4, radius=3.0).export(file)
    mesh = make_indenter("mesh", path=file)
    ball = make_indenter("sphere", diameter_mm=6.0)
    x, y = np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-2, 2, 41))
    np.testing.assert_allclose(mesh.gap_mm(x, y), ball.gap_mm(x, y), atol=0.02)
    assert mesh.gap_mm(np.array([3.5]), np.zeros(1)) > 100


def test_mesh_shows_the_side_towards_the_gel(trimesh: Any, tmp_path: Path) -> None:
    file = tmp_path / "cone.stl"
    cone = trimesh.creation.cone(radius=3.0, height=3.0)
    cone.apply_transform(trimesh.transformations.rotation_matrix(np.pi, [1, 0, 0]))
    cone.export(file)
    gap = make_indenter("mesh", path=file).gap_mm
    x = np.array([0.0, 1.0, 2.0])
    np.testing.assert_allclose(gap(x, np.zeros(3)), [0, 1, 2], atol=0.08)


@pytest.mark.parametrize("path", [0, 1.5, None, [], True])
def test_a_mesh_path_that_is_not_a_name_is_refused(path: Any) -> None:
    with pytest.raises(InputError, match="a mesh's path"):
        make_indenter("mesh", path=path)


def test_trimesh_log_lines_are_suppressed_on_refusal(
    trimesh: Any, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "broken.stl"
    lines = ["solid block", "facet normal 0 0 -1", "outer loop", "vertex -1 -1 0", "vertex 1 -1 0"]
    lines += ["\nvertex 0 1 0", "\nendloop", "endfacet", "endsolid block", "\n"]
    file.write_bytes("\r".join(lines).encode())
    with pytest.raises(InputError):
        make_indenter("mesh", path=file)
    assert caplog.records == []


def test_open_or_unreadable_meshes_are_refused(trimesh: Any, tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=1, radius=3.0)
    ball.update_faces(np.arange(len(ball.faces)) > 3)
    ball.export(tmp_path / "open.stl")
    with pytest.raises(InputError, match="not a closed mesh"):
        make_indenter("mesh", path=tmp_path / "open.stl")
    with pytest.raises(InputError, match="is not a file"):
        make_indenter("mesh", path=tmp_path / "none.stl")
    (tmp_path / "words.stl").write_text("these are words")
    with pytest.raises(InputError, match=r"words\.stl"):
        make_indenter("mesh", path=tmp_path / "words.stl")
