"""Images in coordinates of the gel surface: frames warped back along the markers."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float32, UInt8, pitch
from tactile_core.algorithms.markers import marker_mask
from tactile_core.errors import InputError


class VIEW:
    """Parameters of the surface view."""

    width_px = 160  # [px] Approximate width of the view. Source: by hand, for speed (ADR 28).
    # [px of the view] Spacing of the grid on which the warp is interpolated. Source: by hand, for
    # speed.
    cell_px = 8
    # [pitches] Standard deviation of the Gaussian weights of the markers in the warp.
    reach_pitches = 0.8
    ridge = 0.05  # [squared pitches] Regularises the slopes of the local linear fit
    rim_diameters = 0.25  # [marker diameters] Rim around the markers that is hidden as well
    # [share of a pixel] A pixel of the view is hidden if markers cover more of it.
    hidden_share = 0.25
    # [pitches] Side of the box filter whose mean is the background of the pattern. Source: by
    # hand, little more than the distance of markers (ADR 28).
    window_pitches = 1.5
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

    Raises
    ------
    InputError
        There are fewer than three markers, or the diameter is not positive.
    """

    def __init__(self, pixels: Array, reference_px: Array, diameter_px: float) -> None:
        if len(reference_px) < VIEW.min_markers:
            raise InputError(
                f"{len(reference_px)} markers do not determine the motion of the gel surface; "
                f"track at least {VIEW.min_markers}, or leave the imprint out"
            )
        self.times: int = max(1, round(pixels.shape[1] / VIEW.width_px))
        first = _shrink_pixels(pixels, self.times)
        height, width = first.shape[:2]
        self._markers_px = _scale_points(reference_px, self.times)
        diameter_px /= self.times
        self._columns, self._rows = np.meshgrid(
            np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
        )
        pitch_px = pitch(self._markers_px)
        self._weights, self._grid = _local_linear(self._markers_px, pitch_px, height, width)
        rim = 2 * int(np.ceil(VIEW.rim_diameters * diameter_px)) + 1
        mask = marker_mask(pixels, diameter_px=diameter_px * self.times)
        share = shrink_image(mask.astype(np.float32), (width, height))
        self._hidden = cv2.dilate(share, np.ones((rim, rim), np.uint8)) > VIEW.hidden_share
        self._side = 2 * round(0.5 * VIEW.window_pitches * pitch_px) + 1

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
    rows, columns = -(-height // VIEW.cell_px), -(-width // VIEW.cell_px)
    x, y = np.meshgrid(
        (np.arange(columns) + 0.5) * width / columns - 0.5,
        (np.arange(rows) + 0.5) * height / rows - 0.5,
    )
    apart = np.stack(
        [markers_px[:, 0] - x.reshape(-1, 1), markers_px[:, 1] - y.reshape(-1, 1)], axis=-1
    )
    near = np.exp(-np.square(apart).sum(-1) / (2 * (VIEW.reach_pitches * pitch_px) ** 2)) + 1e-12
    basis = np.concatenate([np.ones((*near.shape, 1)), apart / pitch_px], axis=-1)
    weighted = basis * near[..., np.newaxis]
    normal = np.swapaxes(basis, 1, 2) @ weighted + np.diag([1e-9, VIEW.ridge, VIEW.ridge])
    weights = np.linalg.solve(normal, np.swapaxes(weighted, 1, 2))[:, 0]
    return np.ascontiguousarray(weights.T, np.float32), (rows, columns)
