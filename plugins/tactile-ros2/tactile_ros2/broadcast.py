"""Publishes a sensor: reads it, and sends each reading to whoever listens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from tactile_core.acquisition.free_running import HOST, Clock
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.sensor import Sensor
from tactile_ros2.clocks import Playback
from tactile_ros2.publisher import DOMAIN_VARIABLE, Publisher
from tactile_ros2.topics import (
    DIAGNOSTICS,
    diagnostics_message,
    messages_of,
    missing_note,
    topics_of,
)
from tactile_rosbag.messages import Message
from tactile_rosbag.names import SensorNames

_DIAGNOSTICS_S = 1.0  # Period that REP 107 recommends, s
_UNHEARD_S = 10.0  # Time without any subscriber after which there is a note, s


@dataclass(frozen=True)
class Published:
    """One observation that was published.

    Attributes
    ----------
    reading : Reading
    stamp_ns : int
        Stamp of its messages.
    topics : tuple of str
        Names of the topics that somebody got it on.
    """

    reading: Reading
    stamp_ns: int
    topics: tuple[str, ...]


def names_of(sensor: Sensor) -> SensorNames:
    """Return the names of a sensor in ROS."""
    return SensorNames.of_unit(sensor.serial, sensor.profile.name)


class Broadcast:
    """Topics of an open sensor.

    Parameters
    ----------
    sensor : Sensor
    publisher : Publisher
    say : callable
        Receives notes, each a sentence.
    clock : Clock
        Paces what is not live.

    Attributes
    ----------
    topics : mapping of str to str
        The type of each topic, by its full name.
    """

    def __init__(
        self,
        sensor: Sensor,
        publisher: Publisher,
        say: Callable[[str], None],
        clock: Clock = HOST,
    ) -> None:
        self._sensor, self._publisher, self._say = sensor, publisher, say
        self._clock = clock
        self._names = names_of(sensor)
        gives = sensor.pipeline.gives
        self._topics = {kind.name: self._names.topic(kind.name) for kind in topics_of(gives)}
        self.topics = {self._topics[kind.name]: kind.message for kind in topics_of(gives)}
        for topic, kind in self.topics.items():
            publisher.advertise(topic, kind)
        note = missing_note(gives)
        if note:
            say(note)
        self._diagnosed_s = self._heard_s = float("-inf")
        self._slow: set[str] = set()

    def publish(self) -> Iterator[Published]:
        """Publish reading after reading, and yield each, until the recording ends."""
        playback = Playback(self._sensor.is_live, self._say, self._clock)
        self._heard_s = self._clock.now()
        while (frame := self._sensor.acquire()) is not None:
            stamp_ns = playback.stamp(frame)
            reading = self._sensor.measure(frame)
            heard = self._listened_to()
            for name, message in messages_of(reading, stamp_ns, self._names, heard):
                self._send(name, message)
            if DIAGNOSTICS in heard and self._is_diagnosis_due():
                self._send(DIAGNOSTICS, self._diagnosis(reading, stamp_ns))
            yield Published(reading, stamp_ns, heard)

    def _listened_to(self) -> tuple[str, ...]:
        """Return the names of the topics with subscribers; note if there are none for long."""
        heard = tuple(n for n, topic in self._topics.items() if self._publisher.is_heard(topic))
        now_s = self._clock.now()
        if heard:
            self._heard_s = now_s
        elif now_s - self._heard_s > _UNHEARD_S:
            self._heard_s = float("inf")  # said once, until somebody comes and goes
            self._say(
                f"nobody has subscribed in domain {self._publisher.domain} for {_UNHEARD_S:.0f} s; "
                f"set the same {DOMAIN_VARIABLE} for the programs that listen, and check that the "
                f"network passes multicast"
            )
        return heard

    def _send(self, name: str, message: Message) -> None:
        if not self._publisher.publish(self._topics[name], message) and name not in self._slow:
            self._slow.add(name)
            self._say(
                f"a subscriber of {self._topics[name]} is too slow, so messages are left out; let "
                f"it subscribe with 'best effort', or to fewer topics"
            )

    def _is_diagnosis_due(self) -> bool:
        now_s = self._clock.now()
        if now_s - self._diagnosed_s < _DIAGNOSTICS_S:
            return False
        self._diagnosed_s = now_s
        return True

    def _diagnosis(self, reading: Reading, stamp_ns: int) -> Message:
        return diagnostics_message(
            self._sensor.health(), reading.warnings, stamp_ns, self._names, self._sensor.name
        )
