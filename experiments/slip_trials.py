"""Degree of slip in recorded trials by a profile's whole chain.

Only the score uses the labels. The control is the weakness of the first imprint: a weak grasp often
slips, so a cue that only measures its strength would score well without detecting any slip.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from tactile_core import SlipState, open_sensor
from tactile_core.algorithms.markers.contrast import marker_mask
from tactile_core.algorithms.markers.count import find_marker_lattice
from tactile_core.recordings.recording import open_recording

LIFT_FRAME = 5
"""Last frame before the lift."""
WINDOW = slice(6, 122)
"""Scored frames: videos of slips are shorter, and all start with frames before the grasp."""
FOURTH = 4
"""Interval of the frames that a slower camera would record."""
_RESAMPLES = 2000


@dataclass(frozen=True)
class Trial:
    """Results of one sensor in one trial.

    Attributes
    ----------
    object, name : str
    slipped : bool
        The label.
    degrees, alarms : (T,)
        Degree of slip, and whether slip is reported.
    weakness : float
        Negative strength of the first imprint: the control.
    """

    object: str
    name: str
    slipped: bool
    degrees: NDArray[np.float64]
    alarms: NDArray[np.bool_]
    weakness: float


def lifts(folder: Path, profile: str) -> list[Trial]:
    """Measure every lift."""
    trials = []
    for row in _labels(folder):
        source = folder / row["object"] / f"{row['trial_folder']}_mm"
        lost = row["label_stable1_slip0"] == "0"
        trials.append(_trial(row["object"], source, lost, profile))
    return trials


def grasps(folder: Path, profile: str, every: int = 1) -> list[list[Trial]]:
    """Measure both fingers of every grasp, in the same window of frames or in every n-th of it."""
    window = slice(-(-WINDOW.start // every), -(-WINDOW.stop // every))
    fingers: dict[tuple[str, str], list[Trial]] = {}
    for row in _labels(folder):
        if int(row["n_frames"]) < WINDOW.stop:
            continue
        key = row["object"], row["trial"]
        video = folder / row["object"] / row["trial"] / row["video"]
        with taken(video, every) as source:
            trial = _trial(row["object"], source, row["slip"] == "1", profile, window)
        fingers.setdefault(key, []).append(trial)
    return list(fingers.values())


@contextmanager
def taken(video: Path, every: int) -> Iterator[Path]:
    """Every n-th frame of a video as a folder of images, which are replayed at 30 Hz."""
    if every == 1:
        yield video
        return
    with TemporaryDirectory() as folder:
        for number, observation in enumerate(islice(open_recording(video), WINDOW.stop)):
            if number % every == 0:
                pixels = cv2.cvtColor(observation.images[0].pixels, cv2.COLOR_RGB2BGR)
                cv2.imwrite(str(Path(folder) / f"{number:04d}.png"), pixels)
        yield Path(folder)


def area(slipped: NDArray[np.bool_], scores: NDArray[np.float64]) -> float:
    """Area under the ROC curve: share of slip-hold pairs in the right order."""
    positive = int(slipped.sum())
    above = rankdata(scores)[slipped].sum() - positive * (positive + 1) / 2
    return float(above / (positive * (slipped.size - positive)))


def area_within(
    slipped: NDArray[np.bool_], scores: NDArray[np.float64], objects: NDArray[np.str_]
) -> float:
    """Area under the ROC curve for pairs of the same object only."""
    right = pairs = 0.0
    for name in set(objects):
        here = objects == name
        if 0 < slipped[here].sum() < here.sum():
            count = float(slipped[here].sum() * (~slipped[here]).sum())
            right, pairs = right + count * area(slipped[here], scores[here]), pairs + count
    return right / pairs


def interval(
    slipped: NDArray[np.bool_], scores: NDArray[np.float64], objects: NDArray[np.str_]
) -> tuple[float, float]:
    """95 % interval of the area, by resampling the objects."""
    names, random, areas = np.unique(objects), np.random.default_rng(0), []
    for _ in range(_RESAMPLES):
        drawn = random.choice(names, len(names))
        chosen = np.concatenate([np.flatnonzero(objects == name) for name in drawn])
        if 0 < slipped[chosen].sum() < len(chosen):
            areas.append(area(slipped[chosen], scores[chosen]))
    low, high = np.quantile(areas, (0.025, 0.975))
    return float(low), float(high)


def _labels(folder: Path) -> list[dict[str, str]]:
    with (folder / "labels.csv").open() as rows:
        return list(csv.DictReader(rows))


def _images(source: Path) -> list[NDArray[np.uint8]]:
    return [observation.images[0].pixels for observation in open_recording(source)]


def _trial(
    object_: str,
    source: Path,
    slipped: bool,
    profile: str,
    window: slice = slice(None),
) -> Trial:
    """Measure one trial by a profile's chain from the first frame."""
    images = _images(source)[window]
    found = find_marker_lattice(images[0])
    if found is None:
        raise SystemExit(f"{source}: no markers found")
    weakness = -_relief(images[0], found.diameter_px, found.pitch_px)
    degrees, alarms = _measured(source, profile, window)
    return Trial(object_, source.name, slipped, degrees, alarms, weakness)


def _measured(
    source: Path, profile: str, window: slice
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Degree and alarm of each frame by a profile's whole chain."""
    with open_sensor(profile, input=source, reference="first") as sensor:
        states = [reading[SlipState] for reading in islice(sensor.stream(), window.stop)][window]
    degrees = np.array([slip.degree for slip in states])
    return degrees, np.array([slip.state == "slip" for slip in states])


def _relief(pixels: NDArray[np.uint8], diameter_px: float, pitch_px: float) -> float:
    """RMS contrast of the imprint, relative to the local intensity."""
    free = 1 - cv2.dilate(
        marker_mask(pixels, diameter_px=diameter_px).astype(np.float32), np.ones((3, 3))
    )
    fine, coarse = (
        cv2.GaussianBlur(pixels * free[..., np.newaxis], (0, 0), sigma)
        / cv2.GaussianBlur(free, (0, 0), sigma)[..., np.newaxis]
        for sigma in (0.4 * pitch_px, 1.7 * pitch_px)
    )
    return float(np.sqrt(np.mean(np.square(fine / coarse - 1))))
