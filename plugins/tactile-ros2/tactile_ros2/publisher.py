"""Publishes ROS messages over DDS, as a node of ROS 2 does, but without ROS."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import Any

from cyclonedds.core import DDSException
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from tactile_core.errors import DeviceError, InputError
from tactile_core.interfaces.device import Closing
from tactile_ros2.dds_types import dds_topic, sample_of, sample_type
from tactile_rosbag.messages import Message, types

DOMAIN_VARIABLE = "ROS_DOMAIN_ID"
# [domain] The last whose ports are below 65536 with the ports of the standard: 7400 + 250 · domain
LARGEST_DOMAIN = 232

# As rclpy publishes by default, which both kinds of subscriber accept: reliable, the last ten
# messages, none for those who come later. ROS reads nothing but the first version of CDR.
_QOS = Qos(
    Policy.Reliability.Reliable(max_blocking_time=duration(milliseconds=100)),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(10),
    Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
)


class Publisher(Closing):
    """Topics in one domain of DDS; use it in a ``with`` block.

    Parameters
    ----------
    domain : int
        Computers and programs see only topics of their own domain.

    Raises
    ------
    DeviceError
        The network cannot be used.
    """

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self._writers: dict[str, DataWriter[Any]] = {}
        try:
            self._participant: DomainParticipant | None = DomainParticipant(domain)
        except DDSException as error:
            raise DeviceError(
                f"domain {domain} cannot be joined ({error.msg or error}); is there a network, and "
                f"is CYCLONEDDS_URI, if it is set, a valid configuration?"
            ) from error

    def advertise(self, topic: str, kind: str) -> None:
        """Announce a topic such as ``/tactile/a/height`` of a type ``sensor_msgs/msg/Image``."""
        assert self._participant is not None, "the publisher is closed"
        described = Topic(self._participant, dds_topic(topic), sample_type(kind), qos=_QOS)
        self._writers[topic] = DataWriter(self._participant, described, qos=_QOS)

    def is_heard(self, topic: str) -> bool:
        """Whether somebody has subscribed to a topic."""
        return bool(self._writers[topic].get_matched_subscriptions())

    def publish(self, topic: str, message: Message) -> bool:
        """Send a message; return False if a subscriber is so slow that it had to be left out."""
        writer = self._writers[topic]
        cdr = bytes(types().serialize_cdr(message.content, message.type))
        try:
            writer.write(sample_of(message.type, cdr))
        except DDSException as error:
            if error.code == DDSException.DDS_RETCODE_TIMEOUT:
                return False
            raise DeviceError(f"{topic} cannot be published: {error.msg or error}") from error
        return True

    def close(self) -> None:
        """Leave the domain, when subscribers have what was sent; may be called twice."""
        for writer in self._writers.values():
            # version 11.0.1 fails with an AttributeError where it should return False
            with suppress(DDSException, AttributeError):
                writer.wait_for_acks(duration(seconds=1))
        self._writers.clear()
        self._participant = None


def domain_of(given: int | None) -> int:
    """Return the domain: as given, else that of the variable ``ROS_DOMAIN_ID``, else 0.

    Raises
    ------
    InputError
        There is no such domain.
    """
    asked = os.environ.get(DOMAIN_VARIABLE, "") if given is None else str(given)
    where = DOMAIN_VARIABLE if given is None else "--domain"
    if not asked:
        return 0
    if not asked.isdecimal() or int(asked) > LARGEST_DOMAIN:
        raise InputError(
            f"{where} is {asked!r}, but domains are numbers from 0 to {LARGEST_DOMAIN}; give the "
            f"one of the programs that listen, which is 0 unless they set {DOMAIN_VARIABLE}"
        )
    return int(asked)
