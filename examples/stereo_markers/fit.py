"""Fit one session and score another: ``python examples/stereo_markers/fit.py ONE.h5 OTHER.h5``.

Prints R² of fx, fy and fz both ways and on held-out segments, for three methods.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from layer_loads import Layer, load_moments
from mixture import combined, fitted
from session import Session, read_session

from tactile_core.algorithms.arrays.types import Float64, Intp

LAYERS = tuple(
    Layer(thickness, damping) for thickness in (2.0, 3.0, 4.0) for damping in (0.01, 0.03)
)
"""Assumed thicknesses and dampings: none is known, so that all are averaged."""
MOTION = 0.3
"""Weight of the markers' own motion beside the moments of the loads."""
METHODS = ("ridge on the motion", "few load moments", "mixture")


class Described:
    """A session and the moments of the loads of each frame, for each layer."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.moments = {
            layer: load_moments(session.markers_mm, session.moved_mm, layer) for layer in LAYERS
        }

    def designs(self, method: str) -> list[tuple[Float64, Float64]]:
        """Return the features of each regression of a method, and their scale."""
        frames = len(self.session.forces)
        motion = self.session.moved_mm.reshape(frames, -1)
        if method == METHODS[0]:
            return [_scaled(motion, 1.0)]
        found = []
        for moments in self.moments.values():
            sums = moments[:, :, 0]
            levers = np.concatenate([sums, moments[:, 2, 1:3]], 1)
            found += [_scaled(sums), _scaled(levers)]
            if method == METHODS[2]:
                whole, own = _scaled(moments.reshape(frames, -1)), _scaled(motion, 1 / MOTION)
                pair = zip(whole, own, strict=True)
                features, scale = (np.concatenate(both, -1) for both in pair)
                found.append((features, scale))
        return found


def _scaled(features: Float64, common: float | None = None) -> tuple[Float64, Float64]:
    squares = features**2
    size = np.sqrt(squares.mean(0)) if common is None else np.sqrt(squares.mean()) * common
    return features, np.broadcast_to(size, features.shape[1:]).copy()


def predicted(one: Described, rows: Intp, other: Described, to: Intp, method: str) -> Float64:
    """Fit some frames of one session and predict some of another."""
    forces, segments = one.session.forces[rows, :3], one.session.segments[rows]
    results = []
    for (mine, scale), (theirs, _) in zip(one.designs(method), other.designs(method), strict=True):
        model = fitted(mine[rows], scale, forces, segments)
        results.append(model.predict(theirs[to]))
    return combined(results)[0]


def r_squared(found: Float64, true: Float64) -> Float64:
    """R² of each column."""
    rest = ((found - true) ** 2).sum(0)
    return np.asarray(1 - rest / ((true - true.mean(0)) ** 2).sum(0))


def held_out(one: Described, method: str, folds: int = 5) -> Float64:
    """R² on segments that were not fitted."""
    found = np.zeros((len(one.session.forces), 3))
    blocks = one.session.segments % folds
    for fold in range(folds):
        out = np.flatnonzero(blocks == fold)
        found[out] = predicted(one, np.flatnonzero(blocks != fold), one, out, method)
    return r_squared(found, one.session.forces[:, :3])


def main() -> None:
    """Print the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("one", type=Path)
    parser.add_argument("other", type=Path)
    parser.add_argument("--raw", action="store_true", help="keep the drift of the load cell's zero")
    given = parser.parse_args()
    both = [
        Described(read_session(path, drift_removed=not given.raw))
        for path in (given.one, given.other)
    ]
    names = given.one.stem, given.other.stem
    for method in METHODS:
        for index, one in enumerate(both):
            other = both[1 - index]
            all_rows = (np.arange(len(which.session.forces)) for which in (one, other))
            mine, theirs = all_rows
            found = predicted(one, mine, other, theirs, method)
            across = r_squared(found, other.session.forces[:, :3])
            inside = held_out(one, method)
            print(
                f"{method}: {names[index]} to {names[1 - index]} {_words(across)}; "
                f"held-out segments of {names[index]} {_words(inside)}",
                flush=True,
            )


def _words(values: Float64) -> str:
    return " ".join(f"{value:.3f}" for value in values)


if __name__ == "__main__":
    main()
