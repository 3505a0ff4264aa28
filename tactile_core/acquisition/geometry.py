"""Converts camera pixels to the rectified image in which all quantities are measured.

Order: crop, flip, rotate, lens, warp; without a warp, a resize if the sizes differ. Coordinates
start at 0 and are integers at pixel centres, so halving an image maps x to (x − 0.5) / 2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_core.errors import InputError
from tactile_core.interfaces.illumination import COLORS, Color
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import Pixels

Size = tuple[int, int]  # Width and height, px

_CORNER = np.array([[0, 0], [1, 0], [0, 1]])


class ImageGeometry:
    """Applies a profile's ``image`` section to camera images and points.

    Parameters
    ----------
    section : ImageSection
        The profile's ``image`` section.
    """

    def __init__(self, section: ImageSection) -> None:
        self._section = section
        self._maps: tuple[Size, NDArray[np.int16], NDArray[np.uint16]] | None = None
        self._homography = None if section.warp is None else _homography(section)

    @property
    def size_px(self) -> Size:
        """Width and height of the resulting image."""
        return self._section.width_px, self._section.height_px

    def apply(self, pixels: Pixels, color: Color | None = None) -> Pixels:
        """Return the rectified image; the input itself if there is nothing to do.

        Parameters
        ----------
        pixels : (H, W) or (H, W, 3) uint8 or uint16
            Raw camera image.
        color : "red", "green" or "blue", optional
            The only colour to keep; a grey image is taken to be it. Default: all that
            ``image.color`` says.

        Returns
        -------
        (height_px, width_px) or (height_px, width_px, 3), of the same dtype, contiguous
            Pixels that the lens or the warp takes from outside the camera's image are 0.

        Raises
        ------
        InputError
            The image's bit depth or colour differs from the profile, or the crop is larger than
            the image.
        """
        pixels = self._turn_pixels(self._crop_pixels(self._check_pixels(pixels, color)))
        if self._section.lens is not None or self._homography is not None:
            pixels = self._remap_pixels(np.ascontiguousarray(pixels))
        if _size(pixels) != self.size_px:
            pixels = self._resize_pixels(np.ascontiguousarray(pixels))
        return np.ascontiguousarray(pixels)

    def map_points(self, xy: ArrayLike, camera_size_px: Size | None = None) -> NDArray[np.float64]:
        """Map points from the camera's image to the rectified image.

        Parameters
        ----------
        xy : (N, 2)
            In the camera's pixels.
        camera_size_px : (width, height), optional
            Size of the camera's image. Default: the size for which no resize is needed.

        Returns
        -------
        (N, 2) float64
            Points may be outside the image.
        """
        points = np.array(xy, np.float64).reshape(-1, 2)
        section = self._section
        if section.crop is not None:
            points -= section.crop[:2]
            size: Size = section.crop[2:]
        else:
            size = camera_size_px or self._assumed_camera_size()
        points, size = self._turn_points(points, size)
        if section.lens is not None:
            points = self._undistort_points(points)
        if self._homography is not None:
            projected = _homogeneous(points) @ self._homography.T
            return np.asarray(projected[:, :2] / projected[:, 2:])
        return np.asarray((points + 0.5) * (np.array(self.size_px) / size) - 0.5)

    def camera_mm_per_px(self, camera_size_px: Size | None = None) -> float:
        """Return mm per camera pixel on the gel, at the centre of the camera's image.

        Parameters
        ----------
        camera_size_px : (width, height), optional
            See :meth:`map_points`.
        """
        width, height = camera_size_px or self._assumed_camera_size()
        if self._section.crop is not None:
            x, y, width, height = self._section.crop
            middle = np.array([x + width / 2, y + height / 2])
        else:
            middle = np.array([width / 2, height / 2])
        corner, right, down = self.map_points(middle + _CORNER, camera_size_px)
        area = abs(float(np.linalg.det(np.stack([right - corner, down - corner]))))
        return float(self._section.mm_per_px * np.sqrt(area))

    def view(self) -> NDArray[np.float64] | None:
        """Return the homography, (3, 3), from the rectified image to the image before the warp.

        The edges of both are at −1 and 1. The corners of the warp are taken to be centred in the
        camera's image if there is no crop that gives its size. None without a warp.
        """
        if self._section.warp is None or self._homography is None:
            return None
        crop = self._section.crop
        centre = np.mean(self._section.warp.source, axis=0)
        size = (
            2 * centre + 1
            if crop is None
            else np.array(crop[2:][:: -1 if self._section.rotate_deg % 180 else 1])
        )
        from_edges = _from_edges(np.array(self.size_px))
        return np.asarray(
            np.linalg.solve(self._homography @ _from_edges(size), from_edges), np.float64
        )

    def stretch(self, camera_size_px: Size) -> float:
        """Return the ratio of the resize factors along x and y.

        It is 1 if the aspect ratios agree, and if there is a warp.
        """
        if self._homography is not None:
            return 1.0
        crop = self._section.crop
        width, height = camera_size_px if crop is None else crop[2:]
        if self._section.rotate_deg % 180:
            width, height = height, width
        return self.size_px[0] * height / (width * self.size_px[1])

    def _check_pixels(self, pixels: Pixels, color: Color | None) -> Pixels:
        section = self._section
        wanted = np.uint8 if section.bit_depth == 8 else np.uint16
        wrong = _no_image(pixels)
        if wrong:
            raise InputError(wrong)
        if pixels.dtype != wanted:
            raise InputError(
                f"the image has {8 * pixels.dtype.itemsize}-bit values, but the profile specifies "
                f"bit_depth: {section.bit_depth}; record with that depth, or correct 'image'"
            )
        if 8 < section.bit_depth < 16 and pixels.max(initial=0) > section.full_scale:
            raise InputError(
                f"the image has intensities up to {pixels.max()}, but {section.bit_depth} bits end "
                f"at {section.full_scale:.0f}; correct 'image.bit_depth'"
            )
        if color is not None:
            return pixels if pixels.ndim == 2 else pixels[..., COLORS.index(color)]
        if section.color == "luma" and pixels.ndim == 3:
            import cv2

            return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels), cv2.COLOR_RGB2GRAY))
        if section.color == "grey" and pixels.ndim == 3:
            grey = pixels[..., 0]
            if not ((grey == pixels[..., 1]).all() and (grey == pixels[..., 2]).all()):
                raise InputError(
                    "the image is in colour, but the profile specifies color: grey; with white "
                    "lights write 'image.color: luma', with coloured ones 'rgb'"
                )
            return grey  # a grey image that was stored as colour
        if section.color == "rgb" and pixels.ndim == 2:
            raise InputError(
                "the image is grey, but the profile specifies color: rgb; correct 'image.color'"
            )
        return pixels

    def _crop_pixels(self, pixels: Pixels) -> Pixels:
        crop = self._section.crop
        if crop is None:
            return pixels
        x, y, width, height = crop
        if x + width > pixels.shape[1] or y + height > pixels.shape[0]:
            raise InputError(
                f"the crop {list(crop)} reaches beyond the camera's {pixels.shape[1]} × "
                f"{pixels.shape[0]} image; correct 'image.crop'"
            )
        return pixels[y : y + height, x : x + width]

    def _turn_pixels(self, pixels: Pixels) -> Pixels:
        section = self._section
        if section.flip == "none" and section.rotate_deg == 0:
            return pixels
        import cv2  # copying a numpy view of reversed rows takes ten times as long

        if section.flip != "none":
            pixels = cv2.flip(pixels, {"horizontal": 1, "vertical": 0, "both": -1}[section.flip])
        if section.rotate_deg:
            turns = (cv2.ROTATE_90_CLOCKWISE, cv2.ROTATE_180, cv2.ROTATE_90_COUNTERCLOCKWISE)
            pixels = cv2.rotate(pixels, turns[section.rotate_deg // 90 - 1])
        return np.asarray(pixels)

    def _turn_points(
        self, points: NDArray[np.float64], size: Size
    ) -> tuple[NDArray[np.float64], Size]:
        (x, y), (width, height) = points.T, size
        if self._section.flip in ("horizontal", "both"):
            x = width - 1 - x
        if self._section.flip in ("vertical", "both"):
            y = height - 1 - y
        for _ in range(self._section.rotate_deg // 90):
            x, y = height - 1 - y, x
            width, height = height, width
        return np.stack([x, y], 1), (width, height)

    def _assumed_camera_size(self) -> Size:
        width, height = self.size_px
        return (height, width) if self._section.rotate_deg % 180 else (width, height)

    def _resize_pixels(self, pixels: Pixels) -> Pixels:
        import cv2

        width, height = _size(pixels)
        shrinks = self.size_px[0] <= width and self.size_px[1] <= height
        method = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
        return np.asarray(cv2.resize(pixels, self.size_px, interpolation=method))

    def _remap_pixels(self, pixels: Pixels) -> Pixels:
        """Apply lens and warp in one interpolation; two would blur twice."""
        import cv2

        size = self.size_px if self._homography is not None else _size(pixels)
        if self._maps is None or self._maps[0] != size:
            self._maps = (size, *self._make_maps(size))
        _, places, fractions = self._maps
        return np.asarray(
            cv2.remap(pixels, places, fractions, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        )

    def _make_maps(self, size: Size) -> tuple[NDArray[np.int16], NDArray[np.uint16]]:
        import cv2

        matrix, distortion = self._camera()
        onto = matrix if self._homography is None else self._homography @ matrix
        # OpenCV undoes `onto`, distorts and projects: with H K for the new camera that is H⁻¹ first
        places, fractions = cv2.initUndistortRectifyMap(
            matrix, distortion, np.eye(3), onto, size, cv2.CV_16SC2
        )
        return np.asarray(places, np.int16), np.asarray(fractions, np.uint16)

    def _camera(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        lens = self._section.lens
        if lens is None:
            return np.eye(3), np.zeros(4)
        distortion = np.zeros(14)
        distortion[: len(lens.distortion)] = lens.distortion
        return np.array(lens.matrix, np.float64), distortion

    def _undistort_points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Invert the distortion by fixed-point iteration; OpenCV's own stops after five steps."""
        import cv2

        if not len(points):
            return points
        matrix, distortion = self._camera()
        inverse = np.linalg.inv(matrix)
        seen = _homogeneous(points) @ inverse.T
        rays = seen.copy()
        for _ in range(50):  # [count] most steps; most lenses need five
            bent, _ = cv2.projectPoints(
                rays[:, None], np.zeros(3), np.zeros(3), np.eye(3), distortion
            )
            rays[:, :2] += seen[:, :2] - bent.reshape(-1, 2)
        return np.asarray((rays @ matrix.T)[:, :2])


