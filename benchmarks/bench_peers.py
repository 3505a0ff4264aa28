"""This project against methods of other projects, alternating in one run.

``OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/bench_peers.py [ROW …]``

Prints for each task the median processor times, and the median of the rounds' ratios, ours to the
peer's. A row is chosen by a part of its
name. Whole frames are 36 different moving frames of ``hex_fingertip``: a ball that is pressed and
sheared, with markers tracked and slip detected. The other projects' methods are in ``peers.py``,
which must not change between two measurements.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from itertools import cycle
from pathlib import Path
from time import process_time
from typing import Any

import cv2
import numpy as np
import peers
from numpy.typing import NDArray
from peers import PerPixelNetwork, Table, poisson_by_cosines, poisson_by_sines, stereo

from tactile_core.acquisition.devices import make_lights
from tactile_core.algorithms.poisson import integrate
from tactile_core.calibration.virtual_unit import VirtualUnit, virtual_unit
from tactile_core.evaluation.own_resources import one_thread
from tactile_core.interfaces.calibration import Press
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.illumination import Light
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.plugins.options import calibrator_of
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Gradients

Array = NDArray[Any]
Work = Callable[[], Any]
Size = tuple[int, int]

PEERS_SHA256 = "d3e255f25ba07bfa2aa577e313da2b597a82d2e11120b8bde9bbc74aa2bf89b6"
"""Of ``peers.py``, so that ratios of different days compare with the same methods."""

FITTED_PIXELS = 20_000
ROUNDS, COSTLY_ROUNDS, FRAMES = 15, 3, 12
"""Alternations, those of tasks that take seconds, and frames per alternation (counts)."""

MOVING_FRAMES = 36
"""Different frames, so that none is measured again and again."""

VGA, QVGA, HD, SIX = (640, 480), (320, 240), (1920, 1080), (2448, 2048)


@dataclass(frozen=True)
class Row:
    """One task, done in the peer's way and in ours.

    Attributes
    ----------
    peer : callable
    ours : callable
    times : int
        Calls of ours in each round, of which the median counts.
    rounds : int
    """

    peer: Work
    ours: Work
    times: int = 1
    rounds: int = ROUNDS


def whole_frames(size: Size) -> Row:
    """Every step of the profile, against another project's heights alone."""
    unit = unit_of("hex_fingertip", size)
    return against_network(unit, unit.stroke)


def heights_and_contact(size: Size) -> Row:
    """The same without markers."""
    unit = unit_of("hex_fingertip_unmarked", size, "core.mlp")
    return against_network(unit, unit.stroke)


def against_network(unit: VirtualUnit, frames: tuple[Any, ...]) -> Row:
    network = PerPixelNetwork(unit.bundle.reference.pixels)
    image = frames[0].pixels
    return Row(lambda: network.height(image), next_frame(unit, frames), times=FRAMES)


def table(size: Size) -> Row:
    """A lookup table from colours to slopes."""
    unit = unit_of("hex_fingertip_unmarked", size, "core.lookup_table")
    reference, image = unit.bundle.reference.pixels, unit.stroke[0].pixels
    made = Table(*target_pixels(unit)[1:])
    return Row(lambda: made.height(image, reference), next_frame(unit, unit.stroke), times=FRAMES)


def six_exposures(size: Size) -> Row:
    """Six large images to heights, against smoothing these images."""
    unit = unit_of("desktop_six_led", size)
    planes = np.ascontiguousarray(unit.stroke[0].pixels.transpose(2, 0, 1))
    ours = next_frame(unit, unit.stroke)
    return Row(lambda: [cv2.GaussianBlur(p, (5, 5), 0) for p in planes], ours, rounds=COSTLY_ROUNDS)


def six_slopes(size: Size) -> Row:
    """Slopes by photometric stereo."""
    unit = unit_of("desktop_six_led", size)
    bundle, frame = unit.bundle, unit.stroke[0]
    towards = np.array([direction(light) for light in make_lights(unit.profile).lights])
    return Row(
        lambda: stereo(frame.pixels, towards),
        lambda: bundle.calibration.measure(frame, bundle.reference),
        times=FRAMES,
    )


