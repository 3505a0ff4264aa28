"""Force by inverting the mechanics of the gel: ``python experiments/elastic_force.py``.

Virtual units are calibrated and pressed with shapes that nobody trained on; height, contact and
displacement are those that the whole chain measures in rendered images. Pressure is found in the
contact by conjugate gradients, shear traction as a polynomial in the contact by least squares; both
move the surface as the elastic layer does. Prints R² of each component against the simulator's
force, also with wrong properties of the gel, and after one common factor, which a wrong modulus
takes.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from time import perf_counter

import cv2
import numpy as np

from experiments.virtual_unit import VirtualUnit
from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.elasticity import Elastomer
from tactile_core.quantities import ContactMask, DisplacementField, HeightMap
from tactile_core.sim.elastic_layer import ElasticLayer
from tactile_core.sim.grid import Grid

CELL_PX = 8
MARGIN = 1.6
"""Size of the periodic grid over that of the view."""
DAMPING = 0.004
"""Share of the largest normal compliance that is added to it, against noise of the height."""
ITERATIONS, TOLERANCE = 25, 1e-2
DEGREE = 2
"""Of the polynomial in each component of the shear traction."""
RIDGE = 1e-4

SHAPES: tuple[tuple[str, dict[str, float], float], ...] = (
    ("sphere", {"diameter_mm": 6}, 0.6),
    ("sphere", {"diameter_mm": 12}, 0.6),
    ("sphere", {"diameter_mm": 25}, 0.6),
    ("sphere", {"diameter_mm": 50}, 0.6),
    ("cylinder", {"diameter_mm": 10, "length_mm": 12}, 0.45),
    ("cylinder", {"diameter_mm": 22, "length_mm": 12}, 0.45),
    ("flat", {"diameter_mm": 6}, 0.3),
    ("flat", {"diameter_mm": 9}, 0.3),
)
"""Kind, sizes and greatest depth in mm."""

WRONG = ((1.0, 1.0, 1.0), (1.1, 1, 1), (1, 0.9, 1), (1, 1.1, 1), (1, 1, 0.9), (1, 1, 1.04))
"""Factors on modulus, thickness and Poisson's ratio."""


@dataclass(frozen=True)
class Sample:
    """What the chain measured on cells of the image, and the force that acted.

    Attributes
    ----------
    indentation_mm : (h, w)
    contact : (h, w) bool
    displacement_mm : (h, w, 2)
    valid : (h, w) bool
    cell_mm : float
    wrench : (4,)
        fx, fy, fz in N and tz in N·mm.
    gel : Elastomer
    """

    indentation_mm: Array
    contact: Array
    displacement_mm: Array
    valid: Array
    cell_mm: float
    wrench: Array
    gel: Elastomer


def samples(rig: str, seed: int) -> list[Sample]:
    """Press, shear and twist every shape on one unit."""
    unit, rng = VirtualUnit(rig, seed, {}), np.random.default_rng(seed)
    stage, pipeline = unit.stage, unit.pipeline
    found = []

    def measured() -> None:
        reading, truth = pipeline.process(stage.frame()), stage.truth()
        height, field = reading[HeightMap], reading[DisplacementField]
        found.append(
            Sample(
                cells(height.mm),
                cells(reading[ContactMask].mask) > 0.5,
                cells(field.mm),
                cells(field.valid) > 0.5,
                CELL_PX * height.mm_per_px,
                truth.wrench,
                stage.gel.elastomer,
            )
        )

    for kind, sizes, deepest_mm in SHAPES:
        for _ in range(2):
            stage.reset()
            pipeline.reset()
            pipeline.process(stage.frame())
            x_mm, y_mm = rng.uniform(-0.2, 0.2, 2) * unit.view_mm
            angle = float(rng.uniform(0, 180))
            stage.indenter(kind, x_mm=float(x_mm), y_mm=float(y_mm), angle_deg=angle, **sizes)
            stage.press(depth_mm=float(deepest_mm * rng.uniform(0.4, 1)))
            measured()
            way, far_mm = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.5)
            dx, dy = far_mm * np.cos(way) / 3, far_mm * np.sin(way) / 3
            for _ in range(2):
                stage.shear(dx_mm=float(dx), dy_mm=float(dy))
                pipeline.process(stage.frame())
            stage.shear(dx_mm=float(dx), dy_mm=float(dy))
            measured()
            stage.twist(degrees=float(rng.uniform(-8, 8)), steps=3)
            measured()
    return found


def cells(image: Array) -> Array:
    """Average over the cells."""
    size = image.shape[1] // CELL_PX, image.shape[0] // CELL_PX
    return np.asarray(cv2.resize(image.astype(np.float32), size, interpolation=cv2.INTER_AREA))


