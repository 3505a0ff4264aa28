"""Methods of other projects against those of this one, alternating in one run.

``OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/bench_peers.py [--size 640x480]``

Prints medians in ms and the median of the rounds' ratios. The other projects' methods are in
``peers.py``. Ours include more work: compensation of illumination drift, smoothing, and lights
whose direction varies over the image. "RGB to height" is all of ``Pipeline.process``, including
contact detection.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from peers import PerPixelNetwork, Table, poisson_by_cosines, poisson_by_sines, stereo

from tactile_core.algorithms.poisson import PoissonSolver
from tactile_core.evaluation.timing.unit import VirtualUnit, virtual_unit
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.illumination import Light
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import make_lights
from tactile_core.plugins.calibrators import calibrator_of
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Gradients

Array = NDArray[Any]

FITTED_PIXELS = 20_000


@dataclass(frozen=True)
class Pair:
    """One task, done both ways."""

    task: str
    peer: Callable[[], Any]
    ours: Callable[[], Any]
    costly: bool = False
    """It takes seconds rather than milliseconds, so it is repeated only a few times."""


def reading_of(unit: VirtualUnit) -> Callable[[], Reading]:
    """This project's processing from an RGB frame to height and contact."""
    pipeline = Pipeline(unit.profile, unit.bundle)
    return lambda: pipeline.process(unit.frames[1])


def ball(shape: tuple[int, int]) -> tuple[Array, Array, Array]:
    """Height in px and slopes of a smooth bump in closed form."""
    y, x = (np.arange(n) - n / 2 for n in shape)
    width = min(shape) / 8
    height = 0.3 * width * np.exp(-(x**2 + y[:, None] ** 2) / (2 * width**2))
    return height, -height * x / width**2, -height * y[:, None] / width**2


def pairs(size: tuple[int, int]) -> list[Pair]:
    """All comparisons at one image size."""
    shape = (size[1], size[0])
    unmarked = load_profile("hex_fingertip_unmarked")
    by_network = virtual_unit(unmarked, size_px=size, model="core.mlp")
    by_table = virtual_unit(unmarked, size_px=size, model="core.lookup_table")
    six = virtual_unit(load_profile("desktop_six_led"), size_px=size)
    reference = by_network.bundle.reference.pixels
    image = by_network.frames[1].pixels
    network = PerPixelNetwork(reference)

    presses, changes, slopes = target_pixels(by_table)
    table = Table(changes, slopes)
    calibrator = calibrator_of(Component(use="core.lookup_table"))
    lights = make_lights(six.profile).lights
    towards = np.array([direction(light) for light in lights])

    height, gx, gy = ball(shape)
    free = PoissonSolver(shape, mm_per_px=1.0)
    held = PoissonSolver(shape, mm_per_px=1.0, boundary="dirichlet")
    gx32, gy32 = gx.astype(np.float32), gy.astype(np.float32)
    for solve in (poisson_by_cosines, poisson_by_sines):
        error = solve(gx, gy) - height
        assert np.abs(error - error.mean()).max() < 0.02 * height.max(), solve.__name__
    return [
        Pair(
            "Poisson, Neumann",
            lambda: poisson_by_cosines(gx, gy),
            lambda: free.solve(gx32, gy32),
        ),
        Pair(
            "Poisson, Dirichlet", lambda: poisson_by_sines(gx, gy), lambda: held.solve(gx32, gy32)
        ),
        Pair("RGB to height, network", lambda: network.height(image), reading_of(by_network)),
        Pair("RGB to height, table", lambda: table.height(image, reference), reading_of(by_table)),
        Pair(
            "six images to slopes",
            lambda: stereo(six.frames[1].pixels, towards),
            lambda: six.bundle.calibration.measure(six.frames[1], six.bundle.reference),
        ),
        Pair(
            "fit of a table",
            lambda: Table(changes, slopes),
            lambda: calibrator.fit(presses, by_table.bundle.reference),
            costly=True,
        ),
    ]


def target_pixels(unit: VirtualUnit) -> tuple[list[Press], Array, Array]:
    """Pixels with ground-truth slopes: as presses, and as colour changes with slopes."""
    rng, reference = np.random.default_rng(0), unit.bundle.reference.pixels
    presses, changes, slopes = [], [], []
    for frame in unit.frames:
        measured = unit.bundle.calibration.measure(frame, unit.bundle.reference)
        assert isinstance(measured, Gradients)
        rows = rng.integers(0, reference.shape[0], FITTED_PIXELS // len(unit.frames))
        columns = rng.integers(0, reference.shape[1], len(rows))
        targets = np.stack([measured.x[rows, columns], measured.y[rows, columns]], 1)
        presses.append(Press(frame, rows.astype(np.int32), columns.astype(np.int32), targets))
        changes.append(frame.pixels[rows, columns].astype(float) - reference[rows, columns])
        slopes.append(targets)
    return presses, np.concatenate(changes), np.concatenate(slopes)


def direction(light: Light) -> tuple[float, float, float]:
    """Unit vector towards a light."""
    azimuth, elevation = np.radians([light.azimuth_deg, light.elevation_deg])
    across = np.cos(elevation)
    return across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)


def measured_ms(work: Callable[[], Any]) -> float:
    start = perf_counter()
    work()
    return 1e3 * (perf_counter() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    width, height = (int(side) for side in options.size.split("x"))
    every = pairs((width, height))
    times: list[list[tuple[float, float]]] = [[] for _ in every]
    for turn in range(options.rounds + 1):
        for pair, taken in zip(every, times, strict=True):
            if pair.costly and turn > 3:
                continue
            both = measured_ms(pair.peer), measured_ms(pair.ours)
            if turn > 0:  # the first one prepares tables
                taken.append(both)
    print(f"{width} × {height}; ms, median; peers' methods as in peers.py")
    print(f"{'':<26}{'peers':>10}{'ours':>10}{'ratio':>8}")
    for pair, taken in zip(every, times, strict=True):
        peer, ours = np.median(taken, axis=0)
        ratio = np.median([theirs / mine for theirs, mine in taken])
        print(f"{pair.task:<26}{peer:>10.2f}{ours:>10.2f}{ratio:>8.1f}")


if __name__ == "__main__":
    main()