def table_fit(size: Size) -> Row:
    """Fitting a lookup table to the same pixels."""
    unit = unit_of("hex_fingertip_unmarked", size, "core.lookup_table")
    presses, changes, slopes = target_pixels(unit)
    calibrator = calibrator_of(Component(use="core.lookup_table"))

    def ours() -> Any:
        return calibrator.fit(presses, unit.bundle.reference)

    return Row(lambda: Table(changes, slopes), ours, rounds=COSTLY_ROUNDS)


def poisson(size: Size, boundary: Any, peer: Callable[[Array, Array], Array]) -> Row:
    """Integration of slopes alone."""
    shape = size[::-1]
    height, gx, gy = ball(shape)
    error = peer(gx, gy) - height
    assert np.abs(error - error.mean()).max() < 0.02 * height.max(), peer.__name__
    g32 = gx.astype(np.float32), gy.astype(np.float32)
    return Row(
        lambda: peer(gx, gy),
        lambda: integrate(*g32, mm_per_px=1.0, boundary=boundary),
        times=FRAMES,
    )


ROWS: dict[str, Callable[[], Row]] = {
    "whole frame, 640 × 480": lambda: whole_frames(VGA),
    "whole frame, 320 × 240": lambda: whole_frames(QVGA),
    "whole frame, 1920 × 1080": lambda: whole_frames(HD),
    "RGB to height and contact, network": lambda: heights_and_contact(VGA),
    "RGB to height and contact, table": lambda: table(VGA),
    "six exposures, 2448 × 2048, ÷ blur": lambda: six_exposures(SIX),
    "six exposures to slopes, 640 × 480": lambda: six_slopes(VGA),
    "Poisson, free border": lambda: poisson(VGA, "neumann", poisson_by_cosines),
    "Poisson, fixed border": lambda: poisson(VGA, "dirichlet", poisson_by_sines),
    "fit of a table": lambda: table_fit(VGA),
}


@cache
def unit_of(name: str, size: Size, model: str | None = None) -> VirtualUnit:
    profile = load_profile(name)
    return virtual_unit(profile, size_px=size, model=model, stroke_frames=MOVING_FRAMES)


def next_frame(unit: VirtualUnit, frames: tuple[Any, ...]) -> Work:
    """This project's processing of the next frame."""
    pipeline, coming = Pipeline(unit.profile, unit.bundle), cycle(frames)
    return lambda: pipeline.process(next(coming))


def ball(shape: tuple[int, int]) -> tuple[Array, Array, Array]:
    """Height in px and slopes of a smooth bump in closed form."""
    y, x = (np.arange(n) - n / 2 for n in shape)
    width = min(shape) / 8
    height = 0.3 * width * np.exp(-(x**2 + y[:, None] ** 2) / (2 * width**2))
    return height, -height * x / width**2, -height * y[:, None] / width**2


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


def median_ms(work: Work, times: int = 1) -> float:
    """Median processor time of a few calls."""
    taken = []
    for _ in range(times):
        start = process_time()
        work()
        taken.append(1e3 * (process_time() - start))
    return float(np.median(taken))


def measured(row: Row) -> Array:
    """(rounds, 2) ms: the peer's way, and ours."""
    for work in (row.ours,) * 4:  # the first calls prepare
        work()
    row.peer()
    times = [(median_ms(row.peer), median_ms(row.ours, row.times)) for _ in range(row.rounds)]
    return np.array(times)


def main() -> None:
    """Print the chosen rows."""
    if sha256(Path(peers.__file__).read_bytes()).hexdigest() != PEERS_SHA256:
        raise SystemExit("peers.py has changed, so ratios do not compare with earlier ones")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", nargs="*", help="parts of the names of rows; default: all")
    chosen = parser.parse_args().rows
    print(f"{'ms':36}{'peer':>9}{'ours':>9}{'÷':>9}")
    for name, make in ROWS.items():
        if chosen and not any(part in name for part in chosen):
            continue
        with one_thread():
            times = measured(make())
        peer, ours = np.median(times, axis=0)
        ratio = np.median(times[:, 1] / times[:, 0])
        print(f"{name:36}{peer:9.2f}{ours:9.2f}{ratio:9.3f}", flush=True)


if __name__ == "__main__":
    main()
