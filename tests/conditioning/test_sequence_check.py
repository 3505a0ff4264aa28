"""Exposures of a sequence are verified from their content."""

from dataclasses import replace

import numpy as np
import pytest

from tactile_core.conditioning.conditioning import is_sequential, pattern_of, verify
from tactile_core.errors import SequenceError
from tactile_core.quantities import Frame

LIGHTS = ("east", "north", "west")
y, x = np.mgrid[:96, :128] / 96
SHADING = np.stack([60 + 80 * x, 60 + 100 * y, 170 - 80 * x], axis=2).astype(np.uint8)
SEQUENCE = Frame(SHADING, LIGHTS, 0.02, exposure_times_s=(0.0, 0.1, 0.2))


def test_a_frame_is_sequential_if_each_channel_has_a_time() -> None:
    assert is_sequential(SEQUENCE)
    assert not is_sequential(replace(SEQUENCE, exposure_times_s=()))


def test_the_reference_passes() -> None:
    verify(SEQUENCE, pattern_of(SEQUENCE), "reference")


def test_two_swapped_exposures_are_named_with_the_lights_that_they_show() -> None:
    swapped = replace(SEQUENCE, pixels=SHADING[..., [1, 0, 2]])
    with pytest.raises(SequenceError, match=r"press: .*'east' shows light 'north'"):
        verify(swapped, pattern_of(SEQUENCE), "press")


def test_a_dark_exposure_is_found_without_a_reference() -> None:
    dark = SHADING.copy()
    dark[..., 1] = 2
    with pytest.raises(SequenceError, match="'north' is dark"):
        verify(replace(SEQUENCE, pixels=dark), None, "press")
