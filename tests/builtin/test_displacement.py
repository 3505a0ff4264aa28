"""Dense fields from markers of a virtual gel, compared with ground truth and the papers."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core import ContactMask, DisplacementField, MarkerField, load_profile
from tactile_core.algorithms.displacement.decomposition import decompose_field, divergence
from tactile_core.builtin.contact import Displacement
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.optics.faults import Faults
from tactile_sim.optics.markers import MarkerPrint
from tactile_sim.truth import TrueState

NOISE_PX = 0.1
PROFILE = load_profile("hex_fingertip", sim=True)
SHAPE = (PROFILE.image.height_px, PROFILE.image.width_px)
SCALE_MM = PROFILE.image.mm_per_px
Array = NDArray[np.float64]


@cache
def _rest_px() -> Array:
    printed = MarkerPrint.from_profile(PROFILE, Faults(), seed=0)
    assert printed is not None
    inside = ((printed.rest_px >= 0) & (printed.rest_px <= np.array(SHAPE[::-1]) - 1)).all(1)
    return printed.rest_px[inside]


class Bench:
    """A gel surface under an object, noisy marker positions, and the step under test."""

    def __init__(self, kind: str, *, seed: int = 0, **options: object) -> None:
        place = {key: options.pop(key, 0.0) for key in ("x_mm", "y_mm", "angle_deg")}
        self.surface = GelSurface(PROFILE, "fast")
        self.surface.markers_px = _rest_px()
        self.surface.indent_with(make_indenter(kind, **options), **place)  # type: ignore[arg-type]
        self._rng = np.random.default_rng(seed)
        self._step = Displacement(Displacement.Options(), SensorContext(PROFILE.image, PROFILE.gel))

    def measured(
        self, *, unseen: float = 0.0, contact: bool = True
    ) -> tuple[DisplacementField, TrueState]:
        """The estimated field and the ground truth."""
        truth = self.surface.truth()
        now = truth.markers_px + self._rng.normal(0, NOISE_PX, truth.markers_px.shape)
        seen = ((now >= 0) & (now <= np.array(SHAPE[::-1]) - 1)).all(1)
        seen &= self._rng.random(len(now)) >= unseen
        now[~seen] += 20
        markers = MarkerField(
            np.arange(len(now), dtype=np.int32),
            _rest_px().astype(np.float32),
            now.astype(np.float32),
            seen,
            SCALE_MM,
            7.0,
        )
        mask = ContactMask(truth.contact, SCALE_MM) if contact else None
        return self._step.estimate(markers, mask), truth


def _error(field: DisplacementField, truth: TrueState) -> float:
    """RMS error over the image relative to the peak displacement."""
    off = np.linalg.norm(field.mm - truth.displacement_mm, axis=2)
    return float(np.sqrt(np.mean(off**2)) / np.linalg.norm(truth.displacement_mm, axis=2).max())


def _sheared(bench: Bench) -> None:
    bench.surface.shear(0.15, 0.1)


def _slipping(bench: Bench) -> None:
    for _ in range(5):
        bench.surface.shear(-0.06, 0.08)


def _slid(bench: Bench) -> None:
    for _ in range(8):
        bench.surface.shear(0.15, -0.1)


def _twisted(bench: Bench) -> None:
    for _ in range(4):
        bench.surface.twist(1.5)


OBJECTS = {
    "sphere": ({"diameter_mm": 9.0, "x_mm": 1.3, "y_mm": -0.7}, 0.45),
    "flat": ({"size_mm": (6.0, 4.5), "x_mm": -1.9, "y_mm": 1.1, "angle_deg": 25.0}, 0.3),
    "cylinder": ({"diameter_mm": 24.0, "length_mm": 12.0, "angle_deg": 70.0}, 0.4),
}


def _pressed(kind: str, seed: int = 0) -> Bench:
    options, depth_mm = OBJECTS[kind]
    bench = Bench(kind, seed=seed, **options)
    bench.surface.press(depth_mm)
    return bench


@pytest.mark.parametrize("move", [_sheared, _slipping, _slid, _twisted])
@pytest.mark.parametrize("kind", OBJECTS)
def test_the_error_is_below_a_twentieth_of_the_peak(
    kind: str, move: Callable[[Bench], None]
) -> None:
    bench = _pressed(kind)
    move(bench)
    assert _error(*bench.measured()) < 0.05


@pytest.mark.parametrize("kind", OBJECTS)
def test_missing_markers_add_little_error(kind: str) -> None:
    bench = _pressed(kind)
    _slipping(bench)
    assert _error(*bench.measured(unseen=0.1)) < 0.06
    assert _error(*bench.measured(unseen=0.3)) < 0.09


def test_a_known_contact_reduces_the_error() -> None:
    bench = _pressed("flat")
    _slipping(bench)
    known, unknown = (_error(*bench.measured(contact=given)) for given in (True, False))
    assert known < 0.8 * unknown


def test_under_a_normal_load_the_gel_spreads() -> None:
    bench = Bench("sphere", diameter_mm=9.0)
    bench.surface.press(0.5)
    field, truth = bench.measured()
    assert divergence(field.mm, mm_per_px=SCALE_MM)[truth.contact].mean() > 0.01
    parts = decompose_field(field.mm, truth.contact, mm_per_px=SCALE_MM)
    true = decompose_field(truth.displacement_mm, truth.contact, mm_per_px=SCALE_MM)
    assert parts.spread == pytest.approx(true.spread, rel=0.2)
    assert abs(parts.rotation_deg) < 0.1
    assert np.hypot(*parts.shear_mm) < 0.01


def test_0_6_degrees_rotate_the_whole_contact_and_4_5_its_border_less() -> None:
    bench = Bench("flat", size_mm=(40.0, 40.0))
    bench.surface.press(force_n=45.0)
    before, _ = bench.measured()
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] - (np.array(SHAPE)[:, None, None] - 1) / 2
    radius_mm = SCALE_MM * np.hypot(x, y)

    def turns() -> list[float]:
        since = bench.measured()[0].mm - before.mm
        return [
            decompose_field(since, ring, mm_per_px=SCALE_MM).rotation_deg
            for ring in (radius_mm < 3, radius_mm > 8)
        ]

    bench.surface.twist(0.6)
    np.testing.assert_allclose(turns(), 0.6, rtol=0.05)
    bench.surface.twist(3.9, steps=9)
    inside, outside = turns()
    assert inside == pytest.approx(4.5, rel=0.03)
    assert outside < 3.9


def test_mean_displacement_is_proportional_to_shear_force_and_its_peak_follows_the_object() -> None:
    """From stick through partial to gross slip of a plate that covers the gel."""
    bench = Bench("flat", size_mm=(40.0, 40.0))
    bench.surface.press(force_n=45.0)
    before, _ = bench.measured()
    moved = 0.05 * np.arange(1, 17)
    force, mean, peak = [], [], []
    for _ in moved:
        bench.surface.shear(dy_mm=0.05)
        field, truth = bench.measured()
        since = field.mm - before.mm
        force.append(truth.wrench[1])
        mean.append(since[truth.contact][:, 1].mean())
        peak.append(np.linalg.norm(since[truth.contact], axis=1).max())
    slope = np.dot(force, mean) / np.dot(mean, mean)
    off = np.array(force) - slope * np.array(mean)
    assert 1 - np.var(off) / np.var(force) > 0.99
    follows = moved < 0.61
    np.testing.assert_allclose(np.array(peak)[follows], moved[follows], atol=0.025)
    assert peak[-1] < 0.75


def test_without_markers_the_field_is_zero_and_invalid() -> None:
    markers = MarkerField(
        np.zeros(0, np.int32),
        np.zeros((0, 2), np.float32),
        np.zeros((0, 2), np.float32),
        np.zeros(0, np.bool_),
        SCALE_MM,
    )
    step = Displacement(Displacement.Options(), SensorContext(PROFILE.image, PROFILE.gel))
    field = step.estimate(markers, None)
    assert not field.valid.any()
    assert not field.mm.any()


def _moved(
    px: Array, reference_px: Array, gel: Gel | None = None, step: Displacement | None = None
) -> tuple[DisplacementField, Displacement]:
    """The field of markers in a contact of 2 mm radius, and far from it."""
    image = ImageSection(width_px=160, height_px=120, mm_per_px=0.1)
    step = step or Displacement(Displacement.Options(), SensorContext(image, gel or Gel()))
    distance_px = np.hypot(*(reference_px - np.array([80, 60])).T)
    y, x = np.mgrid[:120, :160]
    markers = MarkerField(
        np.arange(len(px), dtype=np.int32),
        reference_px.astype(np.float32),
        px.astype(np.float32),
        (distance_px < 18) | (distance_px > 40),
        0.1,
    )
    return step.estimate(markers, ContactMask(np.hypot(x - 80, y - 60) < 20, 0.1)), step


LATTICE = np.stack(np.meshgrid(np.arange(5, 160, 10.0), np.arange(5, 120, 10.0)), -1).reshape(-1, 2)


def test_after_a_tare_the_field_is_reported_since_then() -> None:
    loaded = LATTICE + np.array([3.0, -2.0])
    before, step = _moved(loaded, LATTICE)
    tared, _ = _moved(loaded, loaded, step=step)
    assert before.mm[60, 80] == pytest.approx([0.3, -0.2], abs=0.01)
    assert np.abs(tared.mm).max() < 1e-4


def test_a_thicker_gel_moves_further_from_the_contact() -> None:
    sheared = np.hypot(*(LATTICE - np.array([80, 60])).T) < 18
    px = LATTICE + np.array([2.0, 0.0]) * sheared[:, None]
    reached = [
        _moved(px, LATTICE, Gel(thickness_mm=thickness))[0].mm[60, 110, 0]
        for thickness in (0.5, 1.0, 4.0)
    ]
    assert np.all(np.diff(reached) > 0.002)
