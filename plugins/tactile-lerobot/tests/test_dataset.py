"""Data sets, read back with pyarrow, and with LeRobot's own class in an environment of its own."""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from support.readings import SHAPE, contact, height, markers, slopes

from tactile_core.errors import InputError
from tactile_core.interfaces.sink import Reading, Session
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, HeightMap, Image, MarkerDetections, Quantity, SlipState
from tactile_core.recordings.output_folder import OutputFolder
from tactile_lerobot.dataset import Dataset, DatasetOptions

ROOT = Path(__file__).resolve().parents[3]
READER = Path(__file__).parent / "reader" / "read_dataset.py"


def reading(number: int, *quantities: Quantity, image: Image | None = None) -> Reading:
    rng = np.random.default_rng(number)
    frame = Frame(
        rng.integers(0, 255, (*SHAPE, 3), np.uint8),
        ("r", "g", "b"),
        0.1,
        timestamp_s=5 + number / 20,
        wall_time_s=1.7e9 + number / 20,
        sequence=number,
        raw=() if image is None else (image,),
    )
    return Reading(frame, {type(q): q for q in quantities}, {})


def seen(count: int) -> MarkerDetections:
    numbers = np.arange(count, dtype=np.float32)
    return MarkerDetections(np.stack([numbers, numbers], 1), numbers > 0)


def jpeg(level: int) -> Image:
    encoded = cv2.imencode(".jpg", np.full((16, 24, 3), level, np.uint8))[1]
    return Image(cv2.imdecode(encoded, 1)[..., ::-1], encoded=encoded.tobytes())


def dataset(folder: Path, *readings: Reading, **options: Any) -> Path:
    sink = Dataset(DatasetOptions(**options))
    build = load_profile("hex_fingertip")
    sink.open(Session(build, "0007", ("r", "g", "b"), (), OutputFolder(folder)))
    for one in readings:
        sink.write(one)
    sink.close()
    return folder / "hex_fingertip-0007.lerobot"


def frames(path: Path) -> Any:
    return pq.read_table(path / "data/chunk-000/file-000.parquet")


def info(path: Path) -> Any:
    return json.loads((path / "meta/info.json").read_text("utf-8"))


def test_numbers_units_and_axes_are_those_of_the_readings(tmp_path: Path) -> None:
    taken = [reading(n, height(n / 8), slopes(), contact()) for n in range(3)]
    path = dataset(tmp_path, *taken)
    table, features = frames(path), info(path)["features"]
    tall = np.array(table["observation.height_mm"].to_pylist(), np.float32)
    np.testing.assert_array_equal(tall[:, 0, 0], [0, 0.125, 0.25])
    assert features["observation.height_mm"] == {
        "dtype": "float32",
        "shape": list(SHAPE),
        "names": None,
        "info": {"quantity": "HeightMap", "unit": "mm", "axes": ["y", "x"]},
    }
    assert features["observation.gradients"]["shape"] == [*SHAPE, 2]
    assert table["observation.timestamp_ns"].to_pylist() == [
        5 * 10**9 + n * 50_000_000 for n in range(3)
    ]
    assert info(path)["fps"] == 20
    assert table["timestamp"].to_pylist() == pytest.approx([0, 0.05, 0.1])


def test_a_gap_stays_a_gap_and_jitter_does_not_show(tmp_path: Path) -> None:
    jitter_s = (0.0, 0.004, -0.006, 0.003, 0.0)
    taken = [
        replace(one, frame=replace(one.frame, timestamp_s=one.frame.timestamp_s + late_s))
        for one, late_s in zip(map(reading, (0, 1, 2, 43, 44)), jitter_s, strict=True)
    ]
    table = frames(dataset(tmp_path, *taken))
    assert table["timestamp"].to_pylist() == pytest.approx([0, 0.05, 0.1, 2.15, 2.2])
    assert table["frame_index"].to_pylist() == table["index"].to_pylist() == [0, 1, 2, 3, 4]


def test_a_jpeg_stays_the_camera_s_own_bytes(tmp_path: Path) -> None:
    image = jpeg(90)
    path = dataset(tmp_path, reading(0, image=image))
    (cell,) = frames(path)["observation.images.camera"].to_pylist()
    assert cell["bytes"] == image.encoded
    assert info(path)["features"]["observation.images.camera"]["shape"] == [16, 24, 3]


