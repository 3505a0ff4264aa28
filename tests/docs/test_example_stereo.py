"""The example of markers in three dimensions, on a session made by the gel's own mechanics."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tactile_core.errors import InputError

h5py = pytest.importorskip("h5py")
FOLDER = Path(__file__).resolve().parents[2] / "examples" / "stereo_markers"
MODULES = ("session", "layer_loads", "mixture")


@pytest.fixture(scope="module")
def example() -> Iterator[dict[str, ModuleType]]:
    """The example's modules, imported from its folder."""
    from importlib import import_module

    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(FOLDER)
        yield {name: import_module(name) for name in MODULES}
    for name in MODULES:
        sys.modules.pop(name, None)


def markers() -> Any:
    line = np.linspace(-6, 6, 7)
    return np.stack(np.meshgrid(line, line), -1).reshape(-1, 2)


def written(path: Path, **changes: Any) -> Path:
    """Write a session whose load cell drifts while contacts begin and end."""
    times_s = np.arange(60) / 15
    forces = np.zeros((60, 6))
    forces[:, 2] = -2 * np.abs(np.sin(times_s * 2))
    forces[:, 0] = 0.1 * times_s
    forces[:, 5] = 0.002
    with h5py.File(path, "w") as file:
        at = markers()
        whole = {
            "vision/dxyz": np.zeros((60, len(at), 3), np.float32),
            "reference/xyz_ref": np.concatenate([at, np.zeros((len(at), 1))], 1),
            "force/values": forces,
            "force/segment_id": np.arange(60) // 10,
            "force/timestamp": times_s,
            **changes,
        }
        for name, values in whole.items():
            if values is not None:
                file[name] = values
    return path


def test_forces_have_the_signs_of_a_wrench_and_no_drift(
    example: dict[str, ModuleType], tmp_path: Path
) -> None:
    path = written(tmp_path / "s.h5")
    session = example["session"].read_session(path)
    assert session.forces[:, 2].min() >= 0
    assert session.forces[:, 3] == pytest.approx(-2.0)
    assert np.abs(session.forces[:, 0]).max() < 0.01
    raw = example["session"].read_session(path, drift_removed=False)
    assert np.abs(raw.forces[:, 0]).max() > 0.3


def test_another_file_is_refused(example: dict[str, ModuleType], tmp_path: Path) -> None:
    read = example["session"].read_session
    with pytest.raises(InputError, match="no session of stereo markers"):
        read(written(tmp_path / "a.h5", **{"vision/dxyz": None}))
    with pytest.raises(InputError, match="do not belong to its frames"):
        read(written(tmp_path / "b.h5", **{"force/values": np.zeros((7, 6))}))


def test_the_sums_of_the_loads_are_proportional_to_the_force(
    example: dict[str, ModuleType],
) -> None:
    loads = example["layer_loads"]
    response, nodes = loads._response(markers(), 3.0)
    acting = np.zeros((3, len(nodes), 3))
    middle = int(np.argmin(((nodes - [1.0, -1.0]) ** 2).sum(1)))
    acting[:, middle, 2] = [1.0, 2.0, 2.0]
    acting[2, middle, 0] = 1.0
    moved = (acting.reshape(3, -1) @ response.T).reshape(3, -1, 3)
    moments = loads.load_moments(markers(), moved, loads.Layer(3.0, 1e-3))
    pressure, shear = moments[:, 2, 0], moments[:, 0, 0]
    assert pressure[1] == pytest.approx(2 * pressure[0], rel=1e-6)
    # a nearly incompressible layer hardly resists an even pressure, which damping leaves open
    assert pressure[1] == pytest.approx(pressure[2], rel=0.05)
    assert np.abs(shear[:2]).max() < 0.1 * shear[2]
    assert shear[2] == pytest.approx(1.0, rel=0.2)
    centre = moments[1, 2, 1:3] / pressure[1]
    assert np.sign(centre).tolist() == np.sign(nodes[middle]).tolist()


def test_a_regression_that_extrapolates_counts_less(example: dict[str, ModuleType]) -> None:
    mixture = example["mixture"]
    rng = np.random.default_rng(0)
    narrow = rng.normal(size=(200, 2)) * [1.0, 0.02]
    forces = np.stack([narrow[:, 0]] * 3, 1) + 0.05 * rng.normal(size=(200, 3))
    segments = np.arange(200) // 5
    both = mixture.fitted(narrow, np.ones(2), forces, segments)
    one = mixture.fitted(narrow[:, :1], np.ones(1), forces, segments)
    far = np.array([[1.0, 3.0]])
    of_both, of_one = both.predict(far), one.predict(far[:, :1])
    assert of_both[1].max() > 3 * of_one[1].max()
    mixed, variance = mixture.combined([of_both, of_one])
    assert np.abs(mixed - of_one[0]).max() < np.abs(mixed - of_both[0]).max() + 1e-12
    assert (variance > 0).all()
