"""Force by a network: units, order and tare on a linear one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.onnx_network import written_network

from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import Frame, Reference, Wrench
from tactile_networks.steps import ForceNetwork

IMAGE = ImageSection(width_px=8, height_px=6, mm_per_px=0.1)
INPUT = {"width_px": 1, "height_px": 1, "planes": [{"of": "frame", "background": "difference"}]}
WRENCH = {"quantity": "wrench", "unit": "N", "names": ["fz", "fx", "fy", "tz"]}


def manifest(folder: Path, output: dict[str, Any], **changed: Any) -> Path:
    """Write a network that gives the differences of the three channels, and twice the first."""
    weights = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [2, 0, 0]], np.float32)
    given = {"input": INPUT} | changed
    count = given["input"].get("frames", 1)
    return written_network(
        folder,
        np.tile(weights, (1, count)),
        np.zeros(4, np.float32),
        image=(8, 6, 3),
        planes=3 * count,
        output=output,
        **given,
    )


def step(path: Path, modulus_mpa: float | None = 0.1) -> ForceNetwork:
    gel = Gel(shear_modulus_mpa=modulus_mpa)
    return ForceNetwork(ForceNetwork.Options(manifest=path), SensorContext(IMAGE, gel))


def measured(made: ForceNetwork, *colour: int) -> Wrench:
    names = ("r", "g", "b")
    pixels = np.full((6, 8, 3), colour, np.uint8)
    frame = Frame(pixels, names, 0.1, timestamp_s=2.5)
    return made.estimate(frame, Reference(np.zeros((6, 8, 3), np.float32), names), None, None)


def test_outputs_are_named_by_the_manifest(tmp_path: Path) -> None:
    found = measured(step(manifest(tmp_path, WRENCH)), 5, 1, 2)
    assert found.values == pytest.approx([1, 2, 5, 10])
    assert found.std is None
    assert found.timestamp_s == 2.5


def test_force_over_the_modulus_is_scaled_by_the_profiles(tmp_path: Path) -> None:
    relative = WRENCH | {"unit": "N/MPa", "std": [2, 1, 1, 4], "std_share": 0.0}
    path = manifest(tmp_path, relative)
    found = measured(step(path, 0.2), 5, 1, 2)
    assert found.values == pytest.approx([0.2, 0.4, 1, 2])
    assert found.std == pytest.approx([0.2, 0.2, 0.4, 0.8])
    with pytest.raises(InputError, match=r"give gel\.shear_modulus_mpa"):
        step(path, None)


def test_the_standard_deviation_grows_with_the_force(tmp_path: Path) -> None:
    output = WRENCH | {"std": [1, 1, 1, 1], "std_share": [0.1, 0, 0, 0.2]}
    made = step(manifest(tmp_path, output))
    small, large = measured(made, 1, 0, 0).std, measured(made, 100, 0, 0).std
    assert small is not None
    assert large is not None
    assert small[2] == pytest.approx(1, abs=0.01)
    # the order is fz, fx, fy, tz
    assert large == pytest.approx([1, 1, np.hypot(1, 10), np.hypot(1, 20)])


def test_a_tare_subtracts_the_load_until_the_reset(tmp_path: Path) -> None:
    made = step(manifest(tmp_path, WRENCH))
    whole = measured(made, 9, 3, 4)
    assert not made.tare(whole).values.any()
    assert measured(made, 10, 5, 4).values == pytest.approx([2, 0, 1, 2])
    made.reset()
    assert measured(made, 9, 3, 4).values == pytest.approx(whole.values)


def test_a_vector_belongs_to_the_other_step(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"use networks\.onnx for it"):
        step(manifest(tmp_path, {"quantity": "vector"}))


def test_several_frames_belong_to_the_other_step(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="takes one frame at a time"):
        step(manifest(tmp_path, WRENCH, input=INPUT | {"frames": 2}))
