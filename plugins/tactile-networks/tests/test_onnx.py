"""Any network by its manifest: what it takes, what it gives, and what is wrong with it."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.onnx_network import written_network

from tactile_core.algorithms.arrays.types import Array
from tactile_core.errors import InputError, TactileError
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.pipeline.chain import Chain
from tactile_core.quantities import (
    DisplacementField,
    Frame,
    HeightMap,
    NetworkOutput,
    Quantity,
    Reference,
)
from tactile_networks.steps import Onnx

WIDTH, HEIGHT = 8, 6
IMAGE = ImageSection(width_px=WIDTH, height_px=HEIGHT, mm_per_px=0.1)
INPUT = {
    "width_px": 4,
    "height_px": 3,
    "planes": [{"of": "frame", "background": "difference", "divide_by": "full_scale"}],
}
VECTOR = {"quantity": "vector", "unit": "mm", "names": ["a", "b"]}


def network(folder: Path, planes: int = 3, count: int = 2, **changed: Any) -> Path:
    """Write a network whose outputs are the sum of its input and 7 more than that, and so on."""
    given = {"input": INPUT, "output": VECTOR} | changed
    size = planes * given["input"]["width_px"] * given["input"]["height_px"]
    weights, bias = np.ones((count, size), np.float32), 7 * np.arange(count, dtype=np.float32)
    return written_network(folder, weights, bias, image=(WIDTH, HEIGHT, 3), planes=planes, **given)


def step(manifest: Path, image: ImageSection = IMAGE, **options: Any) -> Onnx:
    return Onnx(Onnx.Options(manifest=manifest, **options), SensorContext(image, Gel()))


def observed(pixels: Array, reference: Array | None = None) -> tuple[Frame, Reference]:
    base = np.zeros(pixels.shape) if reference is None else reference
    names = tuple(map(str, range(pixels.shape[2])))
    return (
        Frame(pixels.astype(np.uint8), names, 0.1),
        Reference(base.astype(np.float32), names),
    )


def images(value: float, channels: int = 3) -> Array:
    return np.full((HEIGHT, WIDTH, channels), value)


def test_a_network_sees_the_difference_to_the_reference(tmp_path: Path) -> None:
    frame, reference = observed(images(151), images(100))
    found = step(network(tmp_path)).estimate(frame, reference, None, None)
    assert found.names == ("a", "b")
    assert found.unit == "mm"
    assert found.values == pytest.approx([36 * 0.2, 36 * 0.2 + 7], rel=1e-4)


def test_channels_means_scale_and_order_are_those_of_the_manifest(tmp_path: Path) -> None:
    planes = {"of": "frame", "channels": [2, 0], "mean": [10, 0], "std": [2, 1]}
    manifest = network(
        tmp_path,
        planes=2,
        input=INPUT | {"order": "nhwc", "planes": [planes]},
        output=VECTOR | {"scale": 2, "offset": [0, 1]},
    )
    pixels = images(0)
    pixels[...] = [4, 50, 30]
    found = step(manifest).estimate(*observed(pixels), None, None)
    assert found.values[0] == pytest.approx(2 * 12 * (20 / 2 + 4))
    assert found.values[1] == pytest.approx(2 * (12 * 14 + 7) + 1)


def test_frames_are_taken_with_a_stride_and_the_first_is_repeated(tmp_path: Path) -> None:
    planes = {"of": "frame", "channels": [0]}
    manifest = network(
        tmp_path, planes=2, input=INPUT | {"frames": 2, "stride": 2, "planes": [planes]}
    )
    made = step(manifest)
    sums = [made.estimate(*observed(images(v)), None, None).values[0] / 12 for v in (1, 2, 4, 8)]
    assert sums == pytest.approx([1 + 1, 1 + 2, 1 + 4, 2 + 8])
    made.reset()
    assert made.estimate(*observed(images(3)), None, None).values[0] / 12 == pytest.approx(6)


def test_heights_and_displacements_can_be_inputs(tmp_path: Path) -> None:
    manifest = network(
        tmp_path, planes=3, input=INPUT | {"planes": [{"of": "height"}, {"of": "displacement"}]}
    )
    made, valid = step(manifest), np.ones((HEIGHT, WIDTH), np.bool_)
    height = HeightMap(np.full((HEIGHT, WIDTH), 0.5, np.float32), valid, 0.1)
    moved = DisplacementField(np.full((HEIGHT, WIDTH, 2), 0.25, np.float32), valid, 0.1)
    found = made.estimate(*observed(images(0)), height, moved)
    assert found.values[0] == pytest.approx(12)
    with pytest.raises(InputError, match="takes height, which this sensor does not measure"):
        made.estimate(*observed(images(0)), None, moved)


def test_its_output_is_a_quantity_of_the_chain(tmp_path: Path) -> None:
    chain = Chain({"touch": step(network(tmp_path))})
    frame, reference = observed(images(5))
    given: dict[type[Quantity], Quantity] = {Frame: frame, Reference: reference}
    result = chain.run(given).by_type[NetworkOutput]
    assert result.summary()["network"]["unit"] == "mm"
    arrays = result.arrays()
    restored = NetworkOutput.from_arrays(arrays)
    assert restored.names == ("a", "b")
    assert restored.values == pytest.approx(arrays["network_output"])


def fails(manifest: Path, **options: Any) -> str:
    with pytest.raises(TactileError) as caught:
        step(manifest, **options).open()
    return str(caught.value)


def test_an_absent_network_is_named(tmp_path: Path) -> None:
    manifest = network(tmp_path)
    (tmp_path / "network.onnx").unlink()
    assert "names the network network.onnx, which is not beside it" in fails(manifest)
    assert "no such file" in fails(tmp_path / "other.yaml").lower()


def test_another_network_than_the_manifests_is_refused(tmp_path: Path) -> None:
    manifest = network(tmp_path)
    with (tmp_path / "network.onnx").open("ab") as file:
        file.write(b"\0")
    assert "is not the network that network.yaml describes" in fails(manifest)


def test_a_sensor_of_another_size_is_refused(tmp_path: Path) -> None:
    wide = ImageSection(width_px=640, height_px=480, mm_per_px=0.1)
    message = fails(network(tmp_path), image=wide)
    assert "is for images of 8 × 6 px, and this sensor's have 640 × 480" in message


def test_a_sensor_of_other_channels_is_refused(tmp_path: Path) -> None:
    made = step(network(tmp_path))
    with pytest.raises(InputError, match="of 3 channels, and this sensor's have 1"):
        made.estimate(*observed(images(0, channels=1)), None, None)


def test_a_manifest_of_another_input_size_is_refused(tmp_path: Path) -> None:
    network(tmp_path)
    path = tmp_path / "network.yaml"
    path.write_text(path.read_text().replace("  width_px: 4", "  width_px: 5"))
    assert "does not take an input of 1 × 3 × 3 × 5" in fails(path)


def test_a_manifest_of_other_outputs_is_refused(tmp_path: Path) -> None:
    manifest = network(tmp_path, count=5)
    assert "gives 5 values and the manifest names 2" in fails(manifest)


def test_a_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    manifest = network(tmp_path)
    content = b"not a network"
    old = hashlib.sha256((tmp_path / "network.onnx").read_bytes()).hexdigest()
    (tmp_path / "network.onnx").write_bytes(content)
    manifest.write_text(manifest.read_text().replace(old, hashlib.sha256(content).hexdigest()))
    assert "OpenCV cannot load network.onnx" in fails(manifest)


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    assert "pip install onnxruntime" in fails(network(tmp_path), runtime="onnxruntime")


def test_both_libraries_agree(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime", reason="needs the extra onnx")
    manifest, given = network(tmp_path), observed(images(90), images(40))
    by_one, by_other = (
        step(manifest, runtime=name).estimate(*given, None, None).values
        for name in ("opencv", "onnxruntime")
    )
    assert by_one == pytest.approx(by_other, rel=1e-4)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"licence": None}, "licence"),
        ({"sha256": "abc"}, "sha256"),
        ({"input": INPUT | {"planes": []}}, "input.planes"),
        ({"input": INPUT | {"planes": [{"of": "height", "background": "difference"}]}}, "height"),
        ({"output": {"quantity": "wrench", "unit": "N"}}, "a wrench has the names fx, fy, fz, tz"),
        ({"colour": 1}, "colour"),
    ],
)
def test_a_mistake_in_the_manifest_is_named(
    tmp_path: Path, changed: dict[str, Any], words: str
) -> None:
    assert words in fails(network(tmp_path, **changed))


def test_a_wrench_belongs_to_the_force_step(tmp_path: Path) -> None:
    wrench = {"quantity": "wrench", "unit": "N", "names": ["fx", "fy", "fz", "tz"]}
    assert "use networks.force_cnn" in fails(network(tmp_path, count=4, output=wrench))


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"output": VECTOR | {"scale": [1, 2, 3]}}, "scale has 3 values for 2 names"),
        ({"output": VECTOR | {"offset": [1]}}, "offset has 1 values for 2 names"),
        ({"output": VECTOR | {"std": [-1, 1]}}, "output.std"),
        ({"output": VECTOR | {"scale": float("nan")}}, "output.scale"),
        ({"input": INPUT | {"planes": [{"of": "frame", "std": 0}]}}, "std.*greater than 0"),
        (
            {"input": INPUT | {"planes": [{"of": "frame", "channels": [0], "mean": [1, 2]}]}},
            "mean has 2 values for 1 channels",
        ),
    ],
)
def test_numbers_that_cannot_be_used_are_refused(
    tmp_path: Path, changed: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        step(network(tmp_path, **changed))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_weights_that_are_not_finite_are_refused_when_the_network_is_opened(
    tmp_path: Path, value: float
) -> None:
    weights = np.full((2, 36), value, np.float32)
    manifest = written_network(
        tmp_path,
        weights,
        np.zeros(2, np.float32),
        image=(WIDTH, HEIGHT, 3),
        planes=3,
        input=INPUT,
        output=VECTOR,
    )
    with pytest.raises(InputError, match="values that are not finite"):
        step(manifest).open()


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9])
def test_a_truncated_network_with_its_own_hash_is_refused(tmp_path: Path, share: float) -> None:
    manifest = network(tmp_path)
    file = tmp_path / "network.onnx"
    whole = file.read_bytes()
    file.write_bytes(whole[: int(share * len(whole))])
    hashes = [hashlib.sha256(data).hexdigest() for data in (whole, file.read_bytes())]
    manifest.write_text(manifest.read_text("utf-8").replace(*hashes), "utf-8")
    with pytest.raises(InputError, match="network"):
        step(manifest).open()
