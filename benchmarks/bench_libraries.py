"""Own implementations against library functions: ``python benchmarks/bench_libraries.py``.

One row per function: milliseconds at 640 × 480, and the largest difference of the results relative
to the largest value. The own implementations use numpy.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import RBFInterpolator
from scipy.spatial import KDTree
from skimage import feature, measure, morphology, transform

from tactile_core.algorithms.arrays.regression import fit_polynomial, quantile, scaling, terms
from tactile_core.algorithms.circles.finder import find_circles
from tactile_core.algorithms.circles.press import PressImage
from tactile_core.algorithms.circles.start import Start
from tactile_core.algorithms.contact import _parts
from tactile_core.algorithms.displacement.decomposition import decompose_field
from tactile_core.algorithms.displacement.kriging import CoarseGrid, Kriging
from tactile_core.algorithms.markers.detection import find_spots, measure_spots
from tactile_core.algorithms.markers.neighbourhood import pair_nearest
from tactile_core.algorithms.slopes.sampling import Sampling, two_within

Array = NDArray[Any]
Row = tuple[str, Callable[[], Any], Callable[[], Any]]

SHAPE = 480, 640
TURNS = 7
"""Calls per function; the median is printed."""
RNG = np.random.default_rng(0)


def main() -> None:
    """Print the table."""
    cv2.setNumThreads(1)
    print(f"{'task: ours | library':64}{'ours ms':>9}{'lib ms':>9}{'difference':>12}")
    for rows in (spots, regions, gaps, samples, fields, tracking, fits):
        for task, ours, library in rows():
            one, other = np.asarray(ours(), float), np.asarray(library(), float)
            difference = np.abs(one - other).max() / np.abs(one).max()
            times = f"{median_ms(ours):9.3f}{median_ms(library):9.3f}"
            print(f"{task:64}{times}{difference:12.1e}", flush=True)


def median_ms(call: Callable[[], Any]) -> float:
    """Median time of a few calls."""
    times_s = []
    for _ in range(TURNS):
        start = time.perf_counter()
        call()
        times_s.append(time.perf_counter() - start)
    return float(1e3 * np.median(times_s))


def dots() -> NDArray[np.uint8]:
    """Image of 336 printed dots."""
    image = np.zeros(SHAPE, np.uint8)
    image[20::30, 20::30] = 255
    image = np.asarray(cv2.dilate(image, morphology.disk(6)), np.uint8)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 1.5), np.uint8)


def smooth(sigma: float, *channels: int) -> NDArray[np.float32]:
    """Gaussian noise of unit standard deviation, smoothed with this sigma in px."""
    noise = RNG.standard_normal((*SHAPE, *channels), np.float32)
    image = np.asarray(cv2.GaussianBlur(noise, (0, 0), sigma), np.float32)
    return np.asarray(image / image.std(), np.float32)


def spots() -> Iterator[Row]:
    """Centroids of printed markers at half resolution, as in marker detection."""
    size = SHAPE[1] // 2, SHAPE[0] // 2
    weight = np.asarray(cv2.resize(dots(), size, interpolation=cv2.INTER_AREA), np.uint8)
    found = find_spots((weight > 60).view(np.uint8))
    labels = np.asarray(found.labels)

    def ours() -> Array:
        _, centres = measure_spots(found, labels, weight)
        return np.asarray(centres[:, ::-1].T)

    def library() -> Array:
        regions = measure.regionprops_table(labels, weight, ["centroid_weighted"])
        return np.stack(list(regions.values()))

    yield "spots: sums of pixels | regionprops", ours, library


def regions() -> Iterator[Row]:
    """Connected components of a mask, at the resolution of contact detection."""
    mask = np.asarray(cv2.resize(smooth(4), (160, 120))) > 1
    dotted, square = dots(), np.ones((9, 9), np.uint8)

    def by_opencv() -> Array:
        _, _, parts, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8))
        return np.sort(np.asarray(parts)[1:, cv2.CC_STAT_AREA])

    def by_skimage() -> Array:
        labels = measure.label(mask, connectivity=2)
        return np.sort(measure.regionprops_table(labels, properties=["area"])["area"])

    yield "areas: connectedComponentsWithStats | regionprops", by_opencv, by_skimage
    yield (
        "specks: connectedComponentsWithStats | remove_small_objects",
        lambda: list(_parts(mask, 20)),
        lambda: morphology.remove_small_objects(mask, max_size=19, connectivity=2),
    )
    yield (
        "dilation by 9 × 9: OpenCV | skimage",
        lambda: cv2.dilate(dotted, square),
        lambda: morphology.dilation(dotted, square),
    )


def gaps() -> Iterator[Row]:
    """Inpainting of holes of marker size."""
    image, hidden = smooth(20), dots() > 60

    yield (
        "markers: local mean | cv2.inpaint",
        lambda: Sampling(1, hidden.shape, 0.0, 27).smooth(image[..., None], hidden)[..., 0],
        lambda: cv2.inpaint(image, hidden.view(np.uint8), 3, cv2.INPAINT_TELEA),
    )


def samples() -> Iterator[Row]:
    """Functions called many times per frame, or on every pixel."""
    few = RNG.standard_normal(600)
    pixels = RNG.integers(0, 256, (*SHAPE, 3)).astype(np.uint8)
    yield (
        "quantile of 600: partition | np.quantile",
        lambda: quantile(few, 0.95),
        lambda: np.quantile(few, 0.95),
    )
    yield (
        "two channels within bounds: extremes first | numpy",
        lambda: two_within(pixels, 3, 252),
        lambda: ((pixels > 3) & (pixels < 252)).sum(axis=2) >= 2,
    )


def fields() -> Iterator[Row]:
    """Displacement of a gel surface with markers."""
    field, grid = 0.1 * smooth(40, 2), CoarseGrid.for_image(SHAPE, 7.5)
    coarse, at = field[: grid.shape[0], : grid.shape[1]].copy(), grid.nodes + np.float32(0.37)
    here = np.indices(SHAPE)[::-1].reshape(2, -1).T.astype(float)
    markers = np.argwhere(np.ones((24, 18))) * 1.4
    values, nodes = RNG.standard_normal((len(markers), 2)), grid.half.nodes.reshape(-1, 2)
    kriging = Kriging(markers, nodes, range_mm=12.0)

    def rotation() -> float:
        found: Any = transform.SimilarityTransform.from_estimate(here - field.reshape(-1, 2), here)
        return float(np.degrees(found.rotation))

    def mapped() -> Array:
        place = at.transpose(2, 0, 1)[::-1]
        parts = coarse.transpose(2, 0, 1)
        return np.dstack(
            [ndimage.map_coordinates(p, place, order=1, mode="nearest") for p in parts]
        )

    yield (
        "similarity: complex least squares | SimilarityTransform",
        lambda: decompose_field(field, mm_per_px=1.0).rotation_deg,
        rotation,
    )
    yield (
        "field at points: cv2.remap | map_coordinates",
        lambda: grid.sample_planes(coarse, at),
        mapped,
    )
    yield (
        "field from markers: weights kept | RBFInterpolator",
        lambda: kriging.field(values),
        lambda: RBFInterpolator(markers, values, degree=1)(nodes),
    )


def tracking() -> Iterator[Row]:
    """Marker tracking from frame to frame."""
    expected = 30.0 * np.argwhere(np.ones((16, 22)))
    found = expected + RNG.normal(0, 2, expected.shape)
    votes = np.asarray(cv2.blur(RNG.poisson(2, (18, 18)).astype(float), (3, 3)))

    def by_trees() -> Array:
        distance, forth = KDTree(found).query(expected)
        _, back = KDTree(expected).query(found)
        mutual = np.asarray(back)[forth] == np.arange(len(expected))
        return np.where(mutual & (np.asarray(distance) <= 10), forth, -1)

    def one_by_one() -> Array:
        left, peaks = votes.copy(), []
        for _ in range(3):
            x, y = np.unravel_index(int(left.argmax()), left.shape)
            peaks.append((x, y))
            left[max(x - 2, 0) : x + 3, max(y - 2, 0) : y + 3] = 0
        return np.array(peaks)

    yield (
        "mutual nearest: cells | two trees",
        lambda: pair_nearest(expected, found, np.full(len(expected), 10.0)),
        by_trees,
    )
    yield (
        "three peaks of votes: one by one | peak_local_max",
        one_by_one,
        lambda: feature.peak_local_max(votes, min_distance=2, num_peaks=3, exclude_border=False),
    )


def fits() -> Iterator[Row]:
    """Fits of a calibration."""
    features = RNG.standard_normal((20_000, 5)).astype(np.float32)
    targets = RNG.standard_normal((20_000, 2)).astype(np.float32)
    y, x = np.mgrid[:240, :320] - np.array([118.4, 161.7])[:, None, None]
    r = np.hypot(x, y)
    sine = np.where(r < 25, r / 40, 25 / 40 * np.exp(-(r - 25) / 8))
    slopes = [sine * side / np.maximum(r, 1e-6) for side in (x, y, 0.6 * x - 0.8 * y)]
    reference = np.full((240, 320, 3), 120.0, np.float32)
    press = reference * (1 + 0.5 * np.dstack(slopes)) + RNG.normal(0, 1, reference.shape)
    image = PressImage(press.astype(np.float32), reference)

    def by_lstsq() -> Array:
        mean, std = scaling(features)
        a = terms(((features - mean) / std).astype(float), 2)
        ridge = np.sqrt(1e-3 * len(a)) * np.eye(a.shape[1])
        right = np.concatenate([targets, np.zeros((a.shape[1], 2))])
        return np.asarray(np.linalg.lstsq(np.concatenate([a, ridge]), right, rcond=None)[0])

    def by_light() -> tuple[float, float, float]:
        (circle,) = find_circles([Start.from_image(image, 40.0)])
        return *circle.centre_px, circle.contact_radius_px

    def by_edge() -> tuple[float, float, float]:
        change = np.linalg.norm(cv2.GaussianBlur(press - reference, (0, 0), 2), axis=2)
        edges = np.concatenate(measure.find_contours(change, 0.5 * change.max()))
        found: Any = measure.ransac(edges[:, ::-1], measure.CircleModel, 3, 1.0, rng=0)[0]
        return *found.center, found.radius

    yield (
        "ridge: normal equations | lstsq",
        lambda: fit_polynomial(features, targets).coefficients,
        by_lstsq,
    )
    yield "circle of a ball: shading | ransac, CircleModel", by_light, by_edge


if __name__ == "__main__":
    main()