def _homogeneous(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.column_stack([points, np.ones(len(points))])


def _from_edges(size: NDArray[Any]) -> NDArray[np.float64]:
    """Map coordinates that are −1 and 1 at an image's edges to its pixels."""
    x, y = size / 2
    return np.array([[x, 0, x - 0.5], [0, y, y - 0.5], [0, 0, 1]])


def _size(pixels: NDArray[Any]) -> Size:
    return pixels.shape[1], pixels.shape[0]


def _homography(section: ImageSection) -> NDArray[np.float64]:
    import cv2

    assert section.warp is not None
    source, target = (
        np.array(quad, np.float32) for quad in (section.warp.source, section.warp.target)
    )
    homography = np.asarray(cv2.getPerspectiveTransform(source, target), np.float64)
    if not np.isfinite(homography).all() or abs(np.linalg.det(homography)) < 1e-12:
        raise InputError(
            "image.warp: three of the four points are collinear; give the corners of a quadrangle"
        )
    return homography


def _no_image(pixels: Pixels) -> str:
    """Return what an array is that no camera sends, and how it becomes an image; else nothing."""
    if pixels.dtype.kind in "OSU":
        return (
            "the image is no array of intensities; read a file first, as by "
            "cv2.imread(path)[..., ::-1], or give its path to open_sensor(…, input=path)"
        )
    if pixels.size == 0:
        return f"the image is empty, shape {pixels.shape}; give (H, W) or (H, W, 3)"
    if pixels.ndim == 3 and pixels.shape[2] != 3 and pixels.shape[0] in (1, 3):
        return (
            f"the image has its channels first, shape {pixels.shape}; give (H, W, 3), as by "
            f"image.transpose(1, 2, 0)"
        )
    if pixels.ndim != 2 and not (pixels.ndim == 3 and pixels.shape[2] == 3):
        return f"the image has shape {pixels.shape}; give (H, W) or (H, W, 3) in R, G, B order"
    if pixels.dtype.kind not in "ui":
        return (
            f"the image has {pixels.dtype} values; give the camera's own integers, as by "
            f"np.rint(255 * image).astype(np.uint8) if they end at 1"
        )
    return ""