def force(sample: Sample, layer: ElasticLayer) -> Array:
    """Return fx, fy, fz in N and tz in N·mm about the image centre."""
    if not sample.contact.any():
        return np.zeros(4)
    pressure = pressed(sample, layer)
    traction = sheared(sample, layer, pressure)
    rows, columns = sample.contact.shape
    y, x = (
        np.mgrid[:rows, :columns] - np.array([rows - 1, columns - 1])[:, None, None] / 2
    ).astype(float) * sample.cell_mm
    fx, fy = traction.sum((1, 2))
    tz = (x * traction[1] - y * traction[0]).sum()
    return np.array([fx, fy, pressure.sum(), tz]) * sample.cell_mm**2


def pressed(sample: Sample, layer: ElasticLayer) -> Array:
    """Return the pressure in the contact, MPa, that indents the surface as measured."""
    inside = sample.contact
    damping = DAMPING * layer.softest

    def indented(pressure: Array) -> Array:
        moved = np.asarray(layer.indentation(pressure)) + damping * pressure
        return np.where(inside, moved, 0)

    left = np.where(inside, sample.indentation_mm, 0).astype(float)
    pressure, way = np.zeros_like(left), left.copy()
    size = first = float((left**2).sum())
    for _ in range(ITERATIONS):
        if size <= TOLERANCE**2 * first:
            break
        moved = indented(way)
        step = size / float((way * moved).sum())
        pressure += step * way
        left -= step * moved
        former, size = size, float((left**2).sum())
        way = left + size / former * way
    return pressure


def sheared(sample: Sample, layer: ElasticLayer, pressure: Array) -> Array:
    """Return the shear traction (2, h, w), MPa, that moves the surface as measured."""
    inside, valid = sample.contact, sample.valid
    rows, columns = np.nonzero(inside)
    y, x = np.mgrid[: inside.shape[0], : inside.shape[1]].astype(float)
    x, y = (x - columns.mean()) / max(columns.std(), 1), (y - rows.mean()) / max(rows.std(), 1)
    powers = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
    shares = [np.where(inside, x**i * y**j, 0.0) for i, j in powers]
    none = np.zeros_like(x)
    tractions = [np.stack(pair) for one in shares for pair in ((one, none), (none, one))]
    moves = np.stack([np.asarray(layer.shift(one))[:, valid].ravel() for one in tractions], 1)
    measured = np.moveaxis(sample.displacement_mm, 2, 0) - np.asarray(layer.spread(pressure))
    normal = moves.T @ moves
    normal += RIDGE * np.diag(np.diag(normal))
    weights = np.linalg.solve(normal, moves.T @ measured[:, valid].ravel())
    return np.asarray(np.tensordot(weights, np.stack(tractions), 1))


def layer_of(sample: Sample, factors: tuple[float, float, float]) -> ElasticLayer:
    """Return the layer with properties that are wrong by these factors."""
    modulus, thickness, poisson = factors
    gel = Elastomer(
        sample.gel.thickness_mm * thickness,
        sample.gel.shear_modulus_mpa * modulus,
        min(0.5, sample.gel.poisson_ratio * poisson),
    )
    rows, columns = sample.contact.shape
    grid = Grid.covering(
        MARGIN * columns * sample.cell_mm, MARGIN * rows * sample.cell_mm, sample.cell_mm
    )
    return ElasticLayer(grid, gel, np.float64)


def r_squared(found: Array, true: Array) -> Array:
    """R² of each column."""
    rest = ((found - true) ** 2).sum(0)
    return np.asarray(1 - rest / ((true - true.mean(0)) ** 2).sum(0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", default="hex_fingertip")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    given = parser.parse_args()
    taken = [sample for seed in given.seeds for sample in samples(given.rig, seed)]
    true = np.array([sample.wrench for sample in taken])
    print(f"{len(taken)} samples; largest {np.abs(true).max(0).round(2)} N, N, N, N·mm")
    print("modulus, thickness, Poisson's ratio: R² of fx, fy, fz, tz; after one factor each; ms")
    for factors in WRONG:
        layer = layer_of(taken[0], factors)
        began_s = perf_counter()
        found = np.array([force(sample, layer) for sample in taken])
        each_ms = 1e3 * (perf_counter() - began_s) / len(taken)
        scaled = found * (found * true).sum(0) / (found**2).sum(0)
        shown = [" ".join(f"{one:6.3f}" for one in r_squared(by, true)) for by in (found, scaled)]
        print(f"{factors}: {shown[0]} | {shown[1]} | {each_ms:.1f}", flush=True)


if __name__ == "__main__":
    main()
