"""Frames per second of virtual rigs while a ball slides: ``python benchmarks/bench_sim.py``.

Prints the processor time of each part of a frame, which other load on the machine barely affects,
and the throughput in wall-clock frames per second, including JPEG compression: of one rig, and of
``--processes`` rigs at once.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor

PROFILES = ("hex_fingertip", "baxter_fingertip", "desktop_six_led")
STRIDE_MM, STRIDES = 0.1, 30
"""Shear displacement per frame in mm, and number of frames in one direction."""
WARM_UP = 5
"""Frames before timing starts."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("profiles", nargs="*", default=PROFILES)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    print("median ms of mechanics, resampling, optics, JPEG, total; frames per second")
    for name in given.profiles:
        spent = parts_ms(name, given.frames)
        parts = " ".join(f"{ms:6.1f}" for ms in [*spent, sum(spent)])
        alone = frames_per_second(name, 0, given.frames)
        with ProcessPoolExecutor(given.processes) as pool:
            seeds = range(given.processes)
            many = [pool.submit(frames_per_second, name, seed, given.frames) for seed in seeds]
            together = sum(one.result() for one in many)
        print(f"{name:24s}{parts}   one {alone:5.1f}   {given.processes} at once {together:5.1f}")


def parts_ms(name: str, frames: int) -> list[float]:
    """Median processor time of mechanics, resampling, optics and JPEG."""
    import numpy as np

    from tactile_core.profiles.loader import load_profile
    from tactile_sim.gel_surface import GelSurface
    from tactile_sim.indenters import make_indenter
    from tactile_sim.optics import RigOptics

    one_thread()
    profile = load_profile(name, sim=True)
    surface, optics = GelSurface(profile, "fast"), RigOptics(profile)
    surface.markers_px = optics.markers_px
    surface.indent_with(make_indenter("sphere", diameter_mm=6.0), x_mm=-1.5)
    surface.press(depth_mm=0.4)
    spent = []
    for number, dx_mm in zip(range(WARM_UP + frames), strides(), strict=False):
        clock = [time.process_time()]
        surface.shear(dx_mm)
        clock.append(time.process_time())
        truth = surface.truth()
        height, moved = truth.height_mm, truth.displacement_mm
        markers = truth.markers_px if len(truth.markers_px) else None
        clock.append(time.process_time())
        pixels = optics.expose(height, moved, markers, frame=number)
        clock.append(time.process_time())
        compress(pixels)
        clock.append(time.process_time())
        spent.append(np.diff(clock))
    return list(1e3 * np.median(spent[WARM_UP:], axis=0))


def frames_per_second(name: str, seed: int, frames: int) -> float:
    """Wall-clock frames per second, from the median time of a whole frame."""
    import numpy as np

    from tactile_sim import VirtualStage

    one_thread()
    stage = VirtualStage(name, seed)
    stage.indenter("sphere", diameter_mm=6.0, x_mm=-1.5)
    stage.press(depth_mm=0.4)
    taken = []
    for _, dx_mm in zip(range(WARM_UP + frames), strides(), strict=False):
        began = time.perf_counter()
        stage.shear(dx_mm=dx_mm)
        compress(stage.frame().pixels)
        taken.append(time.perf_counter() - began)
    return float(1 / np.median(taken[WARM_UP:]))


def strides() -> Iterator[float]:
    """Shear displacements in mm: back and forth."""
    while True:
        for sign in (1, -1):
            yield from [sign * STRIDE_MM] * STRIDES


def compress(pixels) -> None:
    import cv2
    import numpy as np

    for first in range(0, pixels.shape[2], 3):
        cv2.imencode(".jpg", np.ascontiguousarray(pixels[..., first : first + 3]))


def one_thread() -> None:
    import cv2

    cv2.setNumThreads(1)


if __name__ == "__main__":
    main()
