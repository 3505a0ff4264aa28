"""A subscriber that is no part of the project's own publisher: DDS alone, and rosbags to decode."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, Self

from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.typesys import Stores, get_typestore

from tactile_ros2.dds_types import sample_type

TYPES = get_typestore(Stores.ROS2_JAZZY)

LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='false'/>"
    "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
)
"""Configuration of DDS, in the variable ``CYCLONEDDS_URI``: nothing leaves this computer."""

OWN_DOMAIN = 100 + os.getpid() % 100  # tests that run at once do not hear each other


class Arrival(NamedTuple):
    """A message, and the time of its arrival since 1970."""

    at_s: float
    message: Any


class Subscriber:
    """Takes all messages of some topics, in threads of its own; use it in a ``with`` block."""

    def __init__(self, domain: int, topics: Mapping[str, str], reliable: bool = True) -> None:
        self._topics = topics
        self.arrived: dict[str, list[Arrival]] = {name: [] for name in topics}
        reliability: Any = Policy.Reliability
        qos = Qos(
            reliability.Reliable(duration(seconds=1)) if reliable else reliability.BestEffort,
            Policy.History.KeepAll,
        )
        participant = DomainParticipant(domain)
        self._ending = threading.Event()
        self._threads = []
        for name, kind in topics.items():
            topic = Topic(participant, f"rt{name}", sample_type(kind))
            reader = DataReader(participant, topic, qos=qos)
            self._threads.append(threading.Thread(target=self._take, args=(name, reader)))

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        for thread in self._threads:
            thread.join()

    def _take(self, name: str, reader: Any) -> None:
        while not self._ending.is_set():
            for sample in reader.take_iter(timeout=duration(milliseconds=100)):
                at_s = time.time()
                message = TYPES.deserialize_cdr(sample.cdr, self._topics[name])
                self.arrived[name].append(Arrival(at_s, self.kept(message)))

    def kept(self, message: Any) -> Any:
        """Return what is kept of a message."""
        return message

    def wait_for(self, count: int, names: Iterable[str], timeout_s: float = 30.0) -> None:
        """Wait until that many messages of each of these topics have arrived."""
        until_s = time.monotonic() + timeout_s
        while any(len(self.arrived[name]) < count for name in names):
            assert time.monotonic() < until_s, {n: len(a) for n, a in self.arrived.items()}
            time.sleep(0.01)

    def messages(self, name: str) -> list[Any]:
        """Return the messages of a topic, decoded by rosbags."""
        return [one.message for one in self.arrived[name]]


def stamp_ns(message: Any) -> int:
    """Return the stamp of a message, ns."""
    stamp = message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
