"""The topics of a sensor, and the messages of a reading."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from typing import Any, Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.health import Finding, Health
from tactile_core.plugins.blame import blame_of
from tactile_core.quantities import Frame, HeightMap, Quantity, SlipState
from tactile_rosbag.messages import (
    Message,
    header_of,
    height_message,
    image_message,
    make,
    points_message,
    wrench_message,
)
from tactile_rosbag.names import SensorNames
from tactile_rosbag.wrenches import has_wrench, wrench_of

DIAGNOSTICS: Final = "diagnostics"
_IMAGE = "sensor_msgs/msg/Image"
_OK, _WARN = 0, 1  # Levels of diagnostic_msgs/DiagnosticStatus


class TopicKind(NamedTuple):
    """One kind of topic.

    Attributes
    ----------
    name : str
        Below the sensor's own name.
    message : str
        Type of its messages.
    is_given : callable
        Whether a type of quantity has what is published.
    quantity : str
        What has to be measured, in words; empty for what every sensor has.
    """

    name: str
    message: str
    is_given: Callable[[type[Quantity]], bool] = lambda kind: True
    quantity: str = ""


def _is_height(kind: type[Quantity]) -> bool:
    return issubclass(kind, HeightMap)


def _is_slip(kind: type[Quantity]) -> bool:
    return issubclass(kind, SlipState)


KINDS: Final = (
    TopicKind("image_raw", _IMAGE),
    TopicKind("height", _IMAGE, _is_height, "height"),
    TopicKind("points", "sensor_msgs/msg/PointCloud2", _is_height, "height"),
    TopicKind("wrench", "geometry_msgs/msg/WrenchStamped", has_wrench, "force"),
    TopicKind("slip_degree", "std_msgs/msg/Float32", _is_slip, "slip"),
    TopicKind("slip_state", "std_msgs/msg/String", _is_slip, "slip"),
    TopicKind(DIAGNOSTICS, "diagnostic_msgs/msg/DiagnosticArray"),
)


def topics_of(gives: Collection[type[Quantity]]) -> tuple[TopicKind, ...]:
    """Return the topics of a sensor that measures these quantities."""
    return tuple(kind for kind in KINDS if not kind.quantity or any(map(kind.is_given, gives)))


def missing_note(gives: Collection[type[Quantity]]) -> str:
    """Return a sentence about the topics that are left out; empty if none are."""
    there = topics_of(gives)
    missing = [kind for kind in KINDS if kind not in there]
    if not missing:
        return ""
    words = ", ".join(dict.fromkeys(kind.quantity for kind in missing))
    names = ", ".join(kind.name for kind in missing)
    return f"not measured: {words}; so these topics are left out: {names}"


def messages_of(
    reading: Reading, stamp_ns: int, names: SensorNames, wanted: Collection[str]
) -> Iterator[tuple[str, Message]]:
    """Yield the messages of a reading, each with the name of its topic.

    Parameters
    ----------
    reading : Reading
    stamp_ns : int
        Time of exposure since 1970, ns.
    names : SensorNames
    wanted : collection of str
        Names of the topics that somebody listens to; nothing is computed for others.
    """
    head = header_of(stamp_ns, names.frame_id)
    if "image_raw" in wanted:
        yield "image_raw", image_message(bgr_of(reading.frame), "bgr8", head)
    for quantity in reading.quantities.values():
        with blame_of(quantity):
            found = list(_messages(quantity.finite(), head, wanted))
        yield from ((name, message) for name, message in found if name in wanted)


def _messages(
    quantity: Quantity, head: Any, wanted: Collection[str]
) -> Iterator[tuple[str, Message]]:
    if isinstance(quantity, HeightMap):
        if "height" in wanted:
            yield "height", height_message(quantity.mm, head)
        if "points" in wanted:
            yield "points", points_message(quantity.points_mm, head)
    if isinstance(quantity, SlipState):
        yield "slip_degree", _data("std_msgs/msg/Float32", float(quantity.degree))
        yield "slip_state", _data("std_msgs/msg/String", quantity.state)
    wrench = wrench_of(quantity)
    if wrench is not None:
        yield "wrench", wrench_message(wrench, head)


def bgr_of(frame: Frame) -> NDArray[np.uint8]:
    """Return (H, W, 3) uint8 in B, G, R order: the colours, or for other channels their mean."""
    pixels = frame.pixels
    if frame.full_scale != np.iinfo(np.uint8).max:
        pixels = np.rint(pixels.astype(np.float32) * (255 / frame.full_scale)).astype(np.uint8)
    if pixels.shape[2] == 3:
        return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR), np.uint8)
    grey = np.rint(pixels.mean(axis=2)).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def diagnostics_message(
    health: Health, warnings: Collection[str], stamp_ns: int, names: SensorNames, sensor: str
) -> Message:
    """Return the sensor's health as a ``DiagnosticArray``.

    The first status is that of the whole sensor, with the warnings of the latest reading; the
    others are its findings, without those that cannot be judged.
    """
    sentences = dict.fromkeys([*health.warnings, *warnings])
    whole = _status(sensor, "sensor", _WARN if sentences else _OK, "; ".join(sentences), {})
    parts = [
        _status(sensor, name, _OK if found.verdict == "ok" else _WARN, found.message, _facts(found))
        for name, found in health.findings()
        if found.verdict != "unknown"
    ]
    kind = "diagnostic_msgs/msg/DiagnosticArray"
    head = header_of(stamp_ns, names.frame_id)
    return Message(kind, make(kind, header=head, status=[whole, *parts]))


def _facts(found: Finding) -> dict[str, str]:
    facts = {"value": found.value, "expected": found.expected, "unit": found.unit or None}
    return {key: str(value) for key, value in facts.items() if value is not None}


def _status(sensor: str, part: str, level: int, message: str, facts: dict[str, str]) -> Any:
    values = [
        make("diagnostic_msgs/msg/KeyValue", key=key, value=value) for key, value in facts.items()
    ]
    return make(
        "diagnostic_msgs/msg/DiagnosticStatus",
        level=level,
        name=f"tactile {sensor}: {part}",
        message=message or "ok",
        hardware_id=sensor,
        values=values,
    )


def _data(kind: str, value: Any) -> Message:
    return Message(kind, make(kind, data=value))
