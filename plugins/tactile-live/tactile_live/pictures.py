"""Pictures for the page, of the newest reading."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from threading import Lock
from typing import Any, Generic, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.plugins.blame import blame_of
from tactile_core.quantities import Frame, Quantity
from tactile_core.quantities.fields import Layer, Outline, Points, ScalarMap, Surface, VectorMap
from tactile_live.commands import MessageParts

MAP_PX = 320  # Longest side of a map as it is sent: the width of a panel of the page


@dataclass(frozen=True, eq=False)
class NamedLayer:
    """A layer, with a key that is the same in every reading of a sensor."""

    key: str
    layer: Layer


def layers_of(quantities: Iterable[Quantity]) -> tuple[list[NamedLayer], list[str]]:
    """Return the layers of all quantities, and what is wrong with some of them.

    Surfaces come first. A quantity that draws nothing is drawn by its fields, after all others.
    """
    found: list[NamedLayer] = []
    last: list[NamedLayer] = []
    faults = []
    for quantity in quantities:
        name = type(quantity).__name__
        try:
            with blame_of(quantity):
                layers = quantity.layers()
                fields = () if layers else Quantity.layers(quantity)
        except Exception as error:  # a stranger's code
            faults.append(str(error))
        else:
            found += [NamedLayer(f"{name} {layer.title}", layer) for layer in layers]
            last += [NamedLayer(f"{name} {layer.title}", layer) for layer in fields]
    found.sort(key=lambda named: not isinstance(named.layer, Surface))
    return [*found, *last], faults


def picture(frame: Frame, channel: int | None, parts: MessageParts) -> dict[str, Any]:
    """Add the camera's picture as JPEG.

    Parameters
    ----------
    frame : Frame
    channel : int or None
        The light whose picture is wanted. None: all, in colour if there are three.
    parts : MessageParts
    """
    pixels = frame.pixels
    count = pixels.shape[2]
    if channel is not None and 0 <= channel < count:
        pixels = pixels[..., channel]
    elif count == 3:  # red, green and blue
        pixels = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
    else:
        pixels = pixels.mean(axis=2) if count > 1 else pixels[..., 0]
    pixels = _shrink_values(np.ascontiguousarray(pixels), 960)
    if pixels.dtype != np.uint8 or frame.full_scale != np.iinfo(np.uint8).max:
        pixels = cv2.convertScaleAbs(pixels.astype(np.float32), alpha=255 / frame.full_scale)
    encoded = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 80])[1]
    return {"type": "image/jpeg", **parts.picture(encoded.tobytes())}


def titles(layers: Iterable[NamedLayer]) -> list[dict[str, str]]:
    """Return key, title, unit and kind of each map."""
    return [
        {"key": named.key, "title": _title(named.layer), "unit": _unit(named.layer), "kind": kind}
        for named in layers
        if (kind := _map_kind(named.layer))
    ]


def map_of(named: NamedLayer, parts: MessageParts) -> dict[str, Any]:
    """Add a surface, or a map of numbers or vectors, as 16-bit numbers."""
    layer = named.layer
    assert isinstance(layer, Surface | ScalarMap | VectorMap)
    described: dict[str, Any] = {
        "key": named.key,
        "title": _title(layer),
        "unit": _unit(layer),
        "kind": _map_kind(layer),
    }
    if isinstance(layer, VectorMap):
        described["arrows"] = _arrows(layer, parts)
        values = np.hypot(layer.values[..., 0], layer.values[..., 1])
    else:
        values = layer.mm if isinstance(layer, Surface) else layer.values
    if isinstance(layer, Surface):
        described["mm_per_px"] = layer.mm_per_px
    return {**described, **_grid(values, parts)}


def _grid(values: NDArray[Any], parts: MessageParts) -> dict[str, Any]:
    """Add numbers per pixel, reduced and in steps of a 65535th of their range."""
    numbers = _shrink_values(np.ascontiguousarray(values, np.float32), MAP_PX)
    low, high = float(numbers.min()), float(numbers.max())
    if not np.isfinite([low, high]).all():
        numbers = np.nan_to_num(numbers, posinf=0, neginf=0)
        low, high = float(numbers.min()), float(numbers.max())
    steps = (numbers - low) * (np.iinfo(np.uint16).max / max(high - low, 1e-12))
    return {"low": low, "high": high, "values": parts.array(np.rint(steps).astype(np.uint16))}


def overlays(layers: Iterable[NamedLayer], mm_per_px: float, parts: MessageParts) -> Iterator[Any]:
    """Add the outlines and points that are drawn over the picture and the maps."""
    for named in layers:
        layer = named.layer
        if isinstance(layer, Outline):
            area = float(np.count_nonzero(layer.mask)) * mm_per_px**2
            lines = [parts.array(line) for line in _contours(layer.mask)]
            yield {
                "kind": "outline",
                "key": named.key,
                "title": layer.title,
                "area_mm2": area,
                "lines": lines,
            }
        elif isinstance(layer, Points):
            finite = np.isfinite(layer.px).all(axis=1)
            start = layer.px if layer.from_px is None else layer.from_px
            finite &= np.isfinite(start).all(axis=1)
            both = np.hstack([layer.px, start])[finite].astype(np.float32)
            sure = np.ones(len(layer.px), np.bool_) if layer.reliable is None else layer.reliable
            yield {
                "kind": "points",
                "key": named.key,
                "title": layer.title,
                "moved": layer.from_px is not None,
                "places": parts.array(both),
                "reliable": parts.array(sure[finite].astype(np.uint8)),
            }


def _arrows(layer: VectorMap, parts: MessageParts) -> dict[str, Any]:
    """Return x, y, dx, dy of some vectors in an (N, 4) array; pixels, then units of the map."""
    height, width = layer.values.shape[:2]
    step = max(1, round(max(height, width) / 24))
    rows, columns = np.mgrid[step // 2 : height : step, step // 2 : width : step]
    keep = np.ones(rows.shape, np.bool_) if layer.valid is None else layer.valid[rows, columns]
    vectors = layer.values[rows, columns]
    arrows = np.stack([columns, rows, vectors[..., 0], vectors[..., 1]], axis=-1)[keep]
    return parts.array(arrows.astype(np.float32))


def _contours(mask: NDArray[np.bool_]) -> Iterator[NDArray[np.int16]]:
    found = cv2.findContours(mask.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_TC89_L1)[0]
    for line in found:
        yield line.reshape(-1, 2).astype(np.int16)


def _shrink_values(values: NDArray[Any], longest: int) -> NDArray[Any]:
    height, width = values.shape[:2]
    factor = longest / max(height, width)
    if factor >= 1:
        return values
    size = max(1, round(width * factor)), max(1, round(height * factor))
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA))


def _map_kind(layer: Layer) -> str:
    kinds = {Surface: "surface", ScalarMap: "scalars", VectorMap: "vectors"}
    return kinds.get(type(layer), "")


def _title(layer: Layer) -> str:
    return layer.title or "map"


def _unit(layer: Layer) -> str:
    return "mm" if isinstance(layer, Surface) else str(getattr(layer, "unit", ""))


T = TypeVar("T")
Waiting = tuple[asyncio.AbstractEventLoop, asyncio.Future[None]]


class Newest(Generic[T]):
    """Holds the newest value; older ones are forgotten, so that nobody can lag behind.

    Putting a value never blocks and costs nothing while nobody waits.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._count = 0
        self._value: T | None = None
        self._waiting: list[Waiting] = []

    @property
    def value(self) -> T | None:
        """The newest value; None before the first."""
        return self._value

    @property
    def count(self) -> int:
        """Number of values until now."""
        return self._count

    def put(self, value: T) -> None:
        """Replace the value, and wake those who wait; may be called from any thread."""
        with self._lock:
            self._count, self._value = self._count + 1, value
            waiting, self._waiting = self._waiting, []
        _wake_all(waiting)

    def again(self) -> None:
        """Wake those who wait, with the value that there is; may be called from any thread."""
        with self._lock:
            if self._value is None:
                return
            self._count += 1
            waiting, self._waiting = self._waiting, []
        _wake_all(waiting)

    async def after(self, count: int) -> tuple[int, T]:
        """Wait for a value newer than the one of this count, and return the newest."""
        while True:
            with self._lock:
                if self._count > count and self._value is not None:
                    return self._count, self._value
                loop = asyncio.get_running_loop()
                future: asyncio.Future[None] = loop.create_future()
                self._waiting.append((loop, future))
            await future


def _wake_all(waiting: list[Waiting]) -> None:
    for loop, future in waiting:
        with suppress(RuntimeError):  # its loop has ended
            loop.call_soon_threadsafe(_wake, future)


def _wake(future: asyncio.Future[None]) -> None:
    if not future.done():
        future.set_result(None)
