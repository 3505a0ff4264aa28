"""``rosbag.bag``: one ROS 2 bag with everything that a run measured."""

from __future__ import annotations

import json
import re
from typing import ClassVar, Final

from pydantic import BaseModel, Field
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.sink import Reading, Session, Sink
from tactile_core.quantities import HeightMap, Quantity
from tactile_core.quantities.fields import fields_of
from tactile_rosbag.messages import (
    Message,
    camera_message,
    field_message,
    header_of,
    height_message,
    points_message,
    types,
    wrench_message,
)
from tactile_rosbag.names import SensorNames, ros_name, stamp_of
from tactile_rosbag.wrenches import wrench_of

_NEW_WORD = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")
_BAG_VERSION: Final = 9  # Version of the bag's metadata, of ROS 2 Jazzy


class BagOptions(Options):
    """Options of ``rosbag.bag``."""

    points: bool = Field(default=True, description="Write a point cloud beside each height map.")
    fields: bool = Field(
        default=True,
        description="Write all fields of all quantities, not only images, height, points and "
        "wrench.",
    )


class Bag(Sink):
    """A folder ``NAME.rosbag`` with topics below ``/tactile/<serial>``, in SI units.

    ``camera/image_raw`` or ``camera/compressed`` has what the camera sent, ``height`` a
    ``sensor_msgs/Image`` of 32FC1 in metres, ``points`` a ``PointCloud2``, ``wrench`` a
    ``WrenchStamped`` if a quantity has forces, and ``<quantity>/<field>`` every other field.
    """

    Options: ClassVar[type[BaseModel]] = BagOptions
    session_ending: ClassVar[str] = ".rosbag"
    keeps_raw: ClassVar[bool] = True

    def __init__(self, options: BagOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._writer: Writer | None = None
        self._connections: dict[str, Connection] = {}
        self._units: dict[str, str] = {}

    def open(self, session: Session) -> None:
        """Create the bag."""
        super().open(session)
        self._connections, self._units = {}, {}
        self._names = SensorNames.of_unit(session.serial, session.build.name)
        self._writer = Writer(
            self.new_path(), version=_BAG_VERSION, storage_plugin=StoragePlugin.MCAP
        )
        self._writer.open()

    def write(self, reading: Reading) -> None:
        """Write the images and the quantities of a reading, all with its timestamp."""
        stamp_ns = stamp_of(reading.frame)
        head = header_of(stamp_ns, self._names.frame_id)
        for name, image in reading.frame.pictures().items():
            kind = "compressed" if image.encoded is not None else "image_raw"
            self._write(f"{ros_name(name)}/{kind}", stamp_ns, camera_message(image, head))
        for quantity in (*reading.quantities.values(), *reading.inputs.values()):
            with self.session.guard(quantity):
                messages = self._messages(quantity.finite(), head)
            for topic, message in messages.items():
                self._write(topic, stamp_ns, message)

    def close(self) -> None:
        """Complete the bag."""
        if self._writer is not None:
            writer, self._writer = self._writer, None
            writer.set_custom_data("units", json.dumps(self._units))
            writer.close()

    def _messages(self, quantity: Quantity, head: object) -> dict[str, Message]:
        found: dict[str, Message] = {}
        if isinstance(quantity, HeightMap):
            found["height"] = height_message(quantity.mm, head)
            if self._settings.points:
                found["points"] = points_message(quantity.points_mm, head)
        wrench = wrench_of(quantity)
        if wrench is not None:
            found["wrench"] = wrench_message(wrench, head)
        kind = ros_name(_NEW_WORD.sub("_", type(quantity).__name__).lower())
        for field in fields_of(type(quantity)) if self._settings.fields else ():
            if not (isinstance(quantity, HeightMap) and field.name == "mm"):
                message = field_message(quantity, field, head)
                if message is not None:
                    found[f"{kind}/{ros_name(field.name)}"] = message
        return found

    def _write(self, name: str, stamp_ns: int, message: Message) -> None:
        if self._writer is None:
            raise OSError("the bag is closed")
        topic = self._names.topic(name)
        connection = self._connections.get(topic)
        if connection is None:
            connection = self._connections[topic] = self._writer.add_connection(
                topic, message.type, typestore=types()
            )
            if message.unit:
                self._units[topic] = message.unit
        self._writer.write(
            connection, stamp_ns, types().serialize_cdr(message.content, message.type)
        )
