"""``tactile calibrate-surface`` and the distances and angles of the next run."""

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.command_line import refused, tactile

from tactile_core.profiles.loader import load_profile
from tactile_tactip.dome import Plate, picture, pins_at_rest, pressed_pins

Array = np.ndarray[Any, Any]

IMAGE = load_profile("tactip").image
REAL_COLUMNS = "image_name,pose_2,pose_6"


def write_image(path: Path, image: Array) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image)


def write_presses(folder: Path, count: int, seed: int) -> Path:
    """Presses of a plate in contact, at many angles, and their labels."""
    rng = np.random.default_rng(seed)
    lines = ["file,distance_mm,angle_deg"]
    for number in range(count):
        plate = Plate(float(rng.uniform(0.5, 3.5)), float(rng.uniform(-20, 20)))
        image = picture(pressed_pins(plate), IMAGE, number=1000 * seed + number)
        write_image(folder / "frames" / f"press_{number:03d}.png", image)
        lines.append(f"press_{number:03d}.png,{plate.depth_mm},{plate.angle_deg}")
    (folder / "labels.csv").write_text("\n".join(lines) + "\n")
    return folder


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Labelled presses, others to measure, and the sensor without contact."""
    folder = tmp_path_factory.mktemp("tactip")
    write_presses(folder / "labelled", 150, 1)
    write_presses(folder / "others", 40, 2)
    write_image(folder / "no_contact.png", picture(pins_at_rest(), IMAGE, number=0))
    return folder


@pytest.fixture
def words(bench: Path) -> Callable[..., list[object]]:
    """Returns the words of the command, with options replaced or, for None, left out."""

    def made(**options: object) -> list[object]:
        given = {
            "input": bench / "labelled" / "frames",
            "labels": bench / "labelled" / "labels.csv",
            "reference": bench / "no_contact.png",
            "out": bench / "unused",
            **options,
        }
        pairs = [(f"--{name}", value) for name, value in given.items() if value is not None]
        return ["calibrate-surface", "tactip", *(word for pair in pairs for word in pair)]

    return made


def measured(bundle: Path, frames: Path) -> dict[str, Any]:
    done = tactile("run", "tactip", "--bundle", bundle, "--input", frames, "--json")
    assert done.returncode == 0, done.stderr
    lines = map(json.loads, done.stdout.splitlines())
    return {line["source"]: line["surface"] for line in lines}


def errors(found: dict[str, Any], labels: Path, columns: str) -> tuple[Array, Array]:
    """Errors (N, 2) of distance and angle, and the deviations that were printed."""
    file, distance, angle = columns.split(",")
    with labels.open() as lines:
        rows = [row for row in csv.DictReader(lines) if Path(row[file]).stem in found]
    poses = [found[Path(row[file]).stem] for row in rows]
    true = [[float(row[distance]), float(row[angle])] for row in rows]
    values = [[pose["distance_mm"], pose["angle_deg"]] for pose in poses]
    std = [[pose["distance_std_mm"], pose["angle_std_deg"]] for pose in poses]
    return np.array(values) - np.array(true), np.array(std)


def test_labelled_presses_give_distance_and_angle_of_others(
    bench: Path, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    done = tactile(*words(out=tmp_path / "bundle"))
    assert done.returncode == 0, done.stderr
    head, columns, distance, angle = done.stdout.splitlines()
    assert head.endswith("distance and angle fitted to 150 presses")
    assert columns.split()[:3] == ["held", "out", "RMS"]
    assert float(distance.split()[1]) < 0.15
    assert float(angle.split()[1]) < 3
    found = measured(tmp_path / "bundle", bench / "others" / "frames")
    error, std = errors(found, bench / "others" / "labels.csv", "file,distance_mm,angle_deg")
    rms = np.sqrt((error**2).mean(axis=0))
    assert rms[0] < 0.15
    assert rms[1] < 3
    assert (np.abs(error) < 3 * std).mean() > 0.95
    text = tactile(
        "run", "tactip", "--bundle", tmp_path / "bundle", "--input", bench / "others/frames"
    )
    assert "127 of 127 markers seen, distance " in text.stdout
    assert " mm, angle " in text.stdout
    assert text.stderr == ""


def test_the_score_is_printed_as_json(words: Callable[..., list[object]], tmp_path: Path) -> None:
    done = tactile(*words(out=tmp_path / "bundle"), "--json")
    found = json.loads(done.stdout)
    assert found["presses"] == 150
    for score in found["held_out"].values():
        assert score["rms_low"] <= score["rms"] <= score["rms_high"]
        assert score["mae"] <= score["rms"]
        assert 0.5 < score["within_1_std"] < score["within_2_std"] <= 1


def test_a_bundle_of_labels_is_no_calibration_of_another_sensor(
    bench: Path, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    tactile(*words(out=tmp_path / "bundle"))
    message = refused(
        "run", "gelslim4", "--bundle", tmp_path / "bundle", "--input", bench / "no_contact.png"
    )
    assert "the bundle was made for sensor tactip, not gelslim4" in message


def some_labels(bench: Path, path: Path, lines: Callable[[list[str]], Sequence[str]]) -> Path:
    text = (bench / "labelled" / "labels.csv").read_text().splitlines()
    path.write_text("\n".join(lines(text)) + "\n")
    return path


def test_each_frame_needs_a_label_and_each_label_a_frame(
    bench: Path, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    fewer = some_labels(bench, tmp_path / "fewer.csv", lambda lines: lines[:-2])
    more = some_labels(bench, tmp_path / "more.csv", lambda lines: [*lines, "extra.png,1,2"])
    message = refused(*words(labels=fewer))
    assert "has 150 frames" in message
    assert "148 labels: frame press_148 has no label" in message
    assert "label extra has no frame" in refused(*words(labels=more))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: lines[:1], "has no line with a label"),
        (lambda lines: ["name,distance_mm,angle_deg", *lines[1:]], "column 'file' is missing"),
        (lambda lines: [*lines[:-1], "press_149.png,near,2"], "151: distance_mm must be a number"),
        (lambda lines: [*lines, lines[-1]], "press_149 already has a label"),
        (lambda lines: [*lines, ",1,2"], "'file' is empty"),
        (
            lambda lines: [lines[0], *(line.rpartition(",")[0] + ",3" for line in lines[1:])],
            "a label is the same in all of them",
        ),
    ],
)
def test_labels_that_cannot_be_used_are_refused(
    bench: Path,
    words: Callable[..., list[object]],
    tmp_path: Path,
    change: Callable[[list[str]], Sequence[str]],
    message: str,
) -> None:
    assert message in refused(*words(labels=some_labels(bench, tmp_path / "bad.csv", change)))


def test_columns_are_named_three_at_a_time(words: Callable[..., list[object]]) -> None:
    assert "name three" in refused(*words(columns="file,distance_mm"))


def test_labels_without_a_file_and_frames_without_contact_are_asked_for(
    words: Callable[..., list[object]], tmp_path: Path
) -> None:
    assert "there is no such file" in refused(*words(labels=tmp_path / "absent.csv"))
    assert "give --reference, a frame without contact" in refused(*words(reference=None))


def test_too_few_presses_are_refused(
    bench: Path, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    for file in sorted((bench / "labelled" / "frames").iterdir())[:20]:
        write_image(tmp_path / "frames" / file.name, cv2.imread(str(file), 0))
    few = some_labels(bench, tmp_path / "few.csv", lambda lines: lines[:21])
    assert "label at least 50" in refused(*words(input=tmp_path / "frames", labels=few))


def test_a_colour_image_and_frames_of_other_pins_are_refused(
    words: Callable[..., list[object]], tmp_path: Path
) -> None:
    rng = np.random.default_rng(0)
    write_image(tmp_path / "colour" / "a.png", rng.integers(0, 255, (256, 256, 3), np.uint8))
    assert "the image is in colour" in refused(*words(input=tmp_path / "colour"))
    few = picture(pins_at_rest()[::2], IMAGE, number=0)
    write_image(tmp_path / "few" / "b.png", few)
    assert "b: only 64 of 127 pins are found" in refused(*words(input=tmp_path / "few"))


def test_a_profile_without_pins_cannot_be_calibrated(
    words: Callable[..., list[object]], tmp_path: Path
) -> None:
    profile = tmp_path / "bare.yaml"
    profile.write_text(
        "extends: tactip\nname: bare\nestimators: {pins: null, displacement: null, surface: null}\n"
    )
    assert "bare finds no pins" in refused(
        "calibrate-surface", profile, *[word for word in words() if word != "tactip"][1:]
    )


@pytest.fixture(scope="module")
def halves(recordings: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """400 labelled frames of a real sensor, drawn at random, and the remaining 200."""
    source = recordings / "tactip" / "surface"
    folder = tmp_path_factory.mktemp("real")
    with (source / "poses.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    order = np.random.default_rng(0).permutation(len(rows))
    for name, chosen in (("labelled", order[:400]), ("others", order[400:])):
        (folder / name).mkdir()
        for index in chosen:
            file = rows[index]["image_name"]
            (folder / name / file).symlink_to((source / "frames" / file).resolve())
        with (folder / f"{name}.csv").open("w", newline="") as lines:
            table = csv.DictWriter(lines, rows[0])
            table.writeheader()
            table.writerows(rows[index] for index in chosen)
    return folder


@pytest.mark.recordings
def test_a_real_sensor_measures_frames_that_were_kept_back(
    halves: Path, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    done = tactile(
        *words(
            input=halves / "labelled",
            labels=halves / "labelled.csv",
            columns=REAL_COLUMNS,
            reference="first",
            out=tmp_path / "bundle",
        )
    )
    assert done.returncode == 0, done.stderr
    found = measured(tmp_path / "bundle", halves / "others")
    assert len(found) == 200
    error, std = errors(found, halves / "others.csv", REAL_COLUMNS)
    rms = np.sqrt((error**2).mean(axis=0))
    assert rms[0] < 0.15  # mm
    assert rms[1] < 1.0  # degrees; the labels spread by 2.2
    size = np.abs(error) / std
    assert (size < 1).mean(axis=0) == pytest.approx([0.68, 0.68], abs=0.1)
    assert (size < 2).mean(axis=0) == pytest.approx([0.95, 0.95], abs=0.05)