def test_pixels_are_kept_without_loss(tmp_path: Path) -> None:
    taken = reading(0)
    (cell,) = frames(dataset(tmp_path, taken))["observation.images.image"].to_pylist()
    pixels = cv2.imdecode(np.frombuffer(cell["bytes"], np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(pixels[..., ::-1], taken.frame.pixels)


def test_images_of_16_bits_are_arrays(tmp_path: Path) -> None:
    pixels = np.arange(12, dtype=np.uint16).reshape(3, 4) * 5000
    table = frames(dataset(tmp_path, reading(0, image=Image(pixels))))
    np.testing.assert_array_equal(table["observation.camera"].to_pylist()[0], pixels)


def test_a_varying_number_of_markers_is_padded_and_counted(tmp_path: Path) -> None:
    path = dataset(tmp_path, reading(0), reading(1, seen(3)), reading(2, seen(1)))
    table = frames(path)
    name = "observation.MarkerDetections.centres_px"
    assert table[f"{name}.count"].to_pylist() == [0, 3, 1]
    centres = np.array(table[name].to_pylist(), float)
    assert centres.shape == (3, 3, 2)
    assert np.isnan(centres[0]).all()
    assert np.isnan(centres[2, 1:]).all()
    np.testing.assert_array_equal(centres[1], seen(3).centres_px)


def test_text_stays_text(tmp_path: Path) -> None:
    table = frames(dataset(tmp_path, reading(0, SlipState("stick", 0.0)), reading(1)))
    assert table["observation.slip_state"].to_pylist() == ["stick", ""]


def test_statistics_are_those_of_the_values(tmp_path: Path) -> None:
    path = dataset(tmp_path, *(reading(n, height(n / 8)) for n in range(3)))
    statistics = json.loads((path / "meta/stats.json").read_text())
    tall = statistics["observation.height_mm"]
    assert (tall["min"], tall["max"], tall["count"]) == ([[0.0]], [[0.25]], [3])
    assert tall["mean"][0][0] == pytest.approx(0.125)
    assert np.shape(statistics["observation.images.image"]["mean"]) == (3, 1, 1)


def test_what_is_not_wanted_is_left_out(tmp_path: Path) -> None:
    path = dataset(tmp_path, reading(0, height(), slopes()), leave_out=["gradients"], fps=7)
    features = info(path)["features"]
    assert "observation.gradients" not in features
    assert "observation.valid" in features
    assert info(path)["fps"] == 7


def test_a_data_set_is_never_overwritten(tmp_path: Path) -> None:
    dataset(tmp_path, reading(0))
    with pytest.raises(InputError, match="already exists; move it away"):
        dataset(tmp_path, reading(0))


def test_without_a_frame_there_is_no_data_set(tmp_path: Path) -> None:
    assert not dataset(tmp_path).exists()


def test_lerobot_s_own_class_reads_the_same_numbers(tmp_path: Path) -> None:
    python = Path(os.environ.get("TACTILE_LEROBOT", ROOT / ".venv-lerobot/bin/python"))
    if not python.is_file():
        pytest.skip("LeRobot is not installed; 'make test-exports' does so, or set TACTILE_LEROBOT")
    taken = [
        reading(n, height(n / 8), slopes(), contact(), markers(), seen(n), SlipState("stick", 0.5),
                image=jpeg(40 * n))
        for n in range(4)
    ]  # fmt: skip
    path = dataset(tmp_path, *taken, task="press")
    out = tmp_path / "read.npz"
    ended = subprocess.run(
        [python, READER, path, out],
        capture_output=True,
        text=True,
        env={**os.environ, "HF_HUB_OFFLINE": "1", "HF_HOME": str(tmp_path / "cache")},
    )
    assert ended.returncode == 0, ended.stderr
    back = np.load(out)
    about = json.loads(str(back["about"]))
    assert (about["frames"], about["episodes"], about["fps"]) == (4, 1, 20)
    assert about["cameras"] == ["observation.images.camera"]
    for number, one in enumerate(taken):
        np.testing.assert_array_equal(back["observation.height_mm"][number], one[HeightMap].mm)
        pixels = back["observation.images.camera"][number].transpose(1, 2, 0) * 255
        np.testing.assert_array_equal(np.rint(pixels), one.frame.raw[0].pixels)
    assert about["features"]["observation.height_mm"]["info"]["unit"] == "mm"
    assert set(back["observation.slip_state"]) == {"stick"}
    assert set(back["task"]) == {"press"}
    assert back["observation.MarkerDetections.centres_px.count"].tolist() == [0, 1, 2, 3]
    assert back["pair"][0].tolist() == [5_000_000_000, 5_050_000_000]
    assert about["batch"]["observation.height_mm"] == [2, *SHAPE]
