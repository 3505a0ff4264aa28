"""``scan.yaml``: one observation of a GelSight bench, its images in the order of the lights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.printable import shown
from tactile_core.formats.yaml import number, read_mapping

SCAN_FILE = "scan.yaml"
Crop = tuple[int, int, int, int]

_SMALLEST_MM, _LARGEST_MM = 1e-6, 100.0
"""A pixel on the gel."""
_MOST_PX = 100_000

_OURS = frozenset({"images", "guid", "mmperpixel", "crop", "calib", "annotations", "metadata"})


@dataclass(frozen=True)
class Scan:
    """What a ``scan.yaml`` says.

    Attributes
    ----------
    images : tuple of str
        Files relative to the scan's folder, in order; other pictures there do not belong to it.
    mm_per_px : float or None
        None where the file does not know (it says 0 then).
    crop : (x, y, width, height) or None
        In the camera's pixels; None where the file does not know (all 0 then).
    guid, calib : str
    annotations : tuple of mapping
        Shapes that somebody drew, in px; e.g. ``type: GridCircle`` with ``x, y, r``.
    gel_id : str
        ``metadata.gelid``.
    extra : mapping
        All other keys, as they stand.
    """

    images: tuple[str, ...]
    mm_per_px: float | None = None
    crop: Crop | None = None
    guid: str = ""
    calib: str = ""
    annotations: tuple[Mapping[str, Any], ...] = ()
    gel_id: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict)


def read_scan(path: Path) -> Scan:
    """Read a ``scan.yaml``.

    Raises
    ------
    InputError
        The file is missing or is no scan; whether its images exist is not looked at.
    """
    path = Path(path)
    content = read_mapping(path)
    images = content.get("images")
    if not isinstance(images, list) or not images or not all(isinstance(i, str) for i in images):
        raise InputError(f"{path}: 'images' must list the scan's image files")
    images = [image.replace("\\", "/") for image in images]
    outside = next((image for image in images if _leaves(image)), None)
    if outside is not None:
        raise InputError(
            f"{path}: images must lie in the scan's folder, and {shown(outside)} leads out of it; "
            f"bring the file there"
        )
    annotations = content.get("annotations") or []
    if not isinstance(annotations, list) or not all(isinstance(a, dict) for a in annotations):
        raise InputError(f"{path}: 'annotations' must be a list of mappings")
    metadata = content.get("metadata") or {}
    return Scan(
        images=tuple(images),
        mm_per_px=_scale(content.get("mmperpixel"), path),
        crop=_crop(content.get("crop"), path),
        guid=str(content.get("guid") or ""),
        calib=str(content.get("calib") or ""),
        annotations=tuple(annotations),
        gel_id=str(metadata.get("gelid") or "") if isinstance(metadata, dict) else "",
        extra={key: value for key, value in content.items() if key not in _OURS},
    )


def _leaves(image: str) -> bool:
    """Whether a path leads out of the folder that it is relative to."""
    return (
        PurePosixPath(image).is_absolute()
        or PureWindowsPath(image).anchor != ""
        or ".." in PurePosixPath(image).parts
    )


def _scale(value: object, path: Path) -> float | None:
    scale = 0.0 if value is None else number(value, path, "mmperpixel")
    if scale and not _SMALLEST_MM <= scale <= _LARGEST_MM:
        raise InputError(
            f"{path}: mmperpixel must be positive, from {_SMALLEST_MM:g} to {_LARGEST_MM:g}, or 0 "
            f"for unknown, not {scale:g}"
        )
    return scale or None


def _crop(value: object, path: Path) -> Crop | None:
    if value is None or value == []:
        return None
    if not isinstance(value, list) or len(value) != 4:
        raise InputError(f"{path}: crop must be [x, y, width, height], not {shown(value)}")
    x, y, width, height = (round(number(part, path, "crop", high=_MOST_PX)) for part in value)
    if not any((x, y, width, height)):
        return None
    if min(x, y) < 0 or min(width, height) < 1:
        raise InputError(f"{path}: crop {shown(value)} is empty or begins outside the image")
    return (x, y, width, height)
