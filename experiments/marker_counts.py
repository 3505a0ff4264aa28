"""Markers found on recordings of eight sensors: ``python experiments/marker_counts.py DATA``.

The markers are detected as a profile with ``markers: auto`` does; on the wedge also as its own
profile does. The reference shares nothing with that: blobs are scale-space maxima of the Laplacian
of a Gaussian (Lindeberg, Int. J. Computer Vision 30(2), 1998, by scikit-image), which are markers
where a disc is darker, or brighter, than the ring around it. The least difference of each sensor
lies in the gap that the blobs of its frames leave. The markers of its first frame were counted by
eye; where there are more blobs, the rest is dirt, which counts as missed. What the image border
truncates is neither asked for nor spurious.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import KDTree
from skimage.feature import blob_log

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tactile_core import MarkerDetections, Pipeline, load_profile
from tactile_core.acquisition.acquisition import average
from tactile_core.acquisition.assembly import Assembly
from tactile_core.acquisition.devices import make_lights
from tactile_core.formats.images import read_image
from tactile_core.formats.video import open_video
from tactile_core.quantities import Image

Array = NDArray[Any]
Clip = tuple[Array, list[Array]]
"""An undeformed image, and frames."""

PROFILE = """\
schema: 1
name: marked
{head}
image: {{width_px: {width}, height_px: {height}, mm_per_px: 0.1{color}}}
gel: {{markers: auto}}
estimators: {{markers: {{use: core.markers}}}}
"""
GREY = "illumination: {use: core.constant, channels: [white]}"
WEDGE = "gelsight_wedge_portrait"
FRAMES = 24
"""Frames of a recording, evenly spread."""


@dataclass(frozen=True)
class Recorded:
    """Recordings of one sensor, and what is known of its markers by eye.

    Attributes
    ----------
    name : str
    clips : callable
        Clips of the folder of recordings.
    counted : int
        Markers of the first frame that the border does not truncate.
    diameters_px : (float, float)
        Diameter of most markers, and of the largest.
    least_contrast : float
        Least difference of a marker from its surroundings, as a share of the brighter.
    extends : str
        A profile with the lens or the corners of the sensor.
    bright, truncated : bool
        Whether markers are bright, and whether the border truncates any.
    within_px : float
        Distance from the middle of the image within which there are markers.
    """

    name: str
    clips: Callable[[Path], Iterator[Clip]]
    counted: int
    diameters_px: tuple[float, float]
    least_contrast: float = 0.3
    extends: str = ""
    bright: bool = False
    truncated: bool = True
    within_px: float = np.inf


def spread(items: Sequence[Any], count: int = FRAMES) -> list[Any]:
    """Choose evenly spread items, the first and the last among them."""
    return [items[i] for i in np.unique(np.linspace(0, len(items) - 1, count).round().astype(int))]


def stills(*patterns: tuple[str, str]) -> Callable[[Path], Iterator[Clip]]:
    """Images that are spread over folders, each with its undeformed image."""

    def clips(data: Path) -> Iterator[Clip]:
        for undeformed, pattern in patterns:
            files = sorted(
                data.glob(pattern), key=lambda file: [*map(int, re.findall(r"\d+", file.stem))]
            )
            first = read_image(data / undeformed)
            yield first, [first, *(read_image(f) for f in spread(files) if f != data / undeformed)]

    return clips


def irregular(data: Path) -> Iterator[Clip]:
    images = [pixels for pixels, _ in open_video(data / "markers/irregular_markers.avi").frames()]
    yield images[0], spread(images)


def lifts(data: Path) -> Iterator[Clip]:
    """Five lifts of each object: the first frame, and one of the lift."""
    for folder in sorted((data / "slip/grasp_lift").glob("object*")):
        for lift in spread(sorted(folder.iterdir()), 5):
            files = sorted(lift.iterdir())
            yield read_image(files[0]), [read_image(files[i]) for i in (0, 13)]


def grippers(data: Path) -> Iterator[Clip]:
    """Both fingers in the first grasp of each object."""
    for labels in sorted(path for path in (data / "slip/gripper_pair").iterdir() if path.is_dir()):
        for file in sorted(min(labels.iterdir()).glob("*.avi")):
            images = [pixels for pixels, _ in open_video(file).frames()]
            yield images[0], [images[min(100, len(images) - 1)]]


_HEX, _PINS = "three_colour/hex_fingertip", "tactip/surface/frames"
_BOARD = "ninedtact/sensor_1/camera_calibration/sample.png"
RECORDED = (
    Recorded(
        "markers/mini",
        stills(("markers/mini/frames/0000.png", "markers/mini/frames/*")),
        70,
        (11, 15),
    ),
    Recorded("markers/irregular_markers", irregular, 125, (14, 34), 0.2),
    Recorded(
        "three_colour/wedge, wedge_2",
        stills(
            ("three_colour/wedge/bg-0.jpg", "three_colour/wedge/ball-*.jpg"),
            ("three_colour/wedge_2/background.jpg", "three_colour/wedge_2/presses/*.jpg"),
        ),
        140,
        (6, 8),
        0.26,
        extends=WEDGE,
        truncated=False,
    ),
    Recorded(_HEX, stills((f"{_HEX}/frame0.jpg", f"{_HEX}/*.jpg")), 81, (14, 20), 0.2),
    Recorded("slip/grasp_lift", lifts, 69, (17, 24), 0.17),
    Recorded("slip/gripper_pair", grippers, 63, (14, 26)),
    Recorded(
        "tactip/surface",
        stills((f"{_PINS}/frame_0_0.png", f"{_PINS}/*")),
        127,
        (6, 14),
        0.45,
        bright=True,
        truncated=False,
        within_px=112,
    ),
    Recorded("ninedtact, dot board", stills((_BOARD, _BOARD)), 63, (40, 56), 0.02, truncated=False),
)


def detect(recorded: Recorded, clip: Clip, *, auto: bool) -> Iterator[tuple[Array, Array]]:
    """Pixels and detected centres (N, 2) of each frame, by a profile that only detects markers."""
    undeformed, frames = clip
    height, width = undeformed.shape[:2]
    grey = undeformed.ndim == 2
    head = GREY if grey else f"extends: {recorded.extends}" if recorded.extends else ""
    color = ", color: grey" if grey else ""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "marked.yaml"
        path.write_text(PROFILE.format(head=head, width=width, height=height, color=color))
        profile = load_profile(path if auto else recorded.extends)
    steps = {name: step for name, step in profile.estimators.items() if name == "markers"}
    profile = profile.model_copy(update={"estimators": steps})
    assembly = Assembly(make_lights(profile), profile.image)
    pipeline = Pipeline(profile, reference=average([assembly.frame([Image(undeformed, 0.0)])]))
    for pixels in frames:
        frame = pipeline.frame(pixels)
        yield np.asarray(frame.pixels), pipeline.process(frame)[MarkerDetections].centres_px


@dataclass(frozen=True)
class Blobs:
    """Markers by the reference: ``whole`` (N, 2), and ``truncated`` (M, 2) by the border."""

    whole: Array
    truncated: Array


def find_blobs(pixels: Array, recorded: Recorded) -> Blobs:
    """Find the markers of an image, independently of the package."""
    grey = pixels.astype(np.float32).mean(axis=2)
    size_px, largest_px = recorded.diameters_px
    light = np.maximum(cv2.GaussianBlur(grey, (0, 0), 3 * size_px), 8)
    shown = grey / 255 if recorded.bright else 1 - grey / light
    margin = round(2 * size_px)
    found = blob_log(
        np.pad(shown, margin, mode="edge"),
        min_sigma=0.8 * size_px / np.sqrt(8),
        max_sigma=largest_px / np.sqrt(8),
        num_sigma=6,
        threshold=min(0.06, recorded.least_contrast / 2),
        overlap=0.3,
    )
    places = found[:, 1::-1] - margin
    last = np.array(grey.shape[::-1]) - 1
    inside_px = np.minimum(places, last - places).min(axis=1)
    contrast = np.array(
        [difference(grey, p, size_px, recorded.bright) for p in np.clip(places, 0, last)]
    )
    order = np.argsort(-contrast)
    places, contrast, inside_px = places[order], contrast[order], inside_px[order]
    first = np.ones(len(places), bool)
    for i, near in enumerate(KDTree(places).query_ball_point(places, 0.7 * size_px)):
        first[i] = not any(first[j] for j in near if j < i)  # of blobs at one place, the strongest
    whole = inside_px >= 0.55 * size_px
    sure = first & whole & (contrast > recorded.least_contrast)
    sure &= np.hypot(*(places - last / 2).T) < recorded.within_px
    part = ~whole & (contrast > recorded.least_contrast / 2) & recorded.truncated
    return Blobs(places[sure], places[part])


def difference(grey: Array, place: Array, diameter_px: float, bright: bool) -> float:
    """Difference of a disc from the ring around it, as a share of the brighter."""
    reach = int(1.5 * diameter_px) + 1
    x0, y0 = np.maximum(place.round().astype(int) - reach, 0)
    part = grey[y0 : y0 + 2 * reach + 1, x0 : x0 + 2 * reach + 1]
    y, x = np.mgrid[: part.shape[0], : part.shape[1]]
    away = np.hypot(x + x0 - place[0], y + y0 - place[1]) / diameter_px
    disc, ring = part[away <= 0.35].mean(), part[(away > 0.9) & (away < 1.5)]
    if bright:  # the gel around pins is black, so that a share of it says nothing
        return float(disc - np.percentile(ring, 75)) / 255
    return float(1 - disc / max(np.percentile(ring, 40), 6))


def pair(found: Array, true: Array, within_px: float) -> tuple[Array, Array]:
    """Pair places one to one: which of ``found`` and which of ``true`` have a partner."""
    apart = np.hypot(*(found[:, None] - true[None]).transpose(2, 0, 1))
    rows, columns = linear_sum_assignment(np.minimum(apart, 2 * within_px))
    close = apart[rows, columns] < within_px
    return np.isin(np.arange(len(found)), rows[close]), np.isin(
        np.arange(len(true)), columns[close]
    )


def count(recorded: Recorded, data: Path, *, auto: bool = True) -> str:
    """Compare the detections with the reference in all frames: a row of the table."""
    first = frames = markers = hits = detections = spurious = 0
    for clip in recorded.clips(data):
        for pixels, centres in detect(recorded, clip, auto=auto):
            blobs = find_blobs(pixels, recorded)
            first = first if frames else len(blobs.whole)
            true = np.concatenate([blobs.whole, blobs.truncated])
            is_true, is_found = pair(centres, true, sum(recorded.diameters_px) / 2)
            frames, markers = frames + 1, markers + len(blobs.whole)
            hits += int(is_found[: len(blobs.whole)].sum())
            detections, spurious = detections + len(centres), spurious + int((~is_true).sum())
    name = recorded.name if auto else f"{recorded.name}, the profile's markers"
    counts = f"{name} | {frames} | {recorded.counted} | {first} | {markers}"
    return f"| {counts} | {hits / markers:.2%} | {spurious / detections:.2%} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder of recordings")
    data = parser.parse_args().data
    print("| recordings | frames | first, by eye | first, blobs | all blobs | found | spurious |")
    print("| --- " * 7 + "|")
    for recorded in RECORDED:
        print(count(recorded, data), flush=True)
        if recorded.extends:
            print(count(recorded, data, auto=False), flush=True)


if __name__ == "__main__":
    main()
