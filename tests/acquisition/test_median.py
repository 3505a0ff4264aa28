"""A reference from frames in which something presses elsewhere each time."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.acquisition.median import median_reference
from tactile_core.errors import InputError
from tactile_core.quantities import Frame

SHAPE = (24, 32, 3)
GEL: NDArray[np.float64] = np.add.outer(np.linspace(90, 160, 24), np.zeros((32, 3)))


def frames(count: int, noise: float = 0.0, pressed: float = 0.3) -> list[Frame]:
    """Frames in which each pixel is changed with a probability."""
    rng = np.random.default_rng(5)
    touched = rng.random((count, *SHAPE[:2], 1)) < pressed
    levels = GEL + noise * rng.normal(size=(count, *SHAPE)) + 60 * touched
    return [Frame(np.rint(level).astype(np.uint8), ("r", "g", "b"), 0.1) for level in levels]


def test_pixels_that_are_mostly_undeformed_keep_their_light() -> None:
    reference, _ = median_reference(frames(21, pressed=0.2))
    assert (reference.frames, reference.channels) == (21, ("r", "g", "b"))
    assert np.abs(reference.pixels - GEL).max() <= 0.5


def test_the_deviation_is_the_size_of_the_error() -> None:
    made = frames(40, noise=4.0, pressed=0.0)
    reference, note = median_reference(made)
    error = np.std(reference.pixels - GEL)
    said = re.search(r"up to ([\d.]+) grey levels in half", note)
    assert said is not None
    assert float(said[1]) == pytest.approx(error, rel=0.25)
    assert reference.noise == pytest.approx(4.0, rel=0.1)


def test_of_many_frames_evenly_spaced_ones_are_used() -> None:
    reference, note = median_reference(frames(300))
    assert reference.frames <= 64
    assert f"median of {reference.frames} frames" in note


def test_two_frames_have_no_median_that_is_a_reference() -> None:
    with pytest.raises(InputError, match="give a recording of three or more"):
        median_reference(frames(2))
