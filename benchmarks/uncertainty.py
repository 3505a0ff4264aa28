"""Standard deviations compared with errors: ``python benchmarks/uncertainty.py``.

Virtual units of three rigs are calibrated on presses of a ball and measure other objects. Standard
deviations have to discriminate: 68 % of the errors are smaller in each fifth of the pixels, sorted
by standard deviation; standard deviation and error are correlated in rank; and the median standard
deviation is at most 1.3 times the root mean square error.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from displacement_virtual import PROFILE, drawn, frames, undeformed
from numpy.typing import NDArray
from virtual_calibration import Draw, command, simulated

from tactile_core import Pipeline
from tactile_core.formats.npz import read_npz
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import DisplacementField

RIGS = ("hex_fingertip", "hex_fingertip_unmarked", "baxter_fingertip")

EVERY = 4
"""Every fourth pixel of every fourth row is compared."""

Array = NDArray[np.floating]


class Compared(NamedTuple):
    """Standard deviations (N,) and errors (N, J) of J components, with the contact area (N,)."""

    std: Array
    errors: Array
    contact: NDArray[np.bool_]


class Quality(NamedTuple):
    """How well standard deviations describe errors.

    Attributes
    ----------
    coverage : tuple of float
        Share of the errors below one standard deviation, in each fifth of the standard deviations.
    rank : float
        Rank correlation of the standard deviation and the mean error of the components.
    ratio : float
        Median standard deviation divided by the root mean square error.
    """

    coverage: tuple[float, ...]
    rank: float
    ratio: float

    @classmethod
    def of(cls, std: Array, errors: Array) -> Quality:
        """Compare standard deviations (N,) with errors (N, J)."""
        from scipy.stats import spearmanr

        size = np.abs(errors)
        fifths = np.array_split(np.argsort(std, kind="stable"), 5)
        coverage = tuple(float((size[k] <= std[k, None]).mean()) for k in fifths)
        rank = float(spearmanr(std, size.mean(axis=1)).statistic)
        return cls(coverage, rank, float(np.median(std) / np.sqrt(np.mean(size**2))))

    def __str__(self) -> str:
        coverage = " ".join(f"{100 * share:3.0f}" for share in self.coverage)
        return f"{coverage} %   rank {self.rank:5.2f}   median / RMSE {self.ratio:4.2f}"


def calibrated(profile: str, folder: Path, seed: int) -> Iterator[tuple[str, Compared]]:
    """Yield slopes and heights of other objects, measured by a calibrated virtual unit."""
    draw = Draw(load_profile(profile), seed)
    ball, other = folder / "ball", folder / "other"
    simulated(profile, draw.calibrating(16), ball, seed)
    simulated(profile, list(draw.others(2)), other, seed)
    reference = ("--reference", str(ball / "reference"))
    command(
        *("calibrate", profile, "--presses", str(ball / "frames"), *reference),
        *("--ball-diameter-mm", str(draw.ball_mm), "--out", str(folder / "bundle")),
    )
    command(
        *("run", profile, "--input", str(other / "frames"), *reference),
        *("--bundle", str(folder / "bundle"), "--out", str(folder / "results")),
    )
    for path in sorted((folder / "results").glob("*.npz")):
        measured, true = read_npz(path), read_npz(other / "truth" / path.name)
        if not true["contact"].any():
            continue
        for name, std in (("gradients", "gradients_std"), ("height_mm", "height_std_mm")):
            yield name, _compared(measured[std], measured[name] - true[name], true["contact"])


def sheared(objects: int, seed: int) -> Iterator[Compared]:
    """Yield displacements under sheared and twisted objects, without a calibration."""
    for plan in drawn(objects, seed):
        taken = frames(plan)
        pipeline = Pipeline(PROFILE, None, undeformed(next(taken)[0]))
        for frame, truth in taken:
            field = pipeline.process(frame)[DisplacementField]
            std_mm = field.std_mm
            assert std_mm is not None
            yield _compared(std_mm, field.mm - truth.displacement_mm, truth.contact)


def _compared(std: Array, errors: Array, contact: NDArray[np.bool_]) -> Compared:
    at = (slice(None, None, EVERY), slice(None, None, EVERY))
    errors = errors[at].reshape(std[at].size, -1)
    return Compared(std[at].ravel(), errors, contact[at].ravel())


def report(name: str, parts: list[Compared]) -> None:
    """Print the quality over the whole image and over the contact."""
    std, errors, contact = (np.concatenate(values) for values in zip(*parts, strict=True))
    print(f"{name:36} image    {Quality.of(std, errors)}", flush=True)
    print(f"{'':36} contact  {Quality.of(std[contact], errors[contact])}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", choices=RIGS)
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12])
    parser.add_argument("--objects", type=int, default=12)
    options = parser.parse_args()
    print(f"{'':45}fifths of the standard deviation, small to large")
    for profile in RIGS:
        if options.rig not in (None, profile):
            continue
        parts = defaultdict[str, list[Compared]](list)
        for seed in options.seeds:
            with TemporaryDirectory(prefix="uncertainty-") as folder:
                for name, part in calibrated(profile, Path(folder), seed):
                    parts[name].append(part)
        for name, found in parts.items():
            report(f"{profile} {name}", found)
    for seed in options.seeds:
        report(f"{PROFILE} displacement, seed {seed}", list(sheared(options.objects, seed)))


if __name__ == "__main__":
    main()
