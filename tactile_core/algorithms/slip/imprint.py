"""The imprint of an object, and the view of the surface that it is found in."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import TINY, Array, Bool, Float32, UInt8, pitch
from tactile_core.algorithms.markers.contrast import Tone, marker_mask
from tactile_core.errors import InputError

# [px of the view] A longer motion is fitted again, from where the last fit ended: half a pixel, up
# to which a linear fit is exact for patterns of three pixels
_LONG_STEP = 0.5


INNER = slice(1, -1, 2), slice(1, -1)  # Rows and columns in which changes are fitted

_SQUARE = np.ones((3, 3), np.uint8)  # Neighbourhood of a pixel

Motion = tuple[float, float, float]  # x and y in px of the view, and rotation in rad


class Imprint:
    """The pattern (h, w, K) that an object imprints on the gel surface, and its mask (h, w).

    Parameters
    ----------
    pattern : (h, w, K) float32
        0 where it is hidden.
    seen : (h, w) float32
        1 where the surface is visible, else 0.

    Attributes
    ----------
    energy : float
        Sum of squares of the pattern.
    count : float
        Number of visible values.
    centre : (float, float)
        x and y of the centroid of the energy, px of the view.
    radius : float
        RMS distance of the energy from the centroid, px of the view.
    """

    def __init__(self, pattern: Float32, seen: Float32) -> None:
        self.pattern, self.seen = pattern, seen
        channels = pattern.shape[2]
        self.count = cv2.sumElems(seen)[0] * channels
        square = cv2.transform(pattern * pattern, np.ones((1, channels), np.float32))
        moments = cv2.moments(square)
        self.energy, total = moments["m00"], max(moments["m00"], TINY)
        self.centre = moments["m10"] / total, moments["m01"] / total
        self.radius = math.sqrt((moments["mu20"] + moments["mu02"]) / total)

    def move_imprint(self, motion: Motion) -> Imprint:
        """Return the imprint after a motion: x, y and rotation about its centroid."""
        x, y, turn = motion
        cosine, sine = np.cos(turn), np.sin(turn)
        back = np.array([[cosine, sine], [-sine, cosine]])
        from_px = np.array(self.centre) - back @ (np.array(self.centre) + np.array([x, y]))
        warp = np.column_stack([back, from_px]).astype(np.float32)
        size, how = self.seen.shape[::-1], cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        pattern = np.asarray(
            cv2.warpAffine(np.ascontiguousarray(self.pattern), warp, size, flags=how), np.float32
        )
        seen = np.asarray(cv2.warpAffine(self.seen, warp, size, flags=how), np.float32)
        return Imprint(pattern.reshape(self.pattern.shape), seen)


class ImprintStep(NamedTuple):
    """The change from one imprint to the next.

    Attributes
    ----------
    motion : (float, float, float)
        x, y in px of the view, and rotation about the centroid in rad.
    changed : float
        Energy of the change.
    unexplained : float
        Energy of the change that neither a rigid motion nor a growing load explains.
    energy : float
        Energy of both imprints, where both are visible.
    values : float
        Number of values that are visible in both.
    variance : (float, float, float)
        Of the motion, for noise of variance 1 in each value of the change.
    """

    motion: Motion
    changed: float
    unexplained: float
    energy: float
    values: float
    variance: Motion


def step_between(before: Imprint, now: Imprint) -> ImprintStep:
    """Fit a rigid motion and a growth of the pattern to a change, by least squares."""
    step = _linear(before, now)
    motion, best = step.motion, (0.0, 0.0, 0.0)
    if math.hypot(*motion[:2]) <= _LONG_STEP:
        return step
    least = step.changed / max(step.values, 1.0)
    for _ in range(4 - 1):  # [fits] more would not converge either
        more = _linear(before.move_imprint(motion), now)
        left = more.changed / max(more.values, 1.0)
        if left >= least:  # a motion along stripes, for example, cannot be seen
            break
        x, y, turn = more.motion
        best, least, motion = motion, left, (motion[0] + x, motion[1] + y, motion[2] + turn)
        if math.hypot(x, y) <= _LONG_STEP:
            return step._replace(motion=motion)
    return step._replace(motion=best)


def _linear(before: Imprint, now: Imprint) -> ImprintStep:
    """Fit the change of every second row; the others say nearly the same, after smoothing."""
    xx, xy, yy, xt, yt, tt, x, y, t, changed, middle, growth, values = _sums(before, now)
    # [ratio to the diagonal] It biases a motion by a thousandth
    xx, yy, tt = (square * (1 + 1e-3) + TINY for square in (xx, yy, tt))
    # inverse of the symmetric matrix of products, by its cofactors
    of_x = yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - xt * yy
    of_y = of_x[1], xx * tt - xt * xt, xy * xt - xx * yt
    of_t = of_x[2], of_y[2], xx * yy - xy * xy
    over = 1 / (xx * of_x[0] + xy * of_x[1] + xt * of_x[2])
    moved = [over * (a * x + b * y + c * t) for a, b, c in (of_x, of_y, of_t)]
    motion = moved[0], moved[1], moved[2]
    # a growing load strengthens the pattern in place; a weaker pattern may be one that leaves
    explained = x * motion[0] + y * motion[1] + t * motion[2]
    explained += max(growth, 0.0) ** 2 / max(middle, TINY)
    return ImprintStep(
        motion,
        changed,
        max(changed - explained, 0.0),
        2 * middle + changed / 2,
        values,
        (over * of_x[0], over * of_y[1], over * of_t[2]),
    )


def _sums(before: Imprint, now: Imprint) -> tuple[float, ...]:
    """Sums of products over every second row.

    Of the slopes along x, along y and of a turn, in pairs (6); of each with the change (3); squares
    of the change and of the mean, their product, and the weights (4).
    """
    channels = now.pattern.shape[2]
    # next to a hidden pixel, the gradient is that of the mask
    both = np.asarray(cv2.erode(before.seen * now.seen, _SQUARE), np.float32)
    # much faster than to repeat each value: the channels of a pixel are neighbours
    weight = np.asarray(cv2.merge([both[INNER]] * channels)).reshape(len(both[INNER]), -1)
    total = (before.pattern + now.pattern).reshape(len(both), -1)
    # central differences of the mean of both
    across = total[1:-1:2, 2 * channels :] - total[1:-1:2, : -2 * channels]
    down = total[2::2, channels:-channels] - total[:-2:2, channels:-channels]
    x, y = before.centre
    columns = np.repeat(np.arange(1, both.shape[1] - 1, dtype=np.float32) - np.float32(x), channels)
    rows = np.arange(1, both.shape[0] - 1, 2, dtype=np.float32)[:, np.newaxis] - np.float32(y)
    values = np.empty((5, *weight.shape), np.float32)
    slope_x, slope_y, slope_t, change, middle = values
    np.multiply(across, weight, out=slope_x)
    np.multiply(down, weight, out=slope_y)
    np.subtract(slope_y * columns, slope_x * rows, out=slope_t)
    inner = np.s_[1:-1:2, channels:-channels]
    before_rows, now_rows = (each.pattern.reshape(len(both), -1)[inner] for each in (before, now))
    np.multiply(np.subtract(now_rows, before_rows, out=change), weight, out=change)
    np.multiply(total[inner], weight, out=middle)
    # the product of so wide and low a matrix with itself takes thrice as long as these four
    lines = values.reshape(5, -1)
    x, y, t, changed, growth = (lines @ lines[3]).tolist()
    (xx, _), (xy, yy), (xt, yt) = (lines[:3] @ lines[:2].T).tolist()
    tt, square = (float(line @ line) for line in (lines[2], lines[4]))
    # slopes are a quarter of these differences, and the pattern is half the total
    of_slopes = (product / 16 for product in (xx, xy, yy, xt, yt, tt))
    with_change = (product / -4 for product in (x, y, t))
    return *of_slopes, *with_change, changed, square / 4, growth / 2, float(weight.sum())


class VIEW:
    """Parameters of the surface view."""

    smoothing_px = 3  # [px of the view] Side of the box filter against the grain of the coating
    min_markers = 3  # [count] Fewest markers of a warp. Source: three points define an affine map.


class SurfaceView:
    """Warp frames back along the markers and extract the imprint between them.

    A pixel of the view is a point of the gel surface, however far it is displaced. While the object
    sticks, its imprint moves with the surface and the view does not change.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K)
        Image in which the markers are at ``reference_px``.
    reference_px : (N, 2)
        Positions of the markers, x and y; at least three.
    diameter_px : float
        Diameter of a marker.
    tone : {"dark", "bright"}
        Whether markers are darker or brighter than the gel.

    Raises
    ------
    InputError
        There are fewer than three markers, or the diameter is not positive.
    """

    def __init__(
        self, pixels: Array, reference_px: Array, diameter_px: float, tone: Tone = "dark"
    ) -> None:
        if len(reference_px) < VIEW.min_markers:
            raise InputError(
                f"{len(reference_px)} markers do not determine the motion of the gel surface; "
                f"track at least {VIEW.min_markers}, or leave the imprint out"
            )
        self.times: int = max(1, round(pixels.shape[1] / 160))  # [px] for speed (ADR 43)
        first = _shrink_pixels(pixels, self.times)
        height, width = first.shape[:2]
        self._markers_px = _scale_points(reference_px, self.times)
        diameter_px /= self.times
        self._columns, self._rows = np.meshgrid(
            np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
        )
        pitch_px = pitch(self._markers_px)
        self._weights, self._grid = _local_linear(self._markers_px, pitch_px, height, width)
        rim = 2 * int(np.ceil(0.25 * diameter_px)) + 1  # [diameters] hidden as well
        mask = marker_mask(pixels, diameter_px=diameter_px * self.times, tone=tone)
        share = shrink_image(mask.astype(np.float32), (width, height))
        # [share of a pixel of the view] Markers cover more of it
        self._hidden = cv2.dilate(share, np.ones((rim, rim), np.uint8)) > 0.25
        # [pitches] the background is a mean over 1.5, little more than a pitch (ADR 43)
        self._side = 2 * round(0.75 * pitch_px) + 1

    @property
    def takes_halves(self) -> bool:
        """Whether the means of a frame over 2 × 2 pixels are less work than the frame.

        A reduction by two is as fast in one step.
        """
        return self.times > 2 and self.times % 2 == 0

    def imprint(
        self, pixels: Array, px: Array, halves: UInt8 | None = None
    ) -> tuple[Float32, Float32]:
        """Warp a frame back, and remove structure that is coarser than the marker pitch.

        Parameters
        ----------
        pixels : (H, W) or (H, W, K)
            The frame.
        px : (N, 2)
            Positions of the markers in it.
        halves : (H / 2, W / 2, 3) uint8, optional
            The means over 2 × 2 pixels of a frame of bytes, if they are known.

        Returns
        -------
        pattern : (h, w, K) float32
            Intensity relative to the mean of the neighbourhood, minus 1; 0 where it is hidden.
        seen : (h, w) float32
            1 where the surface is visible, 0 where a marker hides it or it is out of view.
        """
        height, width = self._hidden.shape
        times = self.times
        if halves is not None and self.takes_halves:
            pixels, times = halves, times // 2
        apart = (_scale_points(px, self.times) - self._markers_px).T
        moved = (apart @ self._weights).reshape(2, *self._grid)
        x, y = (cv2.resize(along, (width, height)) for along in moved)
        x, y = cv2.add(self._columns, x, dst=x), cv2.add(self._rows, y, dst=y)
        frame = _shrink_pixels(pixels, times).astype(np.float32)
        warped = np.asarray(cv2.remap(frame, x, y, cv2.INTER_LINEAR), np.float32)
        within = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
        seen = within & ~self._hidden
        pattern = _pattern(warped.reshape(height, width, -1), seen, self._side)
        return pattern, seen.astype(np.float32)


def _pattern(warped: Float32, seen: Bool, side: int) -> Float32:
    size, shape = (side, side), warped.shape
    around = np.maximum(cv2.boxFilter(seen.view(np.uint8), cv2.CV_32F, size), 1e-6)
    # repeated for each channel, because broadcasting along a short axis is slow
    weight, share = (
        np.asarray(cv2.merge([plane] * shape[2]), np.float32).reshape(shape)
        for plane in (seen.astype(np.float32), around)
    )
    warped *= weight
    # the mean intensity is at least 1, so that dark regions are not amplified
    total = cv2.blur(warped, size)
    cv2.divide(share, cv2.max(total, share, dst=total), dst=total)
    warped *= np.asarray(total, np.float32).reshape(shape)
    warped -= weight
    smooth = np.asarray(
        cv2.blur(warped, (VIEW.smoothing_px, VIEW.smoothing_px)), np.float32
    ).reshape(shape)
    smooth *= weight
    return smooth


def _shrink_pixels(pixels: Array, times: int) -> Array:
    return shrink_image(pixels, (pixels.shape[1] // times, pixels.shape[0] // times))


def _scale_points(points_px: Array, times: int) -> Float32:
    return np.asarray((np.asarray(points_px) + 0.5) / times - 0.5, np.float32)


def _local_linear(
    markers_px: Float32, pitch_px: float, height: int, width: int
) -> tuple[Float32, tuple[int, int]]:
    """Weights (N, G) of a local linear fit to values at the markers, and rows and columns of G."""
    # [px of the view] The warp is interpolated between these cells, for speed
    rows, columns = -(-height // 8), -(-width // 8)
    x, y = np.meshgrid(
        (np.arange(columns) + 0.5) * width / columns - 0.5,
        (np.arange(rows) + 0.5) * height / rows - 0.5,
    )
    apart = np.stack(
        [markers_px[:, 0] - x.reshape(-1, 1), markers_px[:, 1] - y.reshape(-1, 1)], axis=-1
    )
    # [pitches] Standard deviation of the weights of the markers
    near = np.exp(-np.square(apart).sum(-1) / (2 * (0.8 * pitch_px) ** 2)) + 1e-12
    basis = np.concatenate([np.ones((*near.shape, 1)), apart / pitch_px], axis=-1)
    weighted = basis * near[..., np.newaxis]
    # [squared pitches] for the slopes of the local linear fit
    normal = np.swapaxes(basis, 1, 2) @ weighted + np.diag([1e-9, 0.05, 0.05])
    weights = np.linalg.solve(normal, np.swapaxes(weighted, 1, 2))[:, 0]
    return np.ascontiguousarray(weights.T, np.float32), (rows, columns)
